#pragma once
/// Whether an answer is the building's or that of the time step: the same run at half the step.

#include "collapse/run.h"

namespace topple::collapse {

/// Compares a run with one of the same plan at half its step and adds the finding "verification.half_step" to it: good
/// if verdict, criteria and clearances are the same, and first touchdown and tilt within verification.step_time and
/// verification.step_tilt; a warning if only the numbers differ by more; bad if a judgement does.
void add_step_check(const record::Record& half, const Knowledge&, record::Record&);

/// run_plan, and with two threads beside it, else after it, the same at half the step, compared. Events and frames are
/// those of the first. What run_plan throws; a run that ends early is not compared.
record::Record run_plan_at_two_steps(const product::Plan&, const Knowledge&, const RunOptions&, const RunCallbacks&);

}  // namespace topple::collapse
