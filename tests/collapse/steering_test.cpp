#include "collapse/steering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "../record/same_record.h"
#include "base/error.h"
#include "base/file.h"
#include "base/hash.h"
#include "collapse/action_log.h"
#include "collapse/branch_plan.h"
#include "collapse/branch_record.h"
#include "collapse/edit_json.h"
#include "collapse/run.h"
#include "plans.h"
#include "product/templates.h"

namespace topple::collapse {
namespace {

using record::expect_same_motion;
using record::expect_same_words;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

using Json = nlohmann::ordered_json;

/// Both columns of row A go at 0.2 s; the row of B at 0.6 s. Beside a house, with the site's law of vibration.
product::Plan two_stages(const std::string& second = "0.6 s", const std::string& duration = "1 s") {
  const std::string site = vibration_law() + R"toml([[site.neighbour]]
name = "House"
footprint = [["-8 m", "0 m"], ["-6 m", "0 m"], ["-6 m", "8 m"]]
vibration_limit = "5 mm/s"
)toml";
  return read(house(site + charge("C-A*-0", "0.2 s") + charge("C-B*-0", second), duration));
}

SteeringOptions options() {
  SteeringOptions o;
  o.run.program_version = "test";
  return o;
}

void advance_until(Steering& s, double time) {
  while (s.active().frontier() < time && s.advance()) {}
}

Edit delay_of_stage(int stage, double time) {
  Edit e;
  e.kind = Edit::Kind::SetDelay;
  e.stage = stage;
  e.time = time;
  return e;
}

/// Largest error of the balance until a time, over what the fall has released in the end.
double largest_residual(const record::Record& r, double until) {
  double residual = 0, released = 0;
  for (const record::Series& s : r.series) {
    for (size_t i = 0; s.id == "energy_residual" && i < r.time.size() && r.time[i] <= until; ++i)
      residual = std::max(residual, std::abs(s.value[i]));
    if (s.id == "energy_gravity") released = std::abs(s.value.back());
  }
  return residual / released;
}

/// Columns of row A go at once, those of B at a time.
product::Plan at_once(const std::string& first = "0 s") {
  return read(house(charge("C-A*-0", first, "") + charge("C-B*-0", "0.6 s", "")));
}

TEST(SteeringReplay, WithoutAnEditIsTheRunOfThePlan) {
  for (const product::Plan& plan : {two_stages(), at_once()}) {
    RunOptions run;
    run.program_version = "test";
    const record::Record whole = run_plan(plan, default_knowledge(), run, {});
    Steering s(default_knowledge(), options());
    ASSERT_TRUE(s.begin(s.add_root(plan, "main")));
    advance_until(s, 10);
    const record::Record steered = s.make_record(s.active());
    expect_same_motion(whole, steered);
    expect_same_words(whole, steered);
  }
}

TEST(SteeringReplay, ABranchWithoutAnEditGoesOnWithTheSameBits) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 10);
  const record::Record whole = s.make_record(s.active());
  // between two kept moments
  s.rewind(0.47);
  const Steering::Made made = s.fork("again");
  EXPECT_EQ(made.branch->parent, 1);
  EXPECT_LE(made.time, 0.47);
  EXPECT_EQ(made.branch->first_frame, made.branch->frames());
  advance_until(s, 10);
  const record::Record again = s.make_record(s.active());
  expect_same_motion(whole, again);
  expect_same_words(whole, again);
}

TEST(SteeringReplay, ACopyIsJudgedElsewhereWhileTheBranchGoesOn) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.4);
  s.edit(delay_of_stage(1, 0.5));
  advance_until(s, 0.7);
  const record::Record then = s.make_record(s.active());
  const std::unique_ptr<BranchRecord> copy = s.copy_record(s.active());
  std::optional<record::Record> elsewhere;
  std::thread judge([&] { elsewhere = copy->finish(); });
  advance_until(s, 0.9);
  Edit rough;
  rough.kind = Edit::Kind::SetFriction;
  rough.ground = 0.7;
  s.edit(rough, {}, true);
  advance_until(s, 0.95);
  judge.join();
  EXPECT_EQ(copy->branch(), 2);
  EXPECT_LT(copy->time(), s.active().frontier());
  ASSERT_TRUE(elsewhere);
  expect_same_motion(then, *elsewhere);
  expect_same_words(then, *elsewhere);
  const std::atomic<bool> cancel = true;
  EXPECT_FALSE(s.copy_record(s.active())->finish(&cancel));
}

TEST(SteeringReplay, SwitchingToAndFroChangesNothing) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.53);
  s.fork("other");
  advance_until(s, 0.8);
  s.switch_to(1);
  advance_until(s, 10);
  Steering straight(default_knowledge(), options());
  ASSERT_TRUE(straight.begin(straight.add_root(two_stages(), "main")));
  advance_until(straight, 10);
  expect_same_motion(straight.make_record(straight.active()), s.make_record(s.active()));
}

Edit friction_of(double ground, double bodies) {
  Edit e;
  e.kind = Edit::Kind::SetFriction;
  e.ground = ground, e.bodies = bodies;
  return e;
}

TEST(SteeringReplay, AnEditThatSetsWhatIsThereGivesTheBitsOfItsParent) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 10);
  const record::Record whole = s.make_record(s.active());
  const mbs::Contact& contact = s.active().run().model().model().contact;
  for (const Edit& edit : {friction_of(contact.friction, contact.body_friction), delay_of_stage(1, 0.6)}) {
    s.switch_to(1);
    s.rewind(0.47);
    s.edit(edit);
    advance_until(s, 10);
    expect_same_motion(whole, s.make_record(s.active()));
  }
}

TEST(SteeringReplay, EditsThatLeaveTheStiffnessAloneKeepTheSteps) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 10);
  const std::vector<double> times = s.make_record(s.active()).time;
  const std::vector<long> steps = s.active().run().frame_steps();
  for (const Edit& edit : {friction_of(0.3, 0.2), delay_of_stage(1, 0.9)}) {
    s.switch_to(1);
    s.rewind(0.3);
    s.edit(edit);
    advance_until(s, 0.59);
    const record::Record r = s.make_record(s.active());
    ASSERT_GT(r.time.back(), 0.55);
    for (size_t i = 0; i + 1 < r.time.size(); ++i) EXPECT_EQ(r.time[i], times[i]) << i;
    const std::vector<long>& own = s.active().run().frame_steps();
    for (size_t i = 0; i < own.size(); ++i) EXPECT_EQ(own[i], steps[s.active().first_frame + i]) << i;
  }
}

TEST(SteeringReplay, ThePastTakesAnEditAsTheFrontierDid) {
  Steering late(default_knowledge(), options()), early(default_knowledge(), options());
  for (Steering* s : {&late, &early}) ASSERT_TRUE(s->begin(s->add_root(two_stages(), "main")));
  advance_until(late, 10);
  late.rewind(0.4);
  const long step = late.cursor_step();
  early.advance_to(early.active(), step);
  ASSERT_EQ(early.active().steps(), step);
  for (Steering* s : {&late, &early}) {
    const Steering::Made made = s->edit(delay_of_stage(1, 0.7));
    EXPECT_EQ(made.branch->name, "what-if 1");
    EXPECT_EQ(made.text, "Stage at 0.6 s fires at 0.7 s instead of 0.6 s");
    EXPECT_EQ(s->active().id, 2);
    advance_until(*s, 10);
  }
  const record::Record a = late.make_record(late.active()), b = early.make_record(early.active());
  expect_same_motion(a, b);
  expect_same_words(a, b);
}

size_t count_fired(const record::Record& r, double until) {
  return static_cast<size_t>(std::count_if(r.events.begin(), r.events.end(), [&](const record::Event& e) {
    return e.kind == "charge" && e.text.find(" fired, ") != std::string::npos && e.time <= until;
  }));
}

TEST(SteeringReplay, WhatFiresAtOnceCanBeMovedBeforeTheFirstStep) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(at_once(), "main")));
  for (const LiveCharge& c : s.active().run().model().charges()) EXPECT_FALSE(LiveModel::has_fired(c, 0));
  EXPECT_EQ(s.edit(delay_of_stage(0, 0.2)).branch->id, 1);
  EXPECT_EQ(s.active().frames(), 1U);
  advance_until(s, 0.1);
  EXPECT_EQ(count_fired(s.make_record(s.active()), 0.19), 0U);
  for (const LiveCharge& c : s.active().run().model().charges()) EXPECT_FALSE(LiveModel::has_fired(c, 0.1));
  advance_until(s, 10);
  // to the bit what the plan that says so does
  Steering other(default_knowledge(), options());
  ASSERT_TRUE(other.begin(other.add_root(at_once("0.2 s"), "main")));
  advance_until(other, 10);
  const record::Record a = s.make_record(s.active());
  expect_same_motion(a, other.make_record(other.active()));
  EXPECT_EQ(count_fired(a, 10), 6U);
  // and what is done from the past
  s.rewind(0);
  const Steering::Made back = s.edit(delay_of_stage(0, 0));
  EXPECT_EQ(back.branch->id, 2);
  advance_until(s, 10);
  Steering plain(default_knowledge(), options());
  ASSERT_TRUE(plain.begin(plain.add_root(at_once(), "main")));
  advance_until(plain, 10);
  expect_same_motion(s.make_record(s.active()), plain.make_record(plain.active()));
}

TEST(SteeringReplay, WhatFiresAtOnceCanBeTakenOutBeforeTheFirstStep) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(at_once(), "main")));
  Edit out;
  out.kind = Edit::Kind::RemoveCharge;
  for (out.charge = 0; out.charge < 3; ++out.charge) s.edit(out);
  EXPECT_EQ(s.active().edits.size(), 3U);
  advance_until(s, 0.5);
  const record::Record r = s.make_record(s.active());
  EXPECT_EQ(count_fired(r, 0.5), 0U);
  EXPECT_EQ(std::count_if(r.events.begin(), r.events.end(), [](const record::Event& e) { return e.kind == "edit"; }),
            3);
  EXPECT_EQ(std::count(r.zone_state.begin(), r.zone_state.end(), static_cast<std::uint8_t>(record::ZoneState::Fired)),
            0);
  // nothing has fallen: less than a millimetre
  const size_t stride = 3 * r.bodies.size(), last = r.position.size() - stride;
  for (size_t b = 0; b < r.bodies.size(); ++b)
    EXPECT_NEAR(r.position[last + 3 * b + 2], r.position[3 * b + 2], 1e-3) << r.bodies[b].name;
}

TEST(ActionLogReplay, EditsBeforeTheFirstStepGiveTheSameBits) {
  LoggedSteering first(at_once(), default_knowledge(), options(), {}, "");
  Steering& s = first.steering();
  ASSERT_TRUE(s.begin(s.active()));
  first.perform(Json::parse(R"({"command": "set_delay", "stage": 0, "time": 0.2})"));
  first.perform(Json::parse(R"({"command": "remove_charge", "charge": 0})"));
  advance_until(s, 0.7);
  first.note_reached();
  std::string log;
  for (const std::string& line : first.lines()) log += line + "\n";
  const ReplayResult again = replay(log, "log", default_knowledge(), options(), {});
  Steering& t = again.steering->steering();
  EXPECT_EQ(t.active().steps(), s.active().steps());
  for (Steering* both : {&s, &t}) advance_until(*both, 10);
  const record::Record a = s.make_record(s.active()), b = t.make_record(t.active());
  expect_same_motion(a, b);
  expect_same_words(a, b);
}

TEST(Steering, WhatFiresAtOnceIsTooLateToChangeAfterTheFirstStep) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(at_once(), "main")));
  s.edit(delay_of_stage(0, 0.2));
  s.undo();
  EXPECT_EQ(s.active().run().model().charges().front().time, 0) << "taken back";
  ASSERT_TRUE(s.advance());
  EXPECT_THROW(s.edit(delay_of_stage(0, 0.2)), InputError);
  for (const LiveCharge& c : s.active().run().model().charges())
    EXPECT_EQ(LiveModel::has_fired(c, s.active().frontier()), c.stage == 0);
}

TEST(Steering, AnEditAtTheStartGivesThePlanThatHasIt) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  const Steering::Made made = s.edit(delay_of_stage(1, 0.5));
  EXPECT_EQ(made.branch->id, 1) << "nothing had been computed: the branch takes it itself";
  advance_until(s, 10);
  Steering other(default_knowledge(), options());
  ASSERT_TRUE(other.begin(other.add_root(two_stages("0.5 s"), "main")));
  advance_until(other, 10);
  const record::Record a = s.make_record(s.active()), b = other.make_record(other.active());
  // an edit looks at the step anew, so the yardstick is what steps of another length do
  const auto largest_difference = [&b](const record::Record& r) {
    EXPECT_EQ(r.position.size(), b.position.size());
    float most = 0;
    for (size_t i = 0; i < std::min(r.position.size(), b.position.size()); ++i)
      most = std::max(most, std::abs(r.position[i] - b.position[i]));
    return most;
  };
  float by_step = 0;
  for (const double share : {0.9, 0.8}) {
    SteeringOptions shorter = options();
    shorter.run.step = share * b.provenance.step;
    Steering finer(default_knowledge(), shorter);
    ASSERT_TRUE(finer.begin(finer.add_root(two_stages("0.5 s"), "main")));
    advance_until(finer, 10);
    by_step = std::max(by_step, largest_difference(finer.make_record(finer.active())));
  }
  EXPECT_LE(largest_difference(a), by_step);
  // the charges fire when they would: the scatter of the firing times is the same stream
  const auto& edited = s.active().run().model().charges();
  const auto& planned = other.active().run().model().charges();
  for (size_t i = 0; i < planned.size(); ++i) EXPECT_NEAR(edited[i].time, planned[i].time, 1e-15);
}

TEST(Steering, ThePastIsReadOnly) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.8);
  const record::Record before = s.make_record(s.branch(1));
  s.rewind(0.4);
  EXPECT_FALSE(s.cursor().is_live);
  s.edit(delay_of_stage(1, 0.9), "later");
  advance_until(s, 0.9);
  expect_same_motion(before, s.make_record(s.branch(1)));
  s.switch_to(1);
  // both stages have fired at the frontier
  EXPECT_THROW(s.edit(delay_of_stage(1, 0.95)), InputError);
  EXPECT_EQ(s.branches().size(), 2U);
}

TEST(Steering, UndoComesBackToWhereTheEditWas) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  EXPECT_THROW(s.undo(), InputError);
  advance_until(s, 0.3);
  // made a branch: back to the parent
  s.edit(delay_of_stage(1, 0.9));
  EXPECT_EQ(s.active().id, 2);
  const double once = s.active().run().model().charges().back().time;
  // on the fresh branch: as it was
  s.edit(delay_of_stage(1, 0.8));
  EXPECT_EQ(s.active().id, 2);
  EXPECT_NEAR(s.active().run().model().charges().back().time, once - 0.1, 1e-15);
  s.undo();
  EXPECT_EQ(s.active().run().model().charges().back().time, once);
  EXPECT_NEAR(s.active().run().model().plan().stages[1].time, 0.9, 1e-12);
  s.undo();
  EXPECT_EQ(s.active().id, 1);
  // in place, and computed since: a branch without it
  s.edit(delay_of_stage(1, 0.5), {}, true);
  EXPECT_EQ(s.active().id, 1);
  advance_until(s, 0.7);
  s.undo();
  EXPECT_EQ(s.active().id, 3);
  advance_until(s, 10);
  Steering straight(default_knowledge(), options());
  ASSERT_TRUE(straight.begin(straight.add_root(two_stages(), "main")));
  advance_until(straight, 10);
  expect_same_motion(straight.make_record(straight.active()), s.make_record(s.active()));
}

TEST(Steering, UndoesOneEditAfterTheOther) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.3);
  s.edit(delay_of_stage(1, 0.9));
  advance_until(s, 0.35);
  s.edit(delay_of_stage(1, 0.8), {}, true);
  advance_until(s, 0.4);
  ASSERT_EQ(s.active().id, 2);
  s.undo();
  EXPECT_EQ(s.active().id, 3);
  EXPECT_EQ(s.active().edits.size(), 1U);
  s.undo();
  EXPECT_EQ(s.active().id, 1) << "where the first edit was made, not the branch that has both";
  EXPECT_THROW(s.undo(), InputError);
}

TEST(Steering, UndoesWhatABranchHasFromAnotherOnARunOfItsOwn) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.2);
  s.edit(delay_of_stage(1, 0.9), {}, true);
  advance_until(s, 0.3);
  s.edit(delay_of_stage(1, 0.8), {}, true);
  advance_until(s, 0.4);
  s.edit(delay_of_stage(1, 0.7), {}, true);
  advance_until(s, 0.45);
  // two of three, twice
  for (const int last : {3, 5}) {
    s.switch_to(1);
    s.undo();
    EXPECT_EQ(s.active().id, last - 1);
    s.undo();
    EXPECT_EQ(s.active().id, last);
    EXPECT_NEAR(s.active().time, 0.3, 0.01);
    EXPECT_EQ(s.active().edits.size(), 1U);
    EXPECT_NEAR(s.active().run().model().plan().stages[1].time, 0.9, 1e-12);
  }
  advance_until(s, 0.6);
  EXPECT_LT(s.branch(3).run().time(), 0.35) << "it was not the one that went on";
  for (int id = 1; id <= 5; ++id)
    for (int other = 1; other < id; ++other) EXPECT_NE(&s.branch(id).run(), &s.branch(other).run()) << id << other;
}

TEST(Steering, ABranchThatRestsKeepsItsBalanceOfEnergy) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.9);
  const auto error_of = [&s] {
    for (const record::Finding& f : s.make_record(s.branch(1)).findings)
      if (f.id == "verification.energy") return f.value;
    return -1.0;
  };
  const double active = error_of();
  EXPECT_GT(active, 0);
  s.rewind(0.3);
  s.fork("other");
  EXPECT_EQ(error_of(), active);
}

TEST(Steering, TellsTheTimeSpentComputing) {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); };
  constexpr std::chrono::milliseconds pause(300);
  Steering s(default_knowledge(), options());
  auto begin = Clock::now();
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.3);
  double most = since(begin);
  std::this_thread::sleep_for(pause);
  const double first = s.make_record(s.active()).provenance.wall_time;
  EXPECT_GT(first, 0);
  EXPECT_LE(first, most);
  s.edit(delay_of_stage(1, 0.7), {}, true);
  std::this_thread::sleep_for(pause);
  begin = Clock::now();
  advance_until(s, 10);
  most += since(begin);
  const double whole = s.make_record(s.active()).provenance.wall_time;
  EXPECT_GT(whole, first);
  EXPECT_LE(whole, most);
  // a branch from the past has what computing that took
  s.rewind(0.2);
  s.fork("again");
  EXPECT_GT(s.make_record(s.active()).provenance.wall_time, 0);
  EXPECT_LT(s.make_record(s.active()).provenance.wall_time, first);
}

TEST(Steering, ARunUnderWayTellsNothingThatIsStillToCome) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(
      s.begin(s.add_root(read(house(charge("C-A*-0", "0.2 s") + charge("C-B*-0", "0.6 s", "fails = true"))), "main")));
  advance_until(s, 0.4);
  const auto texts = [&s] {
    std::string all;
    for (const record::Event& e : s.make_record(s.active()).events) all += e.text + "\n";
    return all;
  };
  EXPECT_EQ(texts().find("does not fire"), std::string::npos) << texts();
  EXPECT_EQ(texts().find("Cancelled"), std::string::npos) << texts();
  advance_until(s, 0.7);
  EXPECT_NE(texts().find("does not fire"), std::string::npos);
}

TEST(Steering, NamesAreChangedWhereNoMoreBranchesFit) {
  SteeringOptions o = options();
  o.most_branches = 1;
  Steering s(default_knowledge(), o);
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  EXPECT_THROW(s.fork("more"), InputError);
  std::string longest;
  for (int i = 0; i < 80; ++i) longest += "\u00e4";
  s.rename(1, longest);
  EXPECT_EQ(s.branch(1).name, longest);
  EXPECT_THROW(s.rename(1, longest + "a"), InputError);
  EXPECT_THROW(s.rename(1, "two\nlines"), InputError);
}

TEST(Steering, SaysThatABranchHasTooManyEdits) {
  SteeringOptions o = options();
  o.most_edits = 3;
  Steering s(default_knowledge(), o);
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  const auto edit = [&s](double time) {
    s.advance();
    s.edit(delay_of_stage(1, time), {}, true);
  };
  for (const double time : {0.7, 0.8, 0.9}) edit(time);
  try {
    edit(0.95);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.first_error().message.c_str(), "the branch has 3 edits, which is the limit");
  }
}

TEST(Steering, ChargesFireNowAndCanBeTakenOut) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages("0.9 s"), "main")));
  advance_until(s, 0.4);
  const std::vector<LiveCharge> charges = s.active().run().model().charges();
  ASSERT_EQ(charges.size(), 6U);
  Edit e;
  e.kind = Edit::Kind::Fire;
  e.charge = 0;
  EXPECT_THROW(s.edit(e), InputError) << "it has fired";
  e.charge = 3;
  const Steering::Made made = s.edit(e);
  const double fired = s.active().run().model().charges()[3].time;
  EXPECT_GT(fired, made.time);
  EXPECT_LT(fired, made.time + 0.01);
  Edit out;
  out.kind = Edit::Kind::RemoveCharge;
  out.charge = 4;
  s.edit(out);
  advance_until(s, 10);
  const record::Record r = s.make_record(s.active());
  int fired_4 = 0, fired_3 = 0;
  for (const record::Event& event : r.events) {
    fired_3 += event.kind == "charge" && event.subject == "C-B1-0";
    fired_4 += event.kind == "charge" && event.subject == "C-B2-0" && event.text.find("thrown") != std::string::npos;
  }
  EXPECT_EQ(fired_3, 1);
  EXPECT_EQ(fired_4, 0);
  EXPECT_LT(largest_residual(r, 10), default_knowledge().verification_energy_error);
}

TEST(SteeringPhysics, EveryEditKeepsTheLedger) {
  // the balance of energy holds through each edit until parts land, which has an error of its own
  Steering plain(default_knowledge(), options());
  ASSERT_TRUE(plain.begin(plain.add_root(two_stages(), "main")));
  advance_until(plain, 10);
  const char* const edits[] = {
      R"({"command": "add_pre_cut", "member": "C-B1-0", "at": 2.4, "cut_bars": 0.5})",
      R"({"command": "add_pre_cut", "member": "B-A1B1-1", "at": 0.3, "cut_bars": 0.5, "cut_concrete": 0.3})",
      R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0], "stiffness": 2e6,
          "pretension": 5e4})",
      R"({"command": "set_friction", "ground": 0.2, "bodies": 0.3})",
      R"({"command": "add_charge", "member": "C-B2-1", "position": 1, "destroyed_length": 0.6, "time": 0.7})",
      R"({"command": "add_charge", "member": "B-A1B1-0", "position": 1, "destroyed_length": 0.5})"};
  for (const char* text : edits) {
    Steering s(default_knowledge(), options());
    ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
    advance_until(s, 0.3);
    s.edit(read_edit(Json::parse(text)));
    advance_until(s, 10);
    const record::Record r = s.make_record(s.active());
    EXPECT_LT(largest_residual(r, 0.8), 1e-5) << text;
    EXPECT_LT(largest_residual(r, 10), default_knowledge().verification_energy_error) << text;
    EXPECT_NE(r.position, plain.make_record(plain.active()).position) << text;
    EXPECT_TRUE(std::any_of(r.events.begin(), r.events.end(), [](const auto& e) { return e.kind == "edit"; })) << text;
  }
}

TEST(Steering, ACableComesAndGoes) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  s.edit(read_edit(Json::parse(R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5,
      "anchor": [-15, 4, 0], "stiffness": 2e6, "pretension": 5e4})")));
  advance_until(s, 0.1);
  Edit e;
  e.kind = Edit::Kind::RemoveCable;
  e.cable = "aded 1";
  try {
    s.edit(e);
    FAIL();
  } catch (const InputError& error) { EXPECT_EQ(error.diagnostics().front().help, "did you mean \"added 1\"?"); }
  e.cable = "added 1";
  s.edit(e);
  EXPECT_TRUE(s.active().run().model().lets_go("added 1"));
  try {
    s.edit(e);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.diagnostics().front().message.c_str(), "cable \"added 1\" is let go already");
  }
  advance_until(s, 10);
  EXPECT_LT(largest_residual(s.make_record(s.active()), 10), default_knowledge().verification_energy_error);
}

TEST(Steering, EditsBeforeTheFirstStepDoNotHangOnTheirOrder) {
  const Edit cable = read_edit(Json::parse(R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5,
      "anchor": [-15, 4, 0], "stiffness": 2e6, "pretension": 2e5})")),
             later = read_edit(Json::parse(R"({"command": "set_delay", "charge": 0, "delay": 0.05})"));
  const auto run = [&](const std::vector<Edit>& edits) {
    Steering s(default_knowledge(), options());
    EXPECT_TRUE(s.begin(s.add_root(two_stages(), "main")));
    for (const Edit& e : edits) s.edit(e);
    advance_until(s, 0.2);
    return s.make_record(s.active());
  };
  const record::Record a = run({cable, later}), b = run({later, cable}), none = run({later});
  EXPECT_EQ(a.position, b.position);
  EXPECT_NE(a.position, none.position);
  // one that is let go at once has never pulled
  Edit off;
  off.kind = Edit::Kind::RemoveCable;
  off.cable = "added 1";
  const record::Record never = run({cable, off, later});
  ASSERT_EQ(never.position.size(), none.position.size());
  for (size_t i = 0; i < none.position.size(); ++i) EXPECT_NEAR(never.position[i], none.position[i], 1e-5);
}

TEST(Steering, ACutBeforeTheFirstStepIsInTheDeadLoad) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  s.fork("before");  // holds the frame of the uncut building
  EXPECT_EQ(s.branch(2).first_frame, 1U);
  s.switch_to(1);
  const auto margin = [&s](int branch) {
    for (const record::Finding& f : s.make_record(s.branch(branch)).findings)
      if (f.id == "stability.start") return f.value;
    return -1.0;
  };
  const double whole = margin(1);
  const Edit cut = read_edit(Json::parse(
      R"({"command": "add_pre_cut", "member": "B-A2B2-0", "at": 0.3, "cut_bars": 0.9, "cut_concrete": 0.5})"));
  s.edit(cut);
  const double weakened = margin(1);
  EXPECT_LT(weakened, 0.9 * whole);
  EXPECT_EQ(margin(2), whole);
  EXPECT_EQ(s.branch(1).starts, 1);
  EXPECT_EQ(s.branch(2).starts, 1) << "its frame is no longer that of its parent";
  EXPECT_EQ(s.branch(2).first_frame, 0U);
  advance_until(s, 0.05);
  EXPECT_EQ(margin(1), weakened);
  // as the plan that has it, about this axis
  Steering planned(default_knowledge(), options());
  ASSERT_TRUE(planned.begin(planned.add_root(read(write_branch_plan(s.branch(1).run().model()).text), "main")));
  for (const record::Finding& f : planned.make_record(planned.active()).findings)
    if (f.id == "stability.start") {
      EXPECT_GE(f.value, weakened);
      EXPECT_LT(f.value, 0.85 * whole);
    }
  s.switch_to(2);
  s.edit(cut, "mine", true);
  s.undo();
  EXPECT_EQ(margin(2), whole);
  EXPECT_EQ(s.branch(2).starts, 3);
  EXPECT_EQ(s.branch(2).first_frame, 0U) << "main has begun anew meanwhile";
  // a branch without the cut has a frame of its own
  s.switch_to(1);
  s.undo();
  EXPECT_EQ(s.active().id, 3);
  EXPECT_EQ(s.active().first_frame, 0U);
  EXPECT_EQ(margin(3), whole);
}

TEST(Steering, ReportsTellThePlanAndTheEditsApart) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  s.edit(read_edit(Json::parse(R"({"command": "remove_charge", "charge": 0})")));
  advance_until(s, 0.3);
  s.edit(read_edit(Json::parse(R"({"command": "set_friction", "ground": 0.33})")), {}, true);
  advance_until(s, 10);
  const record::Record r = s.make_record(s.active());
  EXPECT_THAT(s.active().run().model().map().stages.front(), EndsWith(": 2 charges")) << "of three";
  for (const record::Finding& f : r.findings)
    if (f.id == "events") {
      EXPECT_THAT(f.text, HasSubstr("1 charge was taken out."));
      EXPECT_THAT(f.text, Not(HasSubstr("as the plan says")));
    }
  std::vector<std::string> edits;
  for (const record::KeyValue& v : r.plan_values) {
    if (v.group == "Edits") edits.push_back(v.key + ": " + v.value);
    if (v.key == "Friction and restitution") { EXPECT_THAT(v.value, Not(HasSubstr("0.33"))); }
  }
  ASSERT_EQ(edits.size(), 2U);
  EXPECT_THAT(edits[0], StartsWith("Edit at 0 s: the charge on C-A1-0"));
  EXPECT_THAT(edits[1], HasSubstr("0.33"));
}

TEST(Steering, ForgetsWhatWasSaidOfAMouthWhoseChargeIsTakenOut) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(read(product::find_template("tower").text), "main")));
  const auto words = [&s] {
    std::string all;
    for (const record::Finding& f : s.make_record(s.active()).findings) all += f.text + "\n";
    return all;
  };
  advance_until(s, 0.05);
  EXPECT_THAT(words(), HasSubstr(" deg of the ring. The weight of "));
  s.edit(read_edit(Json::parse(R"({"command": "remove_charge", "charge": 0})")));
  advance_until(s, 0.1);
  EXPECT_THAT(words(), HasSubstr("a charge is taken out, and what it leaves of the ring is not known here"));
  EXPECT_THAT(words(), Not(HasSubstr(" deg of the ring. The weight of ")));
}

TEST(Steering, RefusedEditsChangeNothing) {
  Steering s(default_knowledge(), options());
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 0.1);
  const char* const wrong[] = {
      R"({"command": "add_charge", "member": "C-B9-0", "position": 1, "destroyed_length": 0.6})",
      R"({"command": "add_charge", "member": "S-A1B2-0", "position": 1, "destroyed_length": 0.6})",
      R"({"command": "add_charge", "member": "C-B1-0", "position": 0.5, "destroyed_length": 0.4})",
      R"({"command": "add_charge", "member": "C-B1-1", "position": 9, "destroyed_length": 0.4})",
      R"({"command": "add_charge", "member": "C-B1-1", "position": 1, "destroyed_length": 0.4, "time": 0.05})",
      R"({"command": "set_delay", "charge": 99, "time": 1})",
      R"({"command": "set_delay", "charge": 0, "time": 0.01})",
      R"({"command": "set_delay", "charge": 0})",
      R"({"command": "add_pre_cut", "member": "C-B1-1", "at": 1, "cut_bars": 2})",
      R"({"command": "add_cable", "member": "C-B1-1", "position": 1, "anchor": [0, 0, 0], "stiffness": 0})",
      R"({"command": "add_cable", "member": "C-B1-1", "position": 1, "anchor": [5, 0, 4], "stiffness": 1e6})",
      R"({"command": "add_cable", "member": "C-B1-1", "position": 1, "anchor": [9, 0, 0], "stiffness": 1e30})",
      R"({"command": "add_cable", "member": "C-B1-1", "position": 1, "anchor": [9e9, 0, 0], "stiffness": 1e6})",
      R"({"command": "set_delay", "charge": 3, "delay": -1})",
      R"({"command": "set_delay", "charge": 3, "time": 1e300})",
      R"({"command": "set_friction", "ground": -1})",
      R"({"command": "remove_cable", "cable": "none"})"};
  for (const char* text : wrong) EXPECT_THROW(s.edit(read_edit(Json::parse(text))), InputError) << text;
  EXPECT_EQ(s.branches().size(), 1U);
  EXPECT_TRUE(s.active().edits.empty());
  for (const char* text :
       {R"({"command": "fire"})", R"({"command": "fire", "charge": "1"})", R"({"command": "fire", "charge": 1.5})",
        R"({"command": "fire", "charge": 1, "chrage": 2})", R"({"command": "fire", "charge": 18446744073709551615})",
        R"({"command": "set_delay", "charge": 0, "time": "1"})", R"({"command": 5})", R"({"command": "fly"})"})
    EXPECT_THROW((void)read_edit(Json::parse(text)), InputError) << text;
}

TEST(Steering, LetsMomentsGoWhenTheyAreTooMany) {
  SteeringOptions o = options();
  o.moment_bytes = std::size_t{1} << 20;
  o.moment_interval = 0.01;
  Steering s(default_knowledge(), o);
  ASSERT_TRUE(s.begin(s.add_root(two_stages(), "main")));
  advance_until(s, 10);
  EXPECT_LE(s.moment_bytes(), 2 * o.moment_bytes);
  const std::vector<double> times = s.moments(s.active());
  EXPECT_EQ(times.front(), 0);
  // still exact anywhere
  const record::Record whole = s.make_record(s.active());
  s.rewind(0.77);
  s.fork("again");
  advance_until(s, 10);
  expect_same_motion(whole, s.make_record(s.active()));
}

TEST(ActionLogReplay, GivesTheSameBits) {
  const product::Plan plan = two_stages();
  LoggedSteering logged(plan, default_knowledge(), options(), {}, "");
  Steering& s = logged.steering();
  ASSERT_TRUE(s.begin(s.active()));
  advance_until(s, 0.5);
  logged.note_reached();
  s.rewind(0.25);
  logged.perform(Json::parse(R"({"id": 4, "command": "set_delay", "stage": 1, "time": 0.45, "name": "sooner"})"));
  advance_until(s, 0.6);
  logged.perform(Json::parse(R"({"command": "set_friction", "ground": 0.3, "in_place": true})"));
  advance_until(s, 0.8);
  logged.note_reached();
  logged.perform(Json::parse(R"({"command": "switch", "branch": 1})"));
  logged.perform(Json::parse(R"({"command": "rename", "branch": 2, "name": "soon"})"));
  advance_until(s, 10);
  logged.note_reached();
  logged.perform(Json{{"command", "plan.apply"}, {"text", two_stages("0.3 s", "0.5 s").text}, {"name", "new"}});
  ASSERT_TRUE(s.begin(s.active()));
  advance_until(s, 10);
  logged.note_reached();

  std::string log;
  for (const std::string& line : logged.lines()) log += line + "\n";
  const ReplayResult again = replay(log, "log", default_knowledge(), options(), {});
  EXPECT_FALSE(again.was_cut);
  EXPECT_EQ(again.actions, 5) << "what a person did";
  ASSERT_EQ(again.steering->steering().branches().size(), 3U);
  for (int id : {1, 2, 3}) {
    const record::Record a = s.make_record(s.branch(id));
    const record::Record b = again.steering->steering().make_record(again.steering->steering().branch(id));
    expect_same_motion(a, b);
    expect_same_words(a, b);
  }
  EXPECT_EQ(again.steering->steering().branch(2).name, "soon");

  // cut off in the middle of a line: up to the last whole one
  const ReplayResult cut = replay(log.substr(0, log.rfind("\"command\"")), "log", default_knowledge(), options(), {});
  EXPECT_TRUE(cut.was_cut);
  EXPECT_EQ(cut.steering->steering().branches().size(), 2U);
  expect_same_motion(s.make_record(s.branch(2)),
                     cut.steering->steering().make_record(cut.steering->steering().branch(2)));
}

TEST(ActionLogReplay, ComputesAgainWhatLiesBeyondAnEditInThePast) {
  LoggedSteering logged(two_stages(), default_knowledge(), options(), {}, "");
  Steering& s = logged.steering();
  ASSERT_TRUE(s.begin(s.active()));
  advance_until(s, 0.7);
  s.rewind(0.25);
  logged.perform(Json::parse(R"({"command": "set_delay", "stage": 1, "time": 0.45})"));
  ASSERT_EQ(s.active().id, 2);
  std::string log;
  for (const std::string& line : logged.lines()) log += line + "\n";
  const ReplayResult again = replay(log, "log", default_knowledge(), options(), {});
  Steering& t = again.steering->steering();
  EXPECT_EQ(t.branch(1).steps(), s.branch(1).steps());
  for (int id : {1, 2}) expect_same_motion(s.make_record(s.branch(id)), t.make_record(t.branch(id)));
}

TEST(ActionLog, ThatCannotBeBegunLeavesNoFile) {
  const std::string path = testing::TempDir() + "headless.jsonl";
  std::filesystem::remove(path);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{20, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  EXPECT_THROW(LoggedSteering(two_stages(), default_knowledge(), options(), {}, path), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ActionLog, HoldsNothingOfWhatIsRefused) {
  LoggedSteering logged(two_stages(), default_knowledge(), options(), {}, "");
  Steering& s = logged.steering();
  ASSERT_TRUE(s.begin(s.active()));
  advance_until(s, 0.4);
  s.rewind(0.25);
  for (const char* text : {R"({"command": "fire", "charge": 0})", R"({"command": "switch", "branch": 7})"})
    EXPECT_THROW(logged.perform(Json::parse(text)), InputError) << text;
  EXPECT_EQ(logged.lines().size(), 1u) << logged.lines().back();
}

TEST(ActionLogReplay, ALineThatCannotBeWrittenSpoilsNothing) {
  const std::string path = testing::TempDir() + "full.jsonl";
  std::filesystem::remove(path);
  LoggedSteering logged(two_stages(), default_knowledge(), options(), {}, path);
  Steering& s = logged.steering();
  ASSERT_TRUE(s.begin(s.active()));
  advance_until(s, 0.1);
  const Json friction = Json::parse(R"({"command": "set_friction", "ground": 0.3, "in_place": true})");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{std::filesystem::file_size(path) + 20, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  EXPECT_THROW(logged.perform(friction), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old);
  EXPECT_THROW(logged.perform(friction), std::runtime_error) << "the log lacks what was done";
  const ReplayResult again = replay(read_file(path), path, default_knowledge(), options(), {});
  EXPECT_FALSE(again.was_cut);
  EXPECT_TRUE(again.steering->steering().active().edits.empty());
}

TEST(ActionLog, ALiveSessionIsNotOfferedToOthers) {
  const std::string path = testing::TempDir() + "held.jsonl";
  std::filesystem::remove(path);
  const product::Plan plan = two_stages();
  const auto find = [&] {
    return find_earlier_log(path, calc_sha256(plan.text), default_knowledge(), options().run).has_value();
  };
  {
    LoggedSteering logged(plan, default_knowledge(), options(), {}, path);
    ASSERT_TRUE(logged.steering().begin(logged.steering().active()));
    advance_until(logged.steering(), 0.05);
    logged.note_reached();
    EXPECT_FALSE(find());
  }
  EXPECT_TRUE(find());
  std::filesystem::remove(path);
}

TEST(ActionLog, SaysInWhichLineAnActionIsRefused) {
  LoggedSteering logged(two_stages(), default_knowledge(), options(), {}, "");
  const std::string head = logged.lines().front() + "\n";
  const auto complaint = [&head](const std::string& line) {
    try {
      (void)replay(head + line + "\n", "my.log", default_knowledge(), options(), {});
    } catch (const InputError& e) {
      const Diagnostic& d = e.first_error();
      return d.code + " " + d.where.file + " " + std::to_string(d.where.line);
    }
    return std::string();
  };
  EXPECT_EQ(complaint(R"({"action": "reached", "branch": 9, "step": 0, "time": 0})"), "E920 my.log 2");
  EXPECT_EQ(
      complaint(
          R"({"action": "set_friction", "branch": 1, "step": 0, "time": 0, "made": 2, "command": {"command": "set_friction", "ground": -1}})"),
      "E912 my.log 2");
  EXPECT_EQ(complaint(R"({"action": "undo", "branch": 1, "step": "0", "time": 0})"), "E942 my.log 2");
  EXPECT_EQ(complaint(std::string(100000, '[')), "E910 my.log 2");
}

TEST(ActionLog, RefusesWhatIsNoLog) {
  const auto code_of = [](const std::string& text) -> std::string {
    try {
      (void)replay(text, "log", default_knowledge(), options(), {});
    } catch (const InputError& e) { return e.diagnostics().front().code; }
    return "";
  };
  EXPECT_EQ(code_of(""), "E942");
  EXPECT_EQ(code_of("{\"topple_log\": 1"), "E942");
  EXPECT_EQ(code_of("[]\n"), "E942");
  EXPECT_EQ(code_of("{}\n"), "E942");
  EXPECT_EQ(code_of("{\"topple_log\": 1}\n"), "E942");
  EXPECT_EQ(code_of("{\"topple_log\": 1, \"program\": \"topple 9\"}\n"), "E943");
}

}  // namespace
}  // namespace topple::collapse
