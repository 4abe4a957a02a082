#pragma once
/// A search along the axes for better basins than the one where the best point lies (docs/theory/uncertainty.md,
/// section 3).

#include <vector>

#include "uncertainty/local_search.h"

namespace topple::uncertainty {

/// Lines through the best point, along every axis from end to end of the cut: the ends, places of a grid that all
/// searches share, so that many of them are run already, and places that are given; then the vertices of parabolas in
/// the valleys of each line that may be lower than the best point. What improves alone is tried together. Lines begin
/// again where a move left the valley in which the best point lay, until none does: then no axis alone leads to a
/// better basin, as far as the places can tell. Finds the best combination where inputs act on their own, and more
/// places would find it where they nearly do. Not for corners of many inputs: see FaceSearch.
class LineSearch : public LocalSearch {
 public:
  struct Options {
    int places = 12;                        // steps of the grid over the support
    std::vector<std::vector<double>> more;  // further places, in the order of the region's axes; may be empty
    double least_gain = 0;                  // of the value, absolute: less is no gain
    int iterations = 8;                     // at most
  };
  LineSearch(Region region, Point start, const Told& at_start, const Options& options);
  void tell(std::span<const Told> told) override;

 private:
  struct Place {
    double at = 0, value = 0;
    bool operator<(const Place& other) const { return at < other.at; }
  };
  struct Axis {
    int input = 0;
    std::vector<Place> line;  // rising, the best point's place with them
    double from = 0, to = 0;  // the neighbours of the best point's place before anything was refined
    Place best;
  };
  struct Asked {
    int axis = 0;
    double at = 0;
  };
  void ask_line();
  void ask_vertices();
  void ask_together();
  void conclude();
  void add(std::size_t axis, double at);

  Region region_;
  Options options_;
  Box support_;
  std::vector<Axis> axes_;
  std::vector<Asked> asked_;
  enum class Stage { Line, Vertex, Together } stage_ = Stage::Line;
  Point next_;
  double next_value_ = 0;
  int next_outcome_ = 0, iteration_ = 0, refined_ = 0;
};

}  // namespace topple::uncertainty
