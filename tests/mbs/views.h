#pragma once
/// Runs whose frames a test keeps.

#include <vector>

#include "mbs/solver.h"

namespace topple::mbs::test {

/// Options of a run for a duration [s] that appends its frames to `views`.
inline Options look(double duration, std::vector<View>& views, bool equilibrium = false) {
  Options o;
  o.duration = duration;
  o.equilibrium = equilibrium;
  o.on_frame = [&views](const View& v) { views.push_back(v); };
  return o;
}

}  // namespace topple::mbs::test
