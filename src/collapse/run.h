#pragma once
/// From a plan to a record: model, equilibrium, run, findings.

#include <functional>
#include <optional>
#include <string>

#include "base/progress.h"
#include "collapse/knowledge.h"
#include "collapse/manager.h"
#include "mbs/model_json.h"
#include "mbs/solver.h"
#include "product/plan.h"
#include "record/record.h"

namespace topple::collapse {

struct RunOptions {
  double duration = 0;    // 0: the plan's [s]
  double step = 0;        // 0: the plan's, or chosen from the stiffest mode [s]
  double step_share = 1;  // of that step
  double frame_rate = 0;  // 0: the plan's [1/s]
  int threads = 1;
  std::string engine = "native";
  std::string program_version;  // for the record
  // of the native engine alone
  std::string checkpoint;           // file to write now and then and when cancelled; empty: none
  double checkpoint_interval = 60;  // of the clock [s]
  bool resume = false;              // go on from the checkpoint
  // of bare models alone
  double stability_share = 0;        // mbs::RunSettings; 0: its default
  bool equilibrium = true;           // false: from the poses and velocities of the model
  std::optional<double> rest_speed;  // 0: do not stop at rest; none: that of the rules [m/s]
};

struct RunCallbacks {
  std::function<void(const mbs::Model&, const ModelMap&, const record::Counts&)> on_model;  // before the equilibrium
  std::function<void(const record::Event&)> on_event;                                       // as it happens
  std::function<void(const mbs::Summary&)> on_summary;                                      // of the engine, at the end
  std::function<void(double time)> on_resume;                                               // it goes on from there [s]
  std::function<void()> on_checkpoint;                                                      // one has been written
  std::function<void(const std::string&)> on_lost_checkpoint;  // it could not be, and why; the run goes on
  Progress progress;                                           // done and whole in simulated seconds
};

/// Runs a plan. Throws InputError for what cannot be built or gone on from (E674); everything else is in the record:
/// `ending` is "at_rest", "time_limit", "cancelled" or "failed", and the findings say which criteria are violated.
record::Record run_plan(const product::Plan&, const Knowledge&, const RunOptions&, const RunCallbacks&);

/// Who moves the plan's model and shows its frames: an engine, or another model of the same building.
using Mover = std::function<mbs::Summary(const mbs::Model&, const ModelMap&, const mbs::Options&)>;
/// The same with a mover instead of one of the engines; `engine` is its name in the record.
record::Record run_plan(const product::Plan&, const Knowledge&, const RunOptions&, const RunCallbacks&,
                        const std::string& engine, const Mover&);

/// What run_model needs to run the plan's model to the same poses.
mbs::RunSettings settings_of(const product::Plan&, const Knowledge&, const RunOptions&);

/// Runs a bare multibody model: poses, energies, events, the outputs it asks for and checks of the numbers, without
/// findings about a building.
record::Record run_model(const mbs::Model&, const RunOptions&, const RunCallbacks&);

record::Counts count(const mbs::Model&);

}  // namespace topple::collapse
