#pragma once
/// Fuzzy functions by bunch parameters: one point of the inputs gives one original curve, which the model returns as
/// `Result::trajectory` over a grid common to all (docs/theory/uncertainty.md, section 5).

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "uncertainty/archive.h"
#include "uncertainty/space.h"

namespace topple::uncertainty {

/// Envelopes of the curves whose points lie in the cut at alpha. T places of the grid.
struct FanLevel {
  double alpha = 0;
  int curves = 0;
  std::vector<double> lower, upper;     // NaN where there is no curve  (T)
  std::vector<int> at_lower, at_upper;  // samples they come from, -1 if none  (T)
};

inline constexpr int all_outcomes = std::numeric_limits<int>::min();

/// Envelopes over the archive, for one outcome class or all. They are inner estimates: the true envelope is nowhere
/// narrower. Ordinates that matter are to be outputs (`with_functionals`), whose bounds are optimised.
/// A trajectory that ended early counts as far as it goes. Throws InputError E802 for levels outside [0, 1].
std::vector<FanLevel> calc_fan(const Space&, const Archive&, const std::vector<double>& levels,
                               int outcome = all_outcomes);

/// A mapping with further outputs that follow from each trajectory: the ordinate at a place, the largest, the last.
Evaluate with_functionals(Evaluate model, std::vector<std::function<double(std::span<const double> trajectory)>>);

}  // namespace topple::uncertainty
