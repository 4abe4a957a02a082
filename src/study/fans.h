#pragma once
/// Envelopes of what runs give as trajectories: curves by degree of possibility, and the outline of debris.

#include <array>
#include <vector>

#include "study/manager.h"
#include "uncertainty/fan.h"

namespace topple::study {

/// Parts of the trajectories of a result, as Problem::curves; one over 0, 1, 2, ... if the problem names none.
std::vector<Curve> list_curves(const Problem&, const uncertainty::Archive&);

/// Envelopes of one curve over the levels, values as in results.
struct CurveFan {
  int curve = 0;                              // of list_curves
  int outcome = uncertainty::all_outcomes;    // class, or all
  std::vector<uncertainty::FanLevel> levels;  // alpha rising
};
/// For all runs, then for each outcome class where there are several; failed runs have none.
std::vector<CurveFan> calc_fans(const Problem&, const StudyResult&);

/// Region in which a point may be reached to a degree of at least alpha: where x·u <= how far any run extends towards
/// u, for all directions u of the outline. Convex, counter-clockwise; empty without runs.
struct DebrisLevel {
  double alpha = 0;
  int runs = 0;
  std::vector<std::array<double, 2>> corners;  // [m]
};
/// Of the fan of an outline.
std::vector<DebrisLevel> calc_debris(const Curve&, const CurveFan&);

}  // namespace topple::study
