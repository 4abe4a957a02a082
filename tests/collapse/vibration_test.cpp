#include "collapse/vibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/run.h"
#include "collapse/stability.h"
#include "plans.h"

namespace topple::collapse {
namespace {

using product::BuildingClass;
using testing::HasSubstr;

product::VibrationLaw law() {
  product::VibrationLaw v;
  v.velocity = 2e-3;
  v.energy = 1e6;
  v.distance = 10;
  v.energy_exponent = 0.5;
  v.distance_exponent = 1.5;
  v.factor = 2;
  return v;
}
Touchdown hit(double time, double energy, double x) {
  Touchdown t;
  t.time = time;
  t.body = static_cast<int>(x);
  t.place = {x, 0};
  t.energy = energy;
  return t;
}
const Polygon house_at_zero{{-5, -5}, {0, -5}, {0, 5}, {-5, 5}};

TEST(Vibration, OneTouchdownGivesTheLawItself) {
  const Shaking s = find_shaking(law(), {hit(1, 4e6, 20)}, house_at_zero);
  EXPECT_NEAR(s.velocity, 2e-3 * std::sqrt(4.0) * std::pow(2.0, -1.5), 1e-15);
  EXPECT_EQ(s.distance, 20);
  EXPECT_EQ(s.body, 20);
}

TEST(Vibration, TouchdownsWithinTheWindowAddTheirEnergies) {
  const double one = find_shaking(law(), {hit(1, 1e6, 10)}, house_at_zero).velocity;
  // four at once: twice the velocity with an exponent of a half
  EXPECT_NEAR(
      find_shaking(law(), {hit(1, 1e6, 10), hit(1.1, 1e6, 10), hit(1.2, 1e6, 10), hit(1.05, 1e6, 10)}, house_at_zero)
          .velocity,
      2 * one, 1e-15);
  // too far apart in time
  EXPECT_NEAR(find_shaking(law(), {hit(1, 1e6, 10), hit(1.3, 1e6, 10)}, house_at_zero).velocity, one, 1e-15);
  // a far one counts by its distance: (10 / 40)^(1.5 / 0.5) of its energy
  EXPECT_NEAR(find_shaking(law(), {hit(1, 1e6, 10), hit(1, 1e6, 40)}, house_at_zero).velocity,
              one * std::sqrt(1 + 1.0 / 64), 1e-15);
  EXPECT_EQ(find_shaking(law(), {}, house_at_zero).velocity, 0);
}

TEST(Vibration, NothingIsNearerThanTheLeastDistance) {
  product::VibrationLaw v = law();
  v.least_distance = 5;
  EXPECT_EQ(find_shaking(v, {hit(1, 1e6, 0)}, house_at_zero).distance, 5);
}

TEST(VibrationReference, LimitsAreThoseOfTheTable) {
  // DIN 4150-3:1999-02, Table 1, foundation: 1 to 10 Hz, 50 Hz, 100 Hz [mm/s]
  const struct {
    BuildingClass c;
    double low, middle, high;
  } rows[] = {{BuildingClass::Commercial, 20, 40, 50},
              {BuildingClass::Residential, 5, 15, 20},
              {BuildingClass::Sensitive, 3, 8, 10}};
  for (const auto& row : rows) {
    for (const double f : {1.0, 10.0}) { EXPECT_NEAR(calc_vibration_limit(row.c, f), row.low * 1e-3, 1e-15); }
    EXPECT_NEAR(calc_vibration_limit(row.c, 50), row.middle * 1e-3, 1e-15);
    EXPECT_NEAR(calc_vibration_limit(row.c, 100), row.high * 1e-3, 1e-15);
    EXPECT_NEAR(calc_vibration_limit(row.c, 200), row.high * 1e-3, 1e-15);
    EXPECT_NEAR(calc_vibration_limit(row.c, 30), 0.5 * (row.low + row.middle) * 1e-3, 1e-15);
  }
}

const record::Finding& finding(const record::Record& r, const std::string& id) {
  const auto it = std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
  EXPECT_NE(it, r.findings.end()) << id;
  return *it;
}

std::string site() {
  return R"toml([site.vibration]
velocity = "2 mm/s"
energy = "1 MJ"
distance = "10 m"
energy_exponent = 0.5
distance_exponent = 1.2
factor = 2
frequency = ["8 Hz", "30 Hz"]
source = "drop tests on the site"
[[site.neighbour]]
name = "Far"
footprint = [["-900 m", "0 m"], ["-890 m", "0 m"], ["-890 m", "8 m"]]
building_class = "residential"
[[site.neighbour]]
name = "Near"
footprint = [["-8 m", "0 m"], ["-6 m", "0 m"], ["-6 m", "8 m"]]
building_class = "sensitive"
[[site.utility]]
name = "Main"
footprint = [["20 m", "0 m"], ["21 m", "0 m"], ["21 m", "8 m"]]
vibration_limit = "80 mm/s"
)toml";
}

TEST(VibrationRunPhysics, EveryNeighbourIsScreenedAndTheWordIsThere) {
  const record::Record r = run_plan(read(house(site() + charge("C-*-0", "0.1 s"), "2 s")), default_knowledge(), {}, {});
  EXPECT_THAT(finding(r, "vibration").title, HasSubstr("Screening, not a prediction"));
  EXPECT_THAT(finding(r, "vibration").text, HasSubstr("drop tests on the site"));
  const record::Finding &far = finding(r, "vibration.Far"), &near = finding(r, "vibration.Near"),
                        &main = finding(r, "vibration.Main");
  EXPECT_EQ(far.status, record::Status::Good);
  EXPECT_THAT(far.text, HasSubstr("DIN 4150-3:1999-02"));
  EXPECT_THAT(far.text, HasSubstr("5 to 10 mm/s"));  // at 8 Hz and at 30 Hz
  EXPECT_THAT(near.text, HasSubstr("(line 3)"));
  EXPECT_GT(near.value, far.value);
  EXPECT_THAT(main.text, HasSubstr("Limit of the plan: 80 mm/s"));
  for (const record::Finding* f : {&far, &near, &main}) { EXPECT_THAT(f->text, HasSubstr("Screening")); }
}

TEST(TouchdownRunPhysics, TheLargestEnergyInMotionIsAtLeastThatAtTheFirstTouchdown) {
  // ten frames a second show no frame near the touchdown
  const record::Record r =
      run_plan(read(house(charge("C-*-0", "0.1 s"), "2 s") + "frame_rate = \"10 Hz\"\n"), default_knowledge(), {}, {});
  const std::string first = finding(r, "touchdown.first").text, words = ", when ";
  const double then = 1e6 * std::stod(first.substr(first.find(words) + words.size()));
  EXPECT_GE(finding(r, "touchdown.energy").value, then - 0.05e6) << first;
}

TEST(TouchdownRunPhysics, EnergyOfPartsIsThatOfTheirFall) {
  const record::Record r = run_plan(read(house(charge("C-*-0", "0.1 s"), "2 s")), default_knowledge(), {}, {});
  double released = 0;
  for (const record::Series& s : r.series)
    if (s.id == "energy_gravity") released = s.value.front() - *std::min_element(s.value.begin(), s.value.end());
  const record::Finding& parts = finding(r, "touchdown.parts");
  EXPECT_GT(parts.value, 0.05 * released);
  // each part counts once, as it first touches; energies of parts that touch later are of a longer fall
  EXPECT_LT(parts.value, 1.05 * released);
  EXPECT_THAT(parts.text, HasSubstr("MN s"));
}

TEST(Margins, AreListedByMemberLowestFirst) {
  record::Record r;
  r.zones = {{"C1/foot", "C1", "", -1, 0, {}},
             {"C1/top", "C1", "", 0, 1, {}},
             {"C2/foot", "C2", "", -1, 2, {}},
             {"C3/foot", "C3", "", -1, 2, {}},
             {"C4/foot", "C4", "", -1, 2, {}}};
  r.time = {0};
  r.zone_state = {0, 1, 0, 3, 0};
  r.zone_utilisation = {0.25F, 0.5F, 0.8F, 1.0F, 0.0F};
  const auto m = find_margins(r, 0);
  ASSERT_EQ(m.size(), 2U);  // one is broken, one carries nothing
  EXPECT_EQ(m[0].member, "C2");
  EXPECT_NEAR(m[0].margin, 1.25, 1e-6);
  EXPECT_EQ(m[1].zone, "C1/top");
  EXPECT_EQ(m[1].state, record::ZoneState::Yielded);
  EXPECT_NEAR(m[1].margin, 2, 1e-12);
}

TEST(StabilityRunPhysics, WhatGivesWayUsesItsResistanceAndWhatFallsHasNoMargin) {
  // both rows yield, soften and break on the way down
  const record::Record r =
      run_plan(read(house(charge("C-A*-0", "0 s") + charge("C-B3-1", "0.9 s"), "1 s")), default_knowledge(), {}, {});
  const size_t Z = r.zones.size();
  bool has_softened = false;
  for (size_t i = 0; i < r.time.size() * Z; ++i) {
    const auto state = static_cast<record::ZoneState>(r.zone_state[i]);
    has_softened = has_softened || state == record::ZoneState::Softening;
    if (state != record::ZoneState::Elastic && i % Z < static_cast<size_t>(r.counts.force_elements)) {
      ASSERT_LE(r.zone_utilisation[i], 1.0F) << r.zones[i % Z].name << " at " << r.time[i / Z] << " s";
    }
  }
  EXPECT_TRUE(has_softened);
  const record::Finding& pause = finding(r, "stability.stage_1");
  EXPECT_THAT(pause.text, testing::StartsWith("It does not stand; "));
  EXPECT_THAT(pause.text, testing::Not(HasSubstr("margin")));
  EXPECT_TRUE(std::isnan(pause.value));
  EXPECT_EQ(pause.status, record::Status::Bad);
}

std::string staged(const std::string& row, const std::string& later, const std::string& analysis,
                   const std::string& more = "") {
  return house(charge(row, "0 s") + charge("C-B3-1", later, more), "1.2 s") + analysis +
         "\n[criteria]\nstands_between_stages = true\n";
}
const record::Finding& judge(record::Record& r, const std::string& text) {
  r = run_plan(read(text), default_knowledge(), {}, {});
  return finding(r, "criterion.stands_between_stages");
}

TEST(StabilityRunPhysics, APauseWhoseNextStageFailsIsJudged) {
  record::Record r;
  EXPECT_THAT(judge(r, staged("C-A*-0", "0.9 s", "")).text, HasSubstr("found: falls"));
  EXPECT_THAT(judge(r, staged("C-A*-0", "0.9 s", "", "fails = true")).text, HasSubstr("found: falls"));
  EXPECT_EQ(finding(r, "criterion.stands_between_stages").status, record::Status::Bad);
}

TEST(StabilityRunPhysics, APauseThatIsNotSeenIsNotJudged) {
  record::Record r;
  // a second between frames, at the first of which it still stands
  EXPECT_THAT(judge(r, staged("C-A*-0", "0.9 s", "frame_rate = \"1 Hz\"")).text, HasSubstr("found: not judged"));
  EXPECT_TRUE(is_not_judged(finding(r, "criterion.stands_between_stages")));
  EXPECT_THAT(finding(r, "stability.stage_1").text, HasSubstr("Not judged: the last frame before"));
  EXPECT_THAT(judge(r, staged("C-A*-0", "5 ms", "")).text, HasSubstr("found: not judged"));
}

TEST(StabilityRunPhysics, ARunThatEndsInAPauseTellsAFallOnly) {
  const auto judge_until = [](const std::string& row, double until) {
    product::Plan plan = read(staged(row, "0.9 s", ""));
    plan.analysis.duration = until;
    const record::Record r = run_plan(plan, default_knowledge(), {}, {});
    EXPECT_THAT(finding(r, "events").text, HasSubstr("1 charge had not fired when the run ended."));
    return finding(r, "criterion.stands_between_stages").text;
  };
  EXPECT_THAT(judge_until("C-A*-0", 0.8), HasSubstr("found: falls"));
  EXPECT_THAT(judge_until("C-A*-0", 0.05), HasSubstr("found: not judged"));
}

TEST(StabilityRunPhysics, TheMarginsOfAPauseAreSaid) {
  const record::Record r =
      run_plan(read(house(charge("C-A1-0", "0.1 s") + charge("C-B*-0", "1 s"), "1.2 s")), default_knowledge(), {}, {});
  EXPECT_THAT(finding(r, "stability.start").text, HasSubstr("Lowest margins: "));
  const record::Finding& pause = finding(r, "stability.stage_1");
  EXPECT_THAT(pause.text, HasSubstr("Lowest margins: "));
  EXPECT_THAT(pause.text, testing::AnyOf(HasSubstr("It stands still."), HasSubstr("It still sways"),
                                         HasSubstr("It does not stand")));
}

TEST(StabilityRunPhysics, ASwayingBuildingTellsTheLeastMarginOfItsPause) {
  const record::Record r = run_plan(read(house(charge("C-A1-0", "0.1 s") + charge("C-B*-0", "0.35 s"), "0.4 s")),
                                    default_knowledge(), {}, {});
  const record::Finding& pause = finding(r, "stability.stage_1");
  ASSERT_THAT(pause.text, HasSubstr("It still sways"));
  const std::string words = "This is the margin of one instant: the least in the pause is ";
  const size_t at = pause.text.find(words);
  ASSERT_NE(at, std::string::npos) << pause.text;
  const double least = std::stod(pause.text.substr(at + words.size()));
  EXPECT_LT(least, pause.value);
  EXPECT_GE(least, 1) << "a zone that has yielded uses all of its resistance";
}

}  // namespace
}  // namespace topple::collapse
