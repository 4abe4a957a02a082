#pragma once
/// What a building covers, seen from above.

#include <array>
#include <vector>

#include "record/record.h"

namespace topple::record {

/// Outlines of all boxes in the first frame, counter-clockwise, those of separate parts one by one; inner yards are
/// left out. Of a shaft the convex outline. Empty if the record has no frames [m].
std::vector<std::vector<std::array<double, 2>>> calc_building_plan(const Record&);

}  // namespace topple::record
