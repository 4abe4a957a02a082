#pragma once
/// The boundary of an outcome near a place, as the planes of it that were located: where it has edges several of them
/// meet (docs/theory/uncertainty.md, section 3).

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "uncertainty/space.h"
#include "uncertainty/tangent.h"
#include "uncertainty/wall.h"

namespace topple::uncertainty {

class Boundary {
 public:
  using Places = std::vector<const Point*>;
  struct Plane {
    HalfSpace side;     // from the zero point, by widths
    Point at;           // where it was found
    double reach = 0;   // of the places that it was found by
    double error = -1;  // as a part of the distance from `at`; negative: what planes that are found on the way have
  };

  /// Lengths are measured in parts of `scale`, one per input; `axes` may vary. Planes that were found over more than
  /// `edge_reach` do not tell of edges: they are turned where the boundary is round, too.
  Boundary(std::vector<double> scale, std::vector<int> axes, double edge_reach)
      : scale_(std::move(scale)), axes_(std::move(axes)), edge_reach_(edge_reach) {}

  void clear();
  /// Takes the plane that was found near `from`, within `reach`, and drops those that it replaces. Planes that leave
  /// out `from` or one of `inside`, known places of the outcome, are not kept: they mix what meets at an edge, or the
  /// outcome is not convex there. True where edges show for the first time: the plane is turned against the one before.
  bool keep(const WallProbe&, const Point& from, double reach, const Places& inside);
  bool has_edges() const { return has_edges_; }
  /// Whether the latest plane is turned against the one before.
  bool is_turned() const { return is_turned_; }
  /// Whether it is among those that are kept.
  bool has_kept() const { return has_kept_; }
  /// Takes planes that were found before, as far as they lie near and leave nothing out.
  void adopt(const std::vector<Plane>&, const Point& from, double reach, const Places& inside);
  /// Drops planes that leave out what is known now, or are too coarse for `reach`.
  void review(const Point& from, double reach, const Places& inside);
  /// Those that meet there.
  const std::vector<Plane>& planes() const { return planes_; }
  /// Whether one of the planes tells that a place does not belong to the outcome, as far as it is known within `reach`.
  bool explains(const Point& x, double reach) const;
  /// All planes, or the latest alone, seen from a place and moved in by `margin`.
  std::vector<HalfSpace> see(const Point& from, double margin) const;
  std::vector<HalfSpace> see_latest(const Point& from, double margin) const;

  /// Of `inside`, no farther than `reach` from `from` along an axis, and `from` itself the place that is farthest from
  /// all of `outside`, and how far that is (3 `reach` at most): seen from there edges are away.
  std::pair<Point, double> find_inner(const Point& from, double reach, const Places& inside,
                                      const Places& outside) const;
  /// The largest distance along an axis.
  double calc_offset(const Point& a, const Point& b) const { return uncertainty::calc_offset(a, b, axes_, scale_); }

 private:
  double calc_distance(const Plane&, const Point&) const;
  /// The length over which a plane is continued, of which its error is a part.
  double calc_reach(const Plane&, const Point&) const;
  bool leaves_out(const Plane&, const Point& from, double reach, const Places& inside) const;
  HalfSpace see(const Plane&, const Point& from, double margin) const;

  std::vector<double> scale_;
  std::vector<int> axes_;
  double edge_reach_;
  std::vector<Plane> planes_;
  Plane latest_;
  bool has_edges_ = false, is_turned_ = false, has_kept_ = false;
};

/// Boundaries of outcomes that are planes, as far as they were looked at.
struct Facets {
  std::map<int, std::vector<Boundary::Plane>> planes;  // that bound an outcome
  bool has_bends = false;  // one of them bends; as outcomes have boundaries in common no more is looked at
};

}  // namespace topple::uncertainty
