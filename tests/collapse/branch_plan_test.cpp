#include "collapse/branch_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "collapse/action_log.h"
#include "collapse/edit_json.h"
#include "plans.h"

namespace topple::collapse {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

const char* const later_part = "# the limits\n[criteria]\ndebris_reach = \"9 m\"\n";

product::Plan staged(const std::string& more = "") {
  return read("# first\n" +
              house("# stages\n" + charge("C-A*-0", "0.2 s") + charge("C-B*-0", "0.6 s") + later_part + more));
}

/// Edits one after the other: texts of commands, each at a time.
LiveModel edited(const product::Plan& plan, const std::vector<std::pair<double, std::string>>& edits) {
  LiveModel live(plan, default_knowledge(), 1);
  for (const auto& [time, text] : edits) (void)live.apply(read_edit(Json::parse(text)), time, time + 1e-3);
  return live;
}

/// Members and firing times that both have, by member and position.
void expect_same_firings(const LiveModel& a, const LiveModel& b, double scatter) {
  std::vector<std::tuple<std::string, double, double>> lists[2];
  for (const LiveModel* live : {&a, &b})
    for (const LiveCharge& c : live->charges())
      if (!c.is_removed && !c.fails)
        lists[live == &b].emplace_back(live->member_of(c), live->charge(c).position, c.time);
  for (auto& list : lists) std::sort(list.begin(), list.end());
  ASSERT_EQ(lists[0].size(), lists[1].size());
  for (size_t i = 0; i < lists[0].size(); ++i) {
    EXPECT_EQ(std::get<0>(lists[0][i]), std::get<0>(lists[1][i]));
    EXPECT_NEAR(std::get<1>(lists[0][i]), std::get<1>(lists[1][i]), 1e-12);
    EXPECT_NEAR(std::get<2>(lists[0][i]), std::get<2>(lists[1][i]), scatter) << std::get<0>(lists[0][i]);
  }
}

TEST(BranchPlan, WithoutEditsIsThePlan) {
  const product::Plan plan = staged();
  const BranchPlan b = write_branch_plan(edited(plan, {}));
  EXPECT_EQ(b.text, plan.text);
  EXPECT_TRUE(b.taken.empty() && b.left_out.empty());
}

TEST(LiveModel, ForgetsStubsThatChargesTakenOutWouldHaveLeft) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::Plan plan = product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/plan.toml", warnings, text);
  const LiveModel fresh(plan, default_knowledge(), 1);
  const int last = static_cast<int>(fresh.charges().size());
  const product::Charge& c = fresh.charge(fresh.charges().front());
  const auto add = [&](double length) {
    return fmt::format(R"({{"command": "add_charge", "member": "{}", "position": {}, "destroyed_length": {}, )"
                       R"("residual_bars": {}, "transition_damage": {}, "time": 0}})",
                       fresh.member_of(fresh.charges().front()), c.position, length, c.residual_bars,
                       c.transition_damage);
  };
  const auto remove = [](int charge) { return fmt::format(R"({{"command": "remove_charge", "charge": {}}})", charge); };
  // a stub half as long, then what the plan has
  const double half_stub = c.destroyed_length + 0.5 * (2.44 - c.position - 0.5 * c.destroyed_length);
  const LiveModel shorter = edited(plan, {{-1, remove(0)}, {-1, add(half_stub)}});
  const LiveModel again =
      edited(plan, {{-1, remove(0)}, {-1, add(half_stub)}, {-1, remove(last)}, {-1, add(c.destroyed_length)}});
  const auto stiffness = [](const LiveModel& m, size_t r) {
    return m.model().rotational_elements[r].loose_translational;
  };
  int differ = 0;
  for (size_t r = 0; r < fresh.model().rotational_elements.size(); ++r) {
    EXPECT_EQ(stiffness(again, r), stiffness(fresh, r)) << r;
    differ += stiffness(shorter, r) == stiffness(fresh, r) ? 0 : 1;
  }
  EXPECT_EQ(differ, 1);
}

TEST(LiveModel, AddsChargesThatLeaveConcrete) {
  const product::Plan plan = staged();
  const std::string add =
      R"({"command": "add_charge", "member": "B-A1B1-1", "position": 1.2, "destroyed_length": 0.8, )"
      R"("residual_concrete": 0.25, "time": 0.7})";
  const LiveModel live = edited(plan, {{0.1, add}});
  EXPECT_EQ(live.charge(live.charges().back()).residual_concrete, 0.25);
  EXPECT_EQ(live.map().events.back().kept, 0.25);
  EXPECT_EQ(live.map().events.back().debris_mass, 0);
  const BranchPlan b = write_branch_plan(live);
  EXPECT_THAT(b.text, HasSubstr("residual_concrete = 0.25\n"));
  expect_same_firings(live, LiveModel(read(b.text), default_knowledge(), 1), 7e-3);
  const auto refused = [&](const std::string& command, const std::string& why) {
    try {
      (void)edited(plan, {{0.1, command}});
      ADD_FAILURE() << command;
    } catch (const InputError& e) { EXPECT_THAT(e.what(), HasSubstr(why)); }
  };
  const auto on = [](const std::string& member, double concrete) {
    return fmt::format(R"({{"command": "add_charge", "member": "{}", "position": 1.2, "destroyed_length": 0.6, )"
                       R"("residual_concrete": {}}})",
                       member, concrete);
  };
  refused(on("C-B1-1", 0.2), "columns of the ground storey");
  refused(on("B-A1B1-1", 0.96), "0 to 0.95");
  refused(on("C-B1-0", 0.2), "one leaves concrete");
}

TEST(LiveModel, FiresAFailingChargeWithTheDamageBesideIt) {
  const std::string more = "transition_damage = 0.4\n", fails = more + "fails = true\n";
  const auto beam = [](const std::string& rest) {
    return read(
        house("[[stage]]\nname = \"s\"\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = \"B-A1B1-1\"\n"
              "position = \"2.4 m\"\ndestroyed_length = \"4 m\"\n" +
              rest + charge("C-A*-0", "0.4 s")));
  };
  const LiveModel live = edited(beam(fails), {{0.1, R"({"command": "fire", "charge": 0})"}});
  const LiveModel planned(beam(more), default_knowledge(), 1);
  const auto switches = [](const LiveModel& m) {
    std::vector<std::pair<int, double>> out;
    for (const mbs::Action& a : m.model().events.front().actions)
      if (a.kind == mbs::Action::Kind::SwitchLaw)
        out.emplace_back(a.element.index, m.model().laws[static_cast<size_t>(a.law.index)].compression.f[0]);
    return out;
  };
  EXPECT_EQ(switches(planned).size(), 2u);
  EXPECT_EQ(switches(live), switches(planned));
}

TEST(BranchPlan, FiresWhatTheBranchFires) {
  // both scatter by 1 ms and by three of them at most
  constexpr double scatter = 7e-3;
  const product::Plan plan = staged();
  const std::vector<std::vector<std::pair<double, std::string>>> cases = {
      {{0, R"({"command": "set_delay", "stage": 1, "time": 0.5})"}},
      {{0.1, R"({"command": "set_delay", "charge": 4, "delay": 0.1})"}},
      {{0.1, R"({"command": "set_delay", "charge": 4, "time": 0.15})"}},
      {{0.3, R"({"command": "fire", "charge": 5})"}},
      {{0.3, R"({"command": "remove_charge", "charge": 3})"}},
      {{0.3, R"({"command": "add_charge", "member": "C-B2-1", "position": 1, "destroyed_length": 0.6, "time": 0.7})"}},
      {{0.1, R"({"command": "remove_charge", "charge": 3})"},
       {0.1, R"({"command": "add_charge", "member": "C-B1-0", "position": 1.2, "destroyed_length": 0.6})"},
       {0.3, R"({"command": "fire", "charge": 4})"},
       {0.35, R"({"command": "set_delay", "stage": 1, "time": 0.8})"}}};
  for (const auto& edits : cases) {
    const LiveModel live = edited(plan, edits);
    const BranchPlan b = write_branch_plan(live);
    EXPECT_EQ(b.taken.size(), edits.size()) << edits.front().second;
    ASSERT_TRUE(b.left_out.empty()) << b.left_out.front();
    EXPECT_THAT(b.text, HasSubstr("# first\n"));
    EXPECT_THAT(b.text, HasSubstr("# stages\n"));
    EXPECT_THAT(b.text, HasSubstr(later_part)) << "comments of the next table are its own";
    expect_same_firings(live, LiveModel(read(b.text), default_knowledge(), 1), scatter);
  }
}

TEST(BranchPlan, TakesWhatWasDoneBeforeTheFirstStepOnly) {
  const product::Plan plan = staged();
  const std::string cut = R"({"command": "add_pre_cut", "member": "C-B1-0", "at": 2.4, "cut_bars": 0.5})",
                    cable = R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0],
                               "stiffness": 2e6, "pretension": 5e4, "strength": 9e5})",
                    friction = R"({"command": "set_friction", "ground": 0.3, "bodies": 0.3})";
  const BranchPlan early = write_branch_plan(edited(plan, {{0, cut}, {0, cable}, {0, friction}}));
  ASSERT_EQ(early.taken.size(), 3U) << early.left_out.front();
  const product::Plan again = read(early.text);
  EXPECT_EQ(again.ground.friction, 0.3);
  ASSERT_EQ(again.cables.size(), 1U);
  EXPECT_EQ(again.cables[0].anchor.x, -15);
  EXPECT_EQ(again.cables[0].stiffness, 2e6);
  EXPECT_EQ(again.members[static_cast<size_t>(again.find_member("C-B1-0"))].weakenings.at(0).cut_bars, 0.5);
  const BranchPlan late = write_branch_plan(edited(plan, {{0.1, cut}, {0.1, cable}, {0.1, friction}}));
  EXPECT_EQ(late.left_out.size(), 3U);
  EXPECT_EQ(late.text, plan.text);
}

TEST(BranchPlan, SaysTheFrictionOfTheGroundAlone) {
  const product::Plan plan = staged();
  const auto set = [](const char* values) { return std::string(R"({"command": "set_friction", )") + values + "}"; };
  const BranchPlan ground = write_branch_plan(edited(plan, {{0, set(R"("ground": 0.3)")}}));
  EXPECT_TRUE(ground.left_out.empty());
  EXPECT_EQ(read(ground.text).ground.friction, 0.3);
  const BranchPlan both = write_branch_plan(edited(plan, {{0, set(R"("ground": 0.3, "bodies": 0.4)")}}));
  EXPECT_EQ(read(both.text).ground.friction, 0.3);
  EXPECT_THAT(both.taken, testing::ElementsAre("friction of the ground 0.3"));
  ASSERT_EQ(both.left_out.size(), 1U);
  EXPECT_THAT(both.left_out[0], HasSubstr("friction of the parts 0.4: it is a rule"));
  const BranchPlan parts = write_branch_plan(edited(plan, {{0, set(R"("bodies": 0.4)")}}));
  EXPECT_TRUE(parts.taken.empty());
  EXPECT_EQ(parts.text, plan.text);
  // what comes later changes nothing of what was set first
  const BranchPlan later =
      write_branch_plan(edited(plan, {{0, set(R"("ground": 0.3)")}, {0.1, set(R"("ground": 0.2, "bodies": 0.2)")}}));
  EXPECT_EQ(read(later.text).ground.friction, 0.3);
  EXPECT_EQ(later.left_out.size(), 1U);
}

TEST(BranchPlan, ForgetsCablesThatNeverPull) {
  const product::Plan plan = staged();
  const std::string add = R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0],
                          "stiffness": 2e6, "pretension": 5e4, "strength": 9e5})",
                    let_go = R"({"command": "remove_cable", "cable": "added 1"})";
  const BranchPlan never = write_branch_plan(edited(plan, {{0, add}, {0, let_go}}));
  EXPECT_TRUE(never.left_out.empty());
  EXPECT_TRUE(read(never.text).cables.empty());
  const BranchPlan late = write_branch_plan(edited(plan, {{0, add}, {0.1, let_go}}));
  EXPECT_EQ(read(late.text).cables.size(), 1U);
  EXPECT_EQ(late.left_out.size(), 1U);
}

TEST(LiveModel, GivesNoCableTheNameOfAnother) {
  const std::string add = R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0],
                          "stiffness": 2e6, "pretension": 5e4, "strength": 9e5})",
                    let_go = R"({"command": "remove_cable", "cable": "added 1"})";
  const product::Plan again = read(write_branch_plan(edited(staged(), {{0, add}, {0, add}, {0, let_go}})).text);
  ASSERT_EQ(again.cables.size(), 1U);
  ASSERT_EQ(again.cables.front().name, "added 2");
  const LiveModel live = edited(again, {{0, add}});
  EXPECT_EQ(live.plan().cables.back().name, "added 3");
}

TEST(BranchPlan, KeepsTheSectorsOfShafts) {
  std::string text;
  std::vector<Diagnostic> warnings;
  const product::Plan plan =
      product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/templates/chimney.toml", warnings, text);
  ASSERT_LT(plan.stages.front().charges.front().opening, 6);
  const BranchPlan same =
      write_branch_plan(edited(plan, {{0, R"({"command": "set_delay", "charge": 0, "delay": 0.2})"}}));
  EXPECT_TRUE(same.left_out.empty());
  const product::Plan again = read(same.text);
  ASSERT_EQ(again.stages.front().charges.size(), plan.stages.front().charges.size());
  for (size_t i = 0; i < plan.stages.front().charges.size(); ++i) {
    const product::Charge &was = plan.stages.front().charges[i], &is = again.stages.front().charges[i];
    EXPECT_NEAR(is.azimuth, was.azimuth, 1e-12);
    EXPECT_NEAR(is.opening, was.opening, 1e-12);
  }
}

TEST(BranchPlan, KeepsWhatFuzzyPathsName) {
  const std::string fuzzy = "[fuzzy]\nstage.2.charge.1.delay = { triangular = [\"0 ms\", \"0 ms\", \"30 ms\"] }\n";
  const product::Plan plan = staged(fuzzy);
  const BranchPlan within =
      write_branch_plan(edited(plan, {{0.1, R"({"command": "set_delay", "charge": 4, "delay": 0.1})"},
                                      {0.1, R"({"command": "remove_charge", "charge": 3})"}}));
  ASSERT_TRUE(within.left_out.empty()) << within.left_out.front();
  // the group that stays as it was is still the first one
  const product::Plan again = read(within.text);
  ASSERT_EQ(again.fuzzy.inputs.size(), 1U);
  EXPECT_EQ(again.stages[1].charges.front().delay, 0);
  EXPECT_EQ(again.stages[1].charges.front().member, plan.find_member("C-B3-0"));
  // a stage before it would change its number
  const BranchPlan before = write_branch_plan(edited(plan, {{0.3, R"({"command": "fire", "charge": 4})"}}));
  ASSERT_EQ(before.left_out.size(), 1U);
  EXPECT_THAT(before.left_out[0], HasSubstr("[fuzzy]"));
  EXPECT_EQ(before.text, plan.text);
}

TEST(BranchPlan, KeepsChargesVariedThatFuzzyPathsName) {
  const auto with = [](const std::string& path) {
    return staged("[fuzzy]\n" + path + " = { triangular = [0, 0.1, 1] }\n");
  };
  // one of three columns fires later, so it stands in a table of its own, which the number does not name
  const std::pair<double, std::string> edit{0, R"({"command": "set_delay", "charge": 1, "delay": 0.01})"};
  const product::Plan numbered = with("stage.1.charge.1.residual_bars");
  const BranchPlan refused = write_branch_plan(edited(numbered, {edit}));
  EXPECT_TRUE(refused.taken.empty());
  ASSERT_EQ(refused.left_out.size(), 1U);
  EXPECT_THAT(refused.left_out[0], HasSubstr("[fuzzy] varies the charge on C-A2-0 together with others"));
  EXPECT_EQ(refused.text, numbered.text);
  // a pattern names it
  const BranchPlan b = write_branch_plan(edited(with(R"(stage.1.charge."*".residual_bars)"), {edit}));
  ASSERT_TRUE(b.left_out.empty()) << b.left_out.front();
  EXPECT_EQ(read(b.text).fuzzy.places.front().size(), 2U);
  // of another stage, all of a table alike, and one that fails from now on
  for (const char* other :
       {R"({"command": "set_delay", "charge": 4, "delay": 0.01})",
        R"({"command": "set_delay", "stage": 0, "time": 0.3})", R"({"command": "remove_charge", "charge": 1})"}) {
    const BranchPlan kept = write_branch_plan(edited(numbered, {{0, other}}));
    EXPECT_TRUE(kept.left_out.empty()) << other << kept.left_out.front();
  }
}

TEST(BranchPlan, KnowsMouthsAtOneHeightByTheirDirection) {
  std::string text;
  std::vector<Diagnostic> warnings;
  (void)product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/templates/chimney.toml", warnings, text);
  // its mouth by two charges, one beside the other
  for (const auto& [old_words, new_words] : {std::pair{"azimuth = \"180 deg\"", "azimuth = \"129.5 deg\""},
                                             {"opening = \"202 deg\"", "opening = \"101 deg\""}})
    text.replace(text.find(old_words), std::string(old_words).size(), new_words);
  text +=
      "\n[[stage.charge]]\nmembers = \"chimney\"\nposition = \"2.5 m\"\ndestroyed_length = \"2 m\"\n"
      "azimuth = \"230.5 deg\"\nopening = \"101 deg\"\nresidual_bars = 0.05\n"
      "\n[fuzzy]\nstage.1.charge.1.residual_bars = { triangular = [0, 0.05, 0.1] }\n";
  const product::Plan plan = read(text);
  ASSERT_EQ(plan.stages.front().charges.size(), 2U);
  const BranchPlan b = write_branch_plan(edited(plan, {{0, R"({"command": "set_friction", "ground": 0.5})"},
                                                       {0, R"({"command": "set_delay", "charge": 1, "delay": 0.1})"}}));
  EXPECT_TRUE(b.left_out.empty()) << b.left_out.front();
  EXPECT_EQ(b.taken.size(), 2U);
}

TEST(BranchPlan, KeepsNumbersOfChargesThatFuzzyPathsName) {
  const std::string fuzzy = "[fuzzy]\nstage.2.charge.1.delay = { triangular = [\"0 ms\", \"0 ms\", \"30 ms\"] }\n";
  const product::Plan plan = staged(fuzzy);
  // all of its charges replaced by others: the first table would be that of the new ones
  std::vector<std::pair<double, std::string>> edits;
  const LiveModel live = edited(plan, {});
  for (size_t i = 0; i < live.charges().size(); ++i) {
    const LiveCharge& c = live.charges()[i];
    if (c.stage != 1) continue;
    const product::Charge& charge = live.charge(c);
    edits.emplace_back(0, R"({"command": "remove_charge", "charge": )" + std::to_string(i) + "}");
    edits.emplace_back(0, R"({"command": "add_charge", "member": ")" +
                              plan.members[static_cast<size_t>(charge.member)].name +
                              R"(", "position": 1.2, "destroyed_length": 0.6, "time": 0.7})");
  }
  ASSERT_FALSE(edits.empty());
  const BranchPlan b = write_branch_plan(edited(plan, edits));
  EXPECT_TRUE(b.taken.empty());
  ASSERT_FALSE(b.left_out.empty());
  EXPECT_THAT(b.left_out[0], HasSubstr("[fuzzy] names charges by their numbers"));
}

TEST(BranchPlan, LeavesOutWhatWouldBeNoPlan) {
  // a plan that says its stages in one line
  std::string text = house(charge("C-A*-0", "0.2 s"));
  const size_t begin = text.find("[[stage]]"), end = text.find("[analysis]");
  text =
      "stage = [{ time = \"0.2 s\", charge = [{ members = \"C-A*-0\", position = \"1 m\", destroyed_length = \"1 m\" "
      "}] }]\n" +
      text.substr(0, begin) + text.substr(end);
  const BranchPlan b =
      write_branch_plan(edited(read(text), {{0, R"({"command": "set_delay", "stage": 0, "time": 0.3})"}}));
  ASSERT_EQ(b.left_out.size(), 1U);
  EXPECT_EQ(b.text, text);
  // all charges taken out: the building stands, which the check warns of only
  std::vector<std::pair<double, std::string>> none;
  for (int i = 0; i < 6; ++i)
    none.emplace_back(0, R"({"command": "remove_charge", "charge": )" + std::to_string(i) + "}");
  EXPECT_EQ(write_branch_plan(edited(staged(), none)).taken.size(), 6U);
}

TEST(BranchPlan, LeavesOutTheEditThatAPlanRefusesAndSaysWhy) {
  // a section that nothing has: its warning comes before the error
  const product::Plan plan = staged(
      "[section.spare]\nwidth = \"30 cm\"\nheight = \"40 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"\n"
      "ties = { diameter = \"8 mm\", spacing = \"20 cm\" }\nbars = { count_y = 2, count_z = 2, diameter = \"20 mm\" "
      "}\n");
  // cables of plans break under 1 GN
  const std::string strong = R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-20, 4, 0],
                                 "stiffness": 2e6, "strength": 9e9})",
                    near = R"({"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0],
                               "stiffness": 2e6, "strength": 9e5})",
                    delay = R"({"command": "set_delay", "stage": 1, "time": 0.5})";
  const BranchPlan b = write_branch_plan(edited(plan, {{0, strong}, {0, delay}, {0, near}}));
  EXPECT_EQ(b.taken.size(), 2U);
  ASSERT_EQ(b.left_out.size(), 1U);
  EXPECT_THAT(b.left_out[0], HasSubstr("cable added 1"));
  EXPECT_THAT(b.left_out[0], HasSubstr("strength"));
  const product::Plan again = read(b.text);
  EXPECT_EQ(again.stages.at(1).time, 0.5);
  ASSERT_EQ(again.cables.size(), 1U);
  EXPECT_EQ(again.cables[0].anchor.x, -15);
}

/// What an edit at a time is refused for, or nothing.
std::string code_of(LiveModel live, double time, const std::string& text) {
  try {
    (void)live.apply(read_edit(Json::parse(text)), time, time + 1e-3);
    return {};
  } catch (const InputError& e) { return e.diagnostics().front().code; }
}

TEST(LiveModel, RefusesAChargeOnTheLengthOfAnother) {
  // both have 0.5 to 1.5 m; one of them fires, the other fails
  const product::Plan plan =
      read(house(charge("C-A*-0", "0.2 s") + charge("C-B1-0", "0.6 s") + charge("C-B2-0", "0.8 s", "fails = true")));
  const auto add = [](const char* member, double position) {
    return fmt::format(
        R"({{"command": "add_charge", "member": "{}", "position": {}, "destroyed_length": 0.5, "time": 0.9}})", member,
        position);
  };
  for (const char* member : {"C-A1-0", "C-B1-0", "C-B2-0"}) {
    EXPECT_EQ(code_of(edited(plan, {}), 0.3, add(member, 1.7)), "E932") << member;
    EXPECT_EQ(code_of(edited(plan, {}), 0.3, add(member, 1.75)), "") << member << ": they touch";
  }
  EXPECT_EQ(code_of(edited(plan, {{0.3, add("C-B3-0", 1)}}), 0.3, add("C-B3-0", 1.2)), "E932");
  const std::string remove = R"({"command": "remove_charge", "charge": 3})";
  EXPECT_EQ(code_of(edited(plan, {{0.3, remove}}), 0.3, add("C-B1-0", 1.7)), "");
}

TEST(LiveModel, RefusesACableThatItsPretensionWouldBreak) {
  const product::Plan plan = staged();
  const auto add = [](double strength) {
    return fmt::format(R"({{"command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0],
                          "stiffness": 2e6, "pretension": 5e4, "strength": {}}})",
                       strength);
  };
  EXPECT_EQ(code_of(edited(plan, {}), 0, add(4e4)), "E912");
  EXPECT_EQ(code_of(edited(plan, {}), 0, add(5e4)), "E912");
  EXPECT_EQ(code_of(edited(plan, {}), 0, add(6e4)), "");
  EXPECT_EQ(code_of(edited(plan, {}), 0, add(0)), "") << "never breaks";
}

}  // namespace
}  // namespace topple::collapse
