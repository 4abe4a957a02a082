#pragma once
/// What searches of an alpha-level optimisation are for.

#include <limits>
#include <utility>

#include "uncertainty/space.h"

namespace topple::uncertainty {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int any_class = -2;
constexpr int most_in_vain = 5;           // searches of one goal that neither end nor gain
constexpr double least_edge_gain = 1e-6;  // along a kink, as a part of an output's width
constexpr double least_line_gain = 1e-5;  // along an axis
constexpr int most_line_places = 6;       // of an axis, that other ends of searches propose
constexpr double group_tolerance = 1e-5;  // of searches in a group of inputs, as a part of an output's width
constexpr double near_optimum = 0.02;     // of a cut's widths, within which a search would end there

/// What is looked for: the least value of sign * output in the cut of a level, among one class or all.
struct Goal {
  int output = 0;
  int level = 0;
  double sign = 1;
  int outcome = any_class;
};

/// Output, and whether its least or its largest value is looked for.
inline std::pair<int, bool> side_of(const Goal& goal) { return {goal.output, goal.sign > 0}; }

struct Candidate {
  double value = infinite;
  int sample = -1;
};

/// A local optimum, and the level in whose cut it was found.
struct Optimum {
  int sample = -1;
  int level = 0;
};

/// What searches over the faces did for a goal.
struct Faces {
  double end = infinite;       // best value at which one ended
  double paired = infinite;    // at which one ended behind all pairs of moves
  double foretold = infinite;  // and whose model foretold what was tried
  double best = infinite;      // to which the counts belong
  int idle = 0;                // restarts without gain
  int again = 0;               // of them, those that ended at the best from a place of their own
  int elsewhere = 0;           // those that did not
  double last = infinite;      // where the last restart ended
  Point last_at;
};

}  // namespace topple::uncertainty
