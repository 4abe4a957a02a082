#pragma once
/// Outlines on the ground, corners in order.

#include <array>
#include <vector>

namespace topple::product {

/// Positive for corners counterclockwise [m²].
double calc_signed_area(const std::vector<std::array<double, 2>>& corners);

/// Whether edges cross, be it in a corner, or one goes back on the one before it. They may touch: a ring is an outline
/// with a slit.
bool crosses_itself(const std::vector<std::array<double, 2>>& corners);

/// What an outline has in common with a convex one; corners of both counterclockwise [m²].
double calc_overlap(const std::vector<std::array<double, 2>>& outline,
                    const std::vector<std::array<double, 2>>& convex);

}  // namespace topple::product
