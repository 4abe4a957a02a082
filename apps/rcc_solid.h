#pragma once
/// The solid route of `topple rcc`: the same curves from finite elements.

#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "nearfield/rcc.h"
#include "record/rcc_report.h"

namespace topple::apps {

struct SolidTask {
  std::vector<double> normal_forces;  // tension positive [N]
  char axis = 'y';
  int direction = 1;
  double largest_rotation = 0;  // 0: twice the layered route's ultimate rotation under each force [rad]
  double element_size = 0;      // 0: left to the route [m]
  int threads = 1;              // results do not depend on it
};

struct SolidOutcome {
  bool cancelled = false;
  std::vector<std::string> failures;  // "N = 3.7 MN: did not converge at ..."
};

/// Adds curves and states of the solid route to a report that holds the layered ones.
///   show  called with what is being done, the done and the whole amount of work
/// Throws InputError like march_solid.
SolidOutcome add_solid_route(const nearfield::ZoneInput&, const SolidTask&, record::RccReport&,
                             const std::atomic<bool>& cancel,
                             const std::function<void(const std::string&, double, double)>& show);

}  // namespace topple::apps
