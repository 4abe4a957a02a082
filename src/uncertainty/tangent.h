#pragma once
/// Steps along constraints, which cost no runs: the half spaces that constraints and a joint membership are to first
/// order, and the place in them that is nearest to a target (docs/theory/uncertainty.md, section 3).

#include <vector>

#include "uncertainty/space.h"

namespace topple::uncertainty {

/// a·u <= b for steps u by widths of the support.
struct HalfSpace {
  std::vector<double> a;
  double b = 0;
};

/// What ties the inputs near a place of the cut at alpha: steps from `base`, seen from base + u. Leaves out what has no
/// slope there.
///   axes   inputs that u has coordinates of
///   scale  widths of all inputs
std::vector<HalfSpace> find_tangents(const Space&, double alpha, const Point& base, const std::vector<int>& axes,
                                     const std::vector<double>& scale, const std::vector<double>& u);

/// The place nearest to `target` in all half spaces and between `lower` and `upper`, after Dykstra; only nearly inside
/// where they hardly have a place in common.
std::vector<double> project(const std::vector<HalfSpace>&, const std::vector<double>& lower,
                            const std::vector<double>& upper, const std::vector<double>& target);

}  // namespace topple::uncertainty
