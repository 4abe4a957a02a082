#pragma once
/// Outlines of what many rectangles cover together.

#include <array>
#include <vector>

namespace topple {

/// Along the axes [m].
struct Rectangle {
  std::array<double, 2> low, high;
};

/// Outlines of a union of rectangles, counter-clockwise, a corner at each turn; holes are left out. Edges that are
/// nearer to each other than `rounding` [m] are one. Empty where nothing is covered, or for more edges than
/// `most_edges` along an axis.
std::vector<std::vector<std::array<double, 2>>> calc_union_outlines(const std::vector<Rectangle>&,
                                                                    double rounding = 1e-3, int most_edges = 2000);

}  // namespace topple
