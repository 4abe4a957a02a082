#pragma once
/// A local search for values with kinks and cusps (docs/theory/uncertainty.md, section 3).

#include <optional>

#include "uncertainty/local_search.h"

namespace topple::uncertainty {

/// Slopes are taken beside every place that is tried, because the lowest places lie on edges. The largest of the planes
/// they make is a model with edges, whose lowest place within a radius is tried next, until less than the tolerance is
/// promised there: a bundle method. What it gains along an edge no quadratic model finds.
class KinkSearch : public LocalSearch {
 public:
  struct Options {
    double radius = 0.03;     // as a part of the support's width, the first
    double tolerance = 1e-5;  // of the value, absolute: ends when no more is promised
    double smallest = 1e-12;  // radius at which it ends anyway
    int iterations = 60;      // at most
    std::uint64_t seed = 1;
  };
  KinkSearch(Region region, Point start, const Told& at_start, const Options& options);
  void tell(std::span<const Told> told) override;

 private:
  struct Plane {
    Point x;
    double value = 0;
    std::vector<double> slope;  // by widths, in the order of the axes
  };
  void ask(const Point&);
  void ask_next();
  std::optional<Plane> read(std::span<const Told> told) const;
  double distance_to(const Point&) const;

  Region region_;
  Options options_;
  std::vector<Plane> planes_;
  Random random_;
  double radius_, promised_ = 0;
  int iteration_ = 0, in_vain_ = 0, checks_ = 0;
  bool is_first_ = true;
};

/// Whether a place is so far off all constraints that its kinks are none of theirs.
bool is_off_constraints(const Region&, const Point&);

/// max_j (at[j] + slopes[j]·d), an upper envelope of planes: the place between `lower` and `upper` where it is least.
std::vector<double> find_lowest(const std::vector<double>& at, const std::vector<std::vector<double>>& slopes,
                                const std::vector<double>& lower, const std::vector<double>& upper);

}  // namespace topple::uncertainty
