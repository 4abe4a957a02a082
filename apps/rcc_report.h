#pragma once
/// From a zone to the report of `topple rcc`.

#include <vector>

#include "base/progress.h"
#include "nearfield/rcc.h"
#include "record/rcc_report.h"

namespace topple::apps {

/// Share of a curve's largest moment below which nothing is left.
constexpr double kNothingLeft = 0.02;

/// Normal forces when none are asked for: shares of the crushing force, rounded to two digits; tension positive [N].
std::vector<double> choose_forces(const nearfield::Rcc&);

/// Everything but title and provenance, on the layered route.
///   normal_forces  tension positive [N]
/// Throws InputError like make_rcc.
record::RccReport make_rcc_report(const nearfield::ZoneInput&, const nearfield::Rcc&,
                                  const std::vector<double>& normal_forces);

}  // namespace topple::apps
