#pragma once
/// Outlines on the ground, corners in order.

#include <array>
#include <vector>

namespace topple::product {

/// Positive for corners counterclockwise [m²].
double calc_signed_area(const std::vector<std::array<double, 2>>& corners);

bool crosses_itself(const std::vector<std::array<double, 2>>& corners);

}  // namespace topple::product
