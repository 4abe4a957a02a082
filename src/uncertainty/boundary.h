#pragma once
/// The boundary of an outcome near a place, as the planes of it that were located: where it has edges several of them
/// meet (docs/theory/uncertainty.md, section 3).

#include <vector>

#include "uncertainty/space.h"
#include "uncertainty/tangent.h"
#include "uncertainty/wall.h"

namespace topple::uncertainty {

class Boundary {
 public:
  using Places = std::vector<const Point*>;

  /// Lengths are measured in parts of `scale`, one per input; `axes` may vary.
  Boundary(std::vector<double> scale, std::vector<int> axes) : scale_(std::move(scale)), axes_(std::move(axes)) {}

  void clear();
  /// Takes the plane that was found near `from`, within `reach`, and drops those that it replaces. Planes that leave
  /// out `from` or one of `inside`, known places of the outcome, are not kept: they mix what meets at an edge, or the
  /// outcome is not convex there. True where edges show for the first time: the plane is turned against the one before.
  bool keep(const WallProbe&, const Point& from, double reach, const Places& inside);
  bool has_edges() const { return has_edges_; }
  /// How many meet there.
  std::size_t size() const { return planes_.size(); }
  /// Whether one of the planes tells that a place does not belong to the outcome.
  bool explains(const Point& x) const;
  /// All planes, or the latest alone, seen from a place and moved in by `margin`.
  std::vector<HalfSpace> see(const Point& from, double margin) const;
  std::vector<HalfSpace> see_latest(const Point& from, double margin) const;

  /// Of `inside`, no farther than `reach` from `from` along an axis, and `from` itself the place that is farthest from
  /// all of `outside`: seen from there edges are away.
  Point find_inner(const Point& from, double reach, const Places& inside, const Places& outside) const;
  /// The largest distance along an axis.
  double calc_offset(const Point& a, const Point& b) const;

 private:
  struct Plane {
    HalfSpace side;    // from the zero point
    double reach = 0;  // of the places that it was found by
  };
  double calc_distance(const Plane&, const Point&) const;
  bool leaves_out(const Plane&, const Point& from, double reach, const Places& inside) const;
  HalfSpace see(const Plane&, const Point& from, double margin) const;

  std::vector<double> scale_;
  std::vector<int> axes_;
  std::vector<Plane> planes_;
  Plane latest_;
  bool has_edges_ = false;
};

}  // namespace topple::uncertainty
