#pragma once
/// What a run means for the planner: findings in the order in which they matter.

#include <atomic>
#include <string>
#include <vector>

#include "collapse/recorder.h"

namespace topple::collapse {

/// What no run of a plan tells, for people; kNoSafeDistance is the last.
std::vector<std::string> not_modelled(const product::Plan&);
inline constexpr const char* kNoSafeDistance = "No distance given here is a safe distance.";
/// The list as the text of a finding, without kNoSafeDistance, which is one of its own.
std::string tell_not_modelled(const std::vector<std::string>& list);

/// The steps of a run, and what the fastest mode asked of a set step that was too long for it.
std::string describe_steps(const mbs::Summary&);
std::string describe_step_needed(const mbs::Summary&);

/// The building under dead load if its ground columns turn in their heads about the other axis of the grid: its zones
/// at one frame, none where it has no equilibrium then.
struct HeadsAcross {
  record::Record record;
  std::vector<ZoneFrame> zones;
};

/// Fills findings, not_modelled and the rigid block's series of a record. Where its ending is "under_way" they say how
/// things stand so far, and nothing that may still change is called good or bad. False if `cancel` was seen set; then
/// they are not complete.
///   across  for the margin before the first charge, which is then the smaller one of both; null: not looked at
bool add_findings(const product::Plan&, const mbs::Model&, const ModelMap&, const Knowledge&, const Recorder&,
                  const mbs::Summary&, record::Record&, const std::atomic<bool>* cancel = nullptr,
                  const HeadsAcross* across = nullptr);

/// Whether a run ended before its mechanism was the last word: not what is over, has gone the wrong way, or was to
/// stand and does not.
bool may_change(const product::Plan&, const Mechanism&);
/// Whether a finding says that a criterion or a clearance of the plan is violated.
bool is_violated(const record::Finding&);
/// Whether it says that one is kept so far, but could not be judged as parts still moved when the run ended.
bool is_not_judged(const record::Finding&);

}  // namespace topple::collapse
