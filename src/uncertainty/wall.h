#pragma once
/// Where another outcome begins: the boundary near a point as a plane, from runs on both sides
/// (docs/theory/uncertainty.md, section 3).

#include <functional>
#include <vector>

#include "uncertainty/mapping.h"
#include "uncertainty/space.h"

namespace topple::uncertainty {

/// Asks for points and is told which of them are of the inside's class, like a LocalSearch.
class WallProbe {
 public:
  /// Tells without a run whether a point counts at all; empty: all do.
  using Allow = std::function<bool(const Point&)>;
  /// The place that counts and is nearest to `to`, seen from a place that counts; empty: on the way there.
  using Project = std::function<Point(const Point& from, const Point& to)>;
  /// `inside` and `outside` are known; lengths are measured in parts of `scale`, one per input; `axes` may vary. Rays
  /// end where points no longer count. Where what is found is no plane, they are drawn together by 8 times, so many
  /// times at most.
  WallProbe(const Box& box, std::vector<double> scale, std::vector<int> axes, Point inside, Point outside,
            double radius, Allow allow = {}, Project project = {}, int most_nearer = 0);
  const std::vector<Point>& pending() const { return pending_; }
  void tell(const std::vector<bool>& is_inside);
  bool is_done() const { return pending_.empty(); }
  /// Whether a plane was found.
  bool found() const { return !normal_.empty(); }
  /// Unit vector out of the inside, one per axis.
  const std::vector<double>& normal() const { return normal_; }
  /// Of the places it was found by, as the one that was given or smaller.
  double radius() const { return radius_; }
  /// Distance of a point from the plane, positive inside.
  double calc_distance(const Point&) const;

 private:
  struct Ray {
    Point to;
    double in = 0, out = 1;
    int axis = -1;  // towards which it is turned; -1: not
    bool crosses = true, is_mirrored = false;
    int round = 0;
    int asked = 0;  // sections, up to the first that does not count
  };
  bool is_allowed(const Point& x) const { return !allow_ || allow_(x); }
  Point blend(const Point& to, double t) const;
  double aim(const Point& to);
  Ray make_ray(int axis, bool is_mirrored) const;
  void make_rays();
  void ask_sections();
  bool is_bent() const;
  void ask_nearer();
  void fit();

  Box box_;
  std::vector<double> scale_;
  std::vector<int> axes_;
  Point anchor_, outside_;
  std::vector<double> direction_;
  double radius_;
  Allow allow_;
  Project project_;
  std::vector<Ray> rays_;
  std::vector<Point> pending_;
  std::vector<double> normal_;
  double offset_ = 0;
  bool has_anchor_ = false;
  int most_nearer_, nearer_ = 0;  // times that the places were drawn together
};

}  // namespace topple::uncertainty
