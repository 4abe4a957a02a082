#pragma once
/// Levels of membership, rising, and their cuts.

#include <vector>

#include "uncertainty/space.h"

namespace topple::uncertainty {

/// Sorted, without doubles, and with 0 and 1. Throws InputError E807 outside of that.
std::vector<double> check_levels(std::vector<double> levels);

/// Number of the levels whose cut holds a sample: they are the first ones, because cuts are nested.
///   boxes  of the levels
int count_levels(const Space&, const std::vector<double>& levels, const std::vector<Box>& boxes, const Point& x);

}  // namespace topple::uncertainty
