#pragma once
/// Whole runs beside the condensed ones of a study: which points are run again, and what that says of the bounds found.

#include <string>
#include <vector>

#include "study/problem.h"
#include "uncertainty/alpha.h"

namespace topple::study {

/// A bound is confirmed where the whole runs come to it within this share of the output's width at alpha 0.
inline constexpr double confirmation_tolerance = 0.05;

struct Confirmation {
  enum class State { Confirmed, Exceeded, NotReached, NotRun };
  /// A sample of the study that was run whole.
  struct Run {
    int sample = -1;            // in the archive
    double membership = 0;      // of its inputs
    uncertainty::Result whole;  // NotRun where the study was interrupted
  };
  struct Bound {
    int output = 0, level = 0;  // into AlphaResult::outputs
    bool is_upper = false;
    double whole = 0;  // least or largest of the whole runs in the cut, NaN: none
    State state = State::NotRun;
  };
  struct Outcome {
    int outcome = 0;              // class with condensed runs
    int sample = -1;              // its most possible run
    int whole = 0;                // its class with the whole model; only where state is not NotRun
    State state = State::NotRun;  // Confirmed, NotReached (another class)
  };
  int limit = 0;  // of whole runs that were allowed
  std::vector<Run> runs;
  std::vector<Bound> bounds;
  std::vector<Outcome> outcomes;
};

std::string to_text(Confirmation::State);

/// Samples to be run whole, most important first: the middle of the inputs, the most possible run of each class, some
/// spread over all runs, then those at the bounds from alpha 0 upwards. Without failed runs.
std::vector<int> choose_confirmation(const uncertainty::Space&, const uncertainty::AlphaResult&, int limit);

/// What the whole runs say; `runs` are those of choose_confirmation.
Confirmation judge_confirmation(const uncertainty::Space&, const uncertainty::AlphaResult&,
                                std::vector<Confirmation::Run> runs, int limit);

}  // namespace topple::study
