#include "collapse/branch_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "product/edited_text.h"

namespace topple::collapse {

namespace {

using Kind = Edit::Kind;

constexpr double kSame = 1e-9;  // [s]

bool overlap(const product::Charge& a, const product::Charge& b) {
  return a.member == b.member && std::abs(a.position - b.position) < 0.5 * (a.destroyed_length + b.destroyed_length);
}

/// The stages with the charges at the times at which they fire.
std::vector<product::Stage> lay_out_stages(const LiveModel& live) {
  const product::Plan& plan = live.plan();
  std::vector<product::Stage> stages, earlier;
  for (const product::Stage& s : plan.stages) {
    stages.push_back(s);
    stages.back().charges.clear();
  }
  const std::vector<LiveCharge>& charges = live.charges();
  for (const LiveCharge& c : charges) {
    if (c.is_removed && c.is_added) continue;
    product::Charge charge = live.charge(c);
    const bool is_replaced = c.is_removed && std::any_of(charges.begin(), charges.end(), [&](const LiveCharge& other) {
                               return other.is_added && !other.is_removed && overlap(live.charge(other), charge);
                             });
    if (is_replaced) continue;
    charge.fails = c.fails || c.is_removed;
    if (c.is_added) charge.where = {};
    const product::Stage& stage = plan.stages[static_cast<size_t>(c.stage)];
    const double time = c.time - c.offset;  // without the scatter
    const bool is_as_planned = charge.delay >= 0 && std::abs(time - stage.time - charge.delay) < kSame;
    if (charge.fails || is_as_planned) {
      charge.delay = std::max(0.0, charge.delay);
      stages[static_cast<size_t>(c.stage)].charges.push_back(charge);
    } else if (time > stage.time - kSame) {
      charge.delay = std::max(0.0, time - stage.time);
      stages[static_cast<size_t>(c.stage)].charges.push_back(charge);
    } else {
      // before its stage: in one of its own
      charge.delay = 0;
      charge.where = {};
      const auto found = std::find_if(earlier.begin(), earlier.end(),
                                      [&](const product::Stage& s) { return std::abs(s.time - time) < kSame; });
      if (found == earlier.end())
        earlier.push_back({stage.name + ", earlier", time, {charge}, {}});
      else
        found->charges.push_back(charge);
    }
  }
  stages.insert(stages.end(), earlier.begin(), earlier.end());
  std::erase_if(stages, [](const product::Stage& s) { return s.charges.empty(); });
  std::stable_sort(stages.begin(), stages.end(),
                   [](const product::Stage& a, const product::Stage& b) { return a.time < b.time; });
  return stages;
}

void add_changes(const product::PlanChanges& more, product::PlanChanges& changes) {
  if (more.stages) changes.stages = more.stages;
  if (more.friction) changes.friction = more.friction;
  changes.cuts.insert(changes.cuts.end(), more.cuts.begin(), more.cuts.end());
  changes.cables.insert(changes.cables.end(), more.cables.begin(), more.cables.end());
}

/// Whether a cable of the branch was added and let go before the first step.
bool added_and_let_go(const LiveModel& live, const std::string& name) {
  size_t cable = live.count_own_cables();
  bool is_added = false, is_let_go = false;
  for (const LiveModel::Applied& a : live.applied()) {
    if (a.edit.kind == Kind::AddCable) is_added |= live.plan().cables[cable++].name == name && a.time <= 0;
    if (a.edit.kind == Kind::RemoveCable) is_let_go |= a.edit.cable == name && a.time <= 0;
  }
  return is_added && is_let_go;
}

}  // namespace

BranchPlan write_branch_plan(const LiveModel& live, const std::string& sample) {
  BranchPlan out;
  out.text = live.plan().text;
  if (!sample.empty())
    out.left_out.push_back("values of the sample (" + sample +
                           "): the text has those of the plan, but for charges where an edit of charges is in it");
  struct Change {
    std::string words;
    product::PlanChanges changes;
  };
  std::vector<Change> sayable;
  std::optional<std::vector<product::Stage>> stages;  // with all edits of charges
  size_t cable = live.count_own_cables();
  for (const LiveModel::Applied& a : live.applied()) {
    const bool is_early = a.time <= 0;
    const char* later = "acts from a moment of the run on, which a plan cannot say";
    std::string why, words = a.text;
    product::PlanChanges changes;
    switch (a.edit.kind) {
      case Kind::Fire:
      case Kind::SetDelay:
      case Kind::AddCharge:
      case Kind::RemoveCharge:
        if (!stages) stages = lay_out_stages(live);
        changes.stages = stages;
        break;
      case Kind::AddPreCut:
        if (is_early)
          changes.cuts.emplace_back(live.plan().find_member(a.edit.member),
                                    product::Weakening{a.edit.position, a.edit.cut_bars, a.edit.cut_concrete});
        else
          why = later;
        break;
      case Kind::AddCable: {
        const product::Cable& c = live.plan().cables[cable++];
        if (!is_early)
          why = later;
        else if (added_and_let_go(live, c.name))
          break;  // it has never pulled
        else if (!(c.strength > 0))
          why = "a cable of a plan has a strength";
        else
          changes.cables.push_back(c);
        break;
      }
      case Kind::RemoveCable:
        if (!is_early)
          why = later;
        else if (!added_and_let_go(live, a.edit.cable))
          why = "the cable is the plan's own; take it out of its text";
        break;
      case Kind::SetFriction:
        if (!is_early) {
          why = later;
          break;
        }
        if (a.edit.bodies)
          out.left_out.push_back(
              fmt::format("friction of the parts {:g}: it is a rule, contact.body_friction", *a.edit.bodies));
        if (!a.edit.ground) continue;
        words = fmt::format("friction of the ground {:g}", *a.edit.ground);
        changes.friction = a.edit.ground;
        break;
    }
    if (why.empty())
      sayable.push_back({words, std::move(changes)});
    else
      out.left_out.push_back(fmt::format("{}: {}", words, why));
  }
  if (sayable.empty()) return out;
  product::PlanChanges all;
  for (const Change& c : sayable) add_changes(c.changes, all);
  try {
    out.text = product::write_changes(live.plan(), all);
    for (const Change& c : sayable) out.taken.push_back(c.words);
    return out;
  } catch (const InputError&) {
    // below, one after the other
  }
  product::PlanChanges kept;
  for (const Change& c : sayable) {
    product::PlanChanges tried = kept;
    add_changes(c.changes, tried);
    try {
      out.text = product::write_changes(live.plan(), tried);
      out.taken.push_back(c.words);
      kept = std::move(tried);
    } catch (const InputError& e) { out.left_out.push_back(c.words + ": " + e.first_error().message); }
  }
  return out;
}

}  // namespace topple::collapse
