#pragma once
/// Quadratic programmes over cuts, which cost no runs: what ties the inputs is known where it is asked
/// (docs/theory/uncertainty.md, section 3).

#include <optional>
#include <vector>

#include "uncertainty/space.h"
#include "uncertainty/tangent.h"

namespace topple::uncertainty {

/// slope·v + ½ v·H·v
struct Quadratic {
  std::vector<double> slope;
  std::vector<double> hessian;  // n x n
  double operator()(const std::vector<double>& v) const;
};

/// A minimum of q over half spaces and between `lower` and `upper` by active sets, begun at `start`, which lies in all
/// of them. Where q bends downwards it is one of several.
std::vector<double> minimise(const Quadratic& q, const std::vector<HalfSpace>&, const std::vector<double>& lower,
                             const std::vector<double>& upper, std::vector<double> start);

/// The cut at alpha as its supporting half spaces, found where they are asked for: of a convex cut the whole truth, of
/// another one a guess. Keeps what it has found. Space outlives it.
class CutProgram {
 public:
  /// `scale`: widths of all inputs; `axes`: those that vary.
  CutProgram(const Space&, double alpha, std::vector<double> scale, std::vector<int> axes);

  /// A place of the cut where q is low, which q sees from `base` by widths along the axes: as far as `reach` from
  /// there. `base` belongs to the cut, and is given back where nothing better is found.
  ///   sides   further half spaces, seen from `base`; one that leaves `base` out is moved there
  Point minimise_from(const Point& base, const Quadratic& q, double reach, const std::vector<HalfSpace>& sides = {});
  /// The place of the cut that is nearest to `target`, seen from `base`, no farther than `reach` along any axis.
  Point project_from(const Point& base, const Point& target, double reach);

 private:
  friend Point find_most_possible(const Space&, const std::vector<double>&, const std::vector<int>&, const Point&,
                                  double, const std::vector<HalfSpace>&);
  bool contains(const Point& x) const { return is_in_cut(space_, box_, alpha_, x); }
  std::optional<HalfSpace> find_support(const Point& x);
  void look_around();
  std::optional<HalfSpace> find_face(const Point& end) const;
  bool cut_off(const Point& x, const Point& base);
  std::vector<double> find_way(const Point& from, const Point& to) const;  // by widths
  Point move(const Point& base, const std::vector<double>& v) const;
  Point pull(const Point& base, Point x) const;
  Point find_place(const Point& base, const Quadratic& q, double reach, const std::vector<HalfSpace>& sides,
                   const std::vector<double>& start);

  const Space& space_;
  double alpha_;
  Box box_;
  std::vector<double> scale_;
  std::vector<int> axes_;
  Point centre_;
  std::vector<HalfSpace> planes_;            // by widths from the centre
  std::vector<std::vector<double>> inside_;  // places of the cut at its edge, as the planes; the latest
};

/// The place with the largest membership in all half spaces `sides`, which are seen from `base` by widths along the
/// axes, no farther than `reach` from there along any axis. `base` where nothing more possible is found.
Point find_most_possible(const Space&, const std::vector<double>& scale, const std::vector<int>& axes,
                         const Point& base, double reach, const std::vector<HalfSpace>& sides);

}  // namespace topple::uncertainty
