#pragma once
/// Interaction as it is written, for the space that an analysis searches.

#include <functional>
#include <vector>

#include "product/interaction.h"
#include "uncertainty/space.h"

namespace topple::study {

/// Gives a space its constraints and joint membership.
///   values_of  of the names that their formulas use, at a point of the space
void tie(uncertainty::Space&, const product::Interaction&,
         std::function<std::vector<double>(const uncertainty::Point&)> values_of);

}  // namespace topple::study
