#pragma once
/// Many plans of one building run for their numbers alone: the samples of a study.

#include <array>
#include <atomic>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "collapse/condense.h"
#include "collapse/knowledge.h"
#include "collapse/mechanism.h"
#include "collapse/outcome.h"
#include "product/plan.h"

namespace topple::collapse {

struct SampleRunOptions {
  double after = 1.7;       // simulated after the last stage's time; without stages from the start [s]
  double frame_rate = 0;    // 0: the plan's [1/s]
  bool ends_early = false;  // a condensed sample is over once the building has come down before its last stage
  const Condensation* condensation = nullptr;  // samples run condensed; null: whole
  const KnownCurves* known = nullptr;          // of condensed ones; may be null
  double pass_speed = 0.1, pass_share = 1e-2;  // mbs::Options, of condensed samples
  double step_share = 1;                       // mbs::Options
  bool full_law = false;                       // mbs::Options
  bool findings = true;                        // SampleRun::volume and what follows it
  bool lanes = false;  // plans whose models are of one build run in the lanes of one batch; the same bits
};

/// Where the processor's time went [s].
struct SampleRunTimes {
  double models = 0;      // plans to models, with all resistance curves
  double equilibria = 0;  // compiling and dead load; of single runs, as the next two
  double standing = 0;    // steps before the last stage
  double falling = 0;     // steps behind it; of lanes everything but models and outputs
  double outputs = 0;     // what is read off the frames
};

/// What one run gave.
struct SampleRun {
  enum class State { Done, Failed, Cancelled };
  State state = State::Cancelled;
  std::string text;          // why it failed
  double release = 0;        // the last stage's time [s]
  std::vector<double> time;  // of frames [s]                                                          (S)
  std::vector<double> tilt;  // towards the planned fall [rad]                                         (S)
  Mechanism mechanism;
  bool is_open = false;    // the mechanism may become another, may_change()
  bool stood = true;       // until the last stage
  double utilisation = 0;  // largest use of a zone's resistance before the last stage; 1 if it did not stand
  double touchdown = std::numeric_limits<double>::quiet_NaN();  // of the upper block; NaN if there was none [s]
  double touchdown_energy = 0;                                  // in motion then; at the end if there was none [J]
  double largest_energy = 0;                                    // in motion [J]
  Reach reach;                                                  // at the end
  /// Screening of ground vibration by what parts lost in the run: middle of the band at each neighbour [m/s]; empty
  /// without the site's law, and of condensed samples, whose parts stand for many.
  std::vector<double> shaking;
  double height = 0;  // of the heap at the end [m]
  // as findings have them; 0 and empty without SampleRunOptions::findings, and of condensed samples, which know nothing
  // across the frames
  double volume = 0;              // of the heap [m³]
  double deviation = 0;           // of the fall from the planned direction; NaN if nothing fell to any side [rad]
  std::vector<double> clearance;  // least distance of a part from each neighbour in the run, in plan; 0: over it [m]
  double way_left =
      0;  // that a part which still moves or may fall may go at most (OpenPart); infinite without friction [m]
};

/// Plans run together in lanes.
size_t count_lanes();

/// Runs the plans in this thread; result i belongs to plan i. A plan that cannot be built, finds no equilibrium or
/// diverges fails with its text and disturbs no other. The same bits for a plan alone and in any company.
std::vector<SampleRun> run_samples(std::span<const product::Plan>, const Knowledge&, const SampleRunOptions&,
                                   const std::atomic<bool>* cancel = nullptr, SampleRunTimes* times = nullptr);

}  // namespace topple::collapse
