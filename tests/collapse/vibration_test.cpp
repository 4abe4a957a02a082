#include "collapse/vibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/plan_record.h"
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
constexpr double kMass = 1000;
const Vec3 kGravity{0, 0, -9.81};
const Polygon house_at_zero{{-5, -5}, {0, -5}, {0, 5}, {-5, 5}};

/// A box that lies with its middle at x, has some velocities in one frame and others in the next.
struct Hit {
  double time = 0, energy = 0, x = 0;
};
/// A cube of 1 m of each, moving until its time, its outline x from the house; frames a millisecond before and at each.
struct Motion {
  explicit Motion(const std::vector<Hit>& hits) {
    r.time = {0};
    for (const Hit& h : hits) r.time.push_back(h.time - 1e-3), r.time.push_back(h.time);
    std::sort(r.time.begin(), r.time.end());
    r.time.erase(std::unique(r.time.begin(), r.time.end()), r.time.end());
    r.series = {{"energy_plastic", "", "J", "energy", {}}};
    for (size_t i = 0; i < hits.size(); ++i) add_box({0.5, 0.5, 0.5});
    for (const double t : r.time) {
      double lost = 0;
      for (const Hit& h : hits) {
        const bool moves = t < h.time;
        lost += moves ? 0 : h.energy;
        put({h.x + 0.5, 0, 0.5}, {0, 0, moves ? -std::sqrt(2 * h.energy / kMass) : 0}, {});
      }
      r.series[0].value.push_back(lost);
    }
  }
  Motion() = default;
  void add_box(const Vec3& half) {
    record::BodyInfo body;
    body.mass = kMass;
    body.shapes = {{{}, half, "concrete"}};
    r.bodies.push_back(body);
  }
  void put(const Vec3& p, const Vec3& v, const Vec3& w) {
    for (int c = 0; c < 3; ++c) {
      r.position.push_back(static_cast<float>(p[c]));
      speeds.velocity.push_back(static_cast<float>(v[c]));
      speeds.spin.push_back(static_cast<float>(w[c]));
    }
    for (const float q : {1.0F, 0.0F, 0.0F, 0.0F}) r.orientation.push_back(q);
  }
  Shaking shake(const product::VibrationLaw& v = law()) const {
    return find_shaking(v, r, speeds, kGravity, 0, house_at_zero);
  }
  record::Record r;
  Speeds speeds;
};

TEST(Vibration, OneLossGivesTheLawItself) {
  const Shaking s = Motion({{1, 4e6, 20}}).shake();
  EXPECT_NEAR(s.velocity, 2e-3 * std::sqrt(4.0) * std::pow(2.0, -1.5), 1e-9);
  EXPECT_NEAR(s.velocity, calc_velocity(law(), 4e6, 20), 1e-9);
  EXPECT_NEAR(s.energy, 4e6, 1);
  EXPECT_NEAR(s.distance, 20, 1e-5) << "of the outline";
  EXPECT_EQ(s.body, 0);
  EXPECT_NEAR(s.end_velocity, s.velocity, 1e-15);
}

TEST(Vibration, LossesWithinTheWindowAddUp) {
  const auto shake = [](const std::vector<Hit>& hits) { return Motion(hits).shake().velocity; };
  const double one = shake({{1, 1e6, 10}});
  // four at once: twice the velocity with an exponent of a half
  EXPECT_NEAR(shake({{1, 1e6, 10}, {1.1, 1e6, 10}, {1.2, 1e6, 10}, {1.05, 1e6, 10}}), 2 * one, 1e-8);
  // too far apart in time
  EXPECT_NEAR(shake({{1, 1e6, 10}, {1.3, 1e6, 10}}), one, 1e-8);
  // a far one counts by its distance: (10 / 40)^(1.5 / 0.5) of its energy
  EXPECT_NEAR(shake({{1, 1e6, 10}, {1, 1e6, 40}}), one * std::sqrt(1 + 1.0 / 64), 1e-8);
  EXPECT_EQ(shake({}), 0);
}

TEST(Vibration, TheLastWindowIsKnownByItself) {
  const Shaking s = Motion({{1, 4e6, 10}, {2, 1e6, 10}}).shake();
  EXPECT_NEAR(s.end_velocity, 0.5 * s.velocity, 1e-8);
}

TEST(Vibration, FramesFartherApartThanTheWindowCountWhole) {
  Motion m({{1, 1e6, 10}});
  m.r.time = {0, 0.5, 1};
  const Shaking s = m.shake();
  EXPECT_NEAR(s.velocity, calc_velocity(law(), 1e6, 10), 1e-8);
  EXPECT_NEAR(s.window, 0.5, 1e-12);
}

TEST(Vibration, WhatOnePartHandsToAnotherIsNoLoss) {
  Motion m;
  m.r.time = {0, 0.01};
  m.r.series = {{"energy_plastic", "", "J", "energy", {0, 0}}};
  m.add_box({0.5, 0.5, 0.5}), m.add_box({0.5, 0.5, 0.5});
  m.put({20, 0, 0.5}, {3, 0, 0}, {}), m.put({30, 0, 0.5}, {}, {});
  m.put({20, 0, 0.5}, {}, {}), m.put({30, 0, 0.5}, {3, 0, 0}, {});
  EXPECT_EQ(m.shake().velocity, 0);
}

/// A beam of 30 m along x in some pieces, that turns about its far end and is stopped.
Shaking shake_by_beam(int pieces) {
  Motion m;
  const double half = 15.0 / pieces;
  m.r.time = {0, 0.01};
  for (int i = 0; i < pieces; ++i) m.add_box({half, 0.5, 0.5}), m.r.bodies.back().mass = 30 * kMass / pieces;
  for (const double rate : {0.8, 0.0})
    for (int i = 0; i < pieces; ++i) {
      const double x = 10 + half * (2 * i + 1);
      m.put({x, 0, 0.5}, {0, 0, -rate * (40 - x)}, {0, -rate, 0});
    }
  m.r.series = {{"energy_plastic", "", "J", "energy", {0, 30 * kMass * 30 * 30 / 6 * 0.64}}};
  return m.shake();
}
TEST(Vibration, HowAMemberIsCutIntoPartsMakesNoDifference) {
  const Shaking whole = shake_by_beam(1);
  EXPECT_NEAR(whole.distance, 10, 1e-5);
  for (const int pieces : {2, 5, 10})
    EXPECT_NEAR(shake_by_beam(pieces).velocity, whole.velocity, 1e-6 * whole.velocity);
  // more than from its middle, less than if all of it lay at its tip
  EXPECT_GT(whole.velocity, 1.5 * calc_velocity(law(), whole.energy, 25));
  EXPECT_LT(whole.velocity, calc_velocity(law(), whole.energy, 10));
}

TEST(Vibration, NothingIsNearerThanTheLeastDistance) {
  product::VibrationLaw v = law();
  v.least_distance = 5;
  EXPECT_EQ(Motion({{1, 1e6, 0}}).shake(v).distance, 5);
}

mbs::Body cube(double x, double z) {
  mbs::Body b;
  b.name = "cube at " + std::to_string(z);
  b.mass = kMass;
  for (int i = 0; i < 3; ++i) b.inertia(i, i) = kMass / 6;
  b.X_WB.p = {x, 0, z};
  mbs::Shape s;
  s.kind = mbs::Shape::Kind::Box;
  s.half = {0.5, 0.5, 0.5};
  b.shapes = {s};
  return b;
}
/// Shaking by what falls, and the energy of all at the first touchdown.
std::pair<Shaking, double> drop(const std::vector<mbs::Body>& bodies, double frame_rate, double duration,
                                double restitution = 0) {
  mbs::Model model;
  model.contact.restitution = model.contact.body_restitution = restitution;
  for (const mbs::Body& b : bodies) mbs::add_body(model, b);
  const ModelMap map = describe_model(model);
  const RunCallbacks none;
  record::Record r;
  Recorder recorder(model, map, default_knowledge(), r, none);
  recorder.keep_speeds();
  mbs::Options o;
  o.duration = duration;
  o.equilibrium = false;
  o.frame_interval = 1 / frame_rate;
  record_into(recorder, o);
  (void)mbs::run(model, o);
  recorder.finish();
  const double energy = recorder.touchdowns().empty() ? 0 : recorder.touchdowns().back().energy;
  return {find_shaking(law(), r, recorder.speeds(), model.gravity, restitution, house_at_zero), energy};
}

TEST(VibrationPhysics, AFallingBoxGivesTheLawAtItsEnergyAtAnyRateOfFrames) {
  for (const double rate : {30.0, 60.0, 1000.0}) {
    const auto [s, energy] = drop({cube(20.5, 5.5)}, rate, 1.3);
    EXPECT_NEAR(energy, kMass * 9.81 * 5, 0.01 * energy);
    EXPECT_NEAR(s.velocity, calc_velocity(law(), energy, 20), 0.01 * s.velocity) << rate;
  }
}

TEST(VibrationPhysics, WhatSpringsBackHasShakenTheGroundToo) {
  for (const double restitution : {0.1, 0.5, 0.8}) {
    const auto [s, energy] = drop({cube(20.5, 5.5)}, 60, 1.3, restitution);
    EXPECT_NEAR(s.velocity, calc_velocity(law(), energy, 20), 0.02 * s.velocity) << restitution;
  }
}

TEST(VibrationPhysics, WhatLandsOnAnotherPartCountsToo) {
  // the lower one lies there; its contacts throw both up a little
  for (const double rate : {60.0, 1000.0}) {
    const auto [s, energy] = drop({cube(20.5, 0.5), cube(20.5, 6.5)}, rate, 1.3);
    EXPECT_NEAR(s.energy, kMass * 9.81 * 5, 0.2 * s.energy) << rate;
    EXPECT_NEAR(s.velocity, calc_velocity(law(), s.energy, 20), 0.01 * s.velocity) << rate;
  }
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
  return vibration_law() + R"toml([[site.neighbour]]
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

record::Record run_shaken(const std::string& site, const std::string& duration) {
  return run_plan(read(house(site + charge("C-*-0", "0.1 s"), duration)), default_knowledge(), {}, {});
}

TEST(VibrationRunPhysics, WhatIsLostIsWhatTheBalanceSays) {
  const record::Record r = run_shaken(site(), "2 s");
  const auto change = [&r](const std::string& id) {
    for (const record::Series& s : r.series)
      if (s.id == id) return s.value.back() - s.value.front();
    ADD_FAILURE() << id;
    return 0.0;
  };
  const std::vector<double> lost = calc_lost_energy(r);
  const double fall = -change("energy_gravity") - change("energy_kinetic") - change("energy_removed");
  EXPECT_GT(fall, 0);
  // what the balance lacks is neither
  EXPECT_NEAR(lost.back() - lost.front(), fall + change("energy_residual"), 1e-9 * fall);
}

TEST(VibrationRunPhysics, ABandBelowItsLimitIsNotJudgedWhilePartsMayComeDown) {
  // before anything has come down, and while what is left in the air could still reach a limit
  const record::Finding early = finding(run_shaken(site(), "0.3 s"), "vibration.Far");
  EXPECT_EQ(early.status, record::Status::NotJudged);
  EXPECT_THAT(early.text, HasSubstr(". Not judged: it had not come to rest when the run ended."));
  EXPECT_FALSE(is_not_judged(early)) << "a screening leaves the exit code alone";
}

TEST(VibrationRunPhysics, WhatStillMovesAtTheEndMayReachALimit) {
  // the mechanism is final at both ends; at 1.2 s parts are in the air, at 1.8 s what moves is too little
  for (const auto& [duration, may] : {std::pair{"1.2 s", true}, {"1.8 s", false}}) {
    std::string text = site();
    const double high = finding(run_shaken(text, duration), "vibration.Main").value;
    text.replace(text.find("80 mm/s"), 7, std::to_string(1.9e3 * high) + " mm/s");
    const record::Finding f = finding(run_shaken(text, duration), "vibration.Main");
    EXPECT_EQ(f.status, may ? record::Status::NotJudged : record::Status::Good) << f.text;
    EXPECT_EQ(f.text.find("and what has yet to come down may reach it.") != std::string::npos, may) << f.text;
  }
}

TEST(VibrationRunPhysics, ALimitWithoutALawIsNotJudged) {
  std::string text = site();
  text.erase(0, text.find("[[site.neighbour]]"));
  const record::Record r = run_shaken(text, "0.3 s");
  EXPECT_EQ(finding(r, "vibration.Far").text,
            "Not judged: the limits of its class need the site's attenuation law ([site.vibration]).");
  EXPECT_EQ(finding(r, "vibration.Main").text,
            "Not judged: the limit of 80 mm/s needs the site's attenuation law ([site.vibration]).");
  for (const char* id : {"vibration.Far", "vibration.Near", "vibration.Main"})
    EXPECT_EQ(finding(r, id).status, record::Status::NotJudged);
}

TEST(VibrationRunPhysics, NumbersHaveNoExponents) {
  std::string text = site();
  text.replace(text.find("2 mm/s"), 6, "1 m/s");
  const record::Record r = run_shaken(text, "2 s");
  for (const char* id : {"vibration.Far", "vibration.Near"}) {
    EXPECT_THAT(finding(r, id).text, testing::Not(testing::AnyOf(HasSubstr("e+"), HasSubstr("e-")))) << id;
    EXPECT_TRUE(std::isfinite(finding(r, id).value));
  }
  EXPECT_GT(finding(r, "vibration.Near").value, 0.1);
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

TEST(StabilityRun, AChargeThatFailsIsNotTheLastOfAPause) {
  const auto run_with = [](const std::string& more) {
    return run_plan(read(house(charge("C-A1-0", "0.1 s") + more + charge("C-B2-0", "0.8 s"), "0.85 s")),
                    default_knowledge(), {}, {});
  };
  const auto failing = [](const std::string& delay) {
    return "[[stage.charge]]\nmembers = \"C-A2-0\"\nposition = \"1 m\"\ndestroyed_length = \"1 m\"\nfails = "
           "true\ndelay = \"" +
           delay + "\"\n";
  };
  const record::Record plain = run_with("");
  for (const char* delay : {"0.6 s", "0.69 s"}) {
    const record::Record r = run_with(failing(delay));
    EXPECT_EQ(finding(r, "stability.stage_1").text, finding(plain, "stability.stage_1").text) << delay;
    EXPECT_EQ(finding(r, "stability.stage_1").status, finding(plain, "stability.stage_1").status) << delay;
  }
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

TEST(StabilityRunPhysics, WhatHasComeToRestIsJudgedBeforeAStageThatFails) {
  record::Record r;
  const std::string text = house(charge("C-B2-1", "0 s") + charge("C-A*-0", "20 s", "fails = true"), "30 s") +
                           "\n[criteria]\nstands_between_stages = true\n";
  EXPECT_THAT(judge(r, text).text, HasSubstr("found: stands"));
  EXPECT_LT(r.time.back(), 20) << "it rests before";
  EXPECT_THAT(finding(r, "stability.stage_1").text, HasSubstr("It stands still."));
}

TEST(StabilityRunPhysics, APauseThatIsNotSeenIsNotJudged) {
  record::Record r;
  // a second between frames, at the first of which it still stands
  EXPECT_THAT(judge(r, staged("C-A*-0", "0.9 s", "frame_rate = \"1 Hz\"")).text, HasSubstr("found: not judged"));
  EXPECT_TRUE(is_not_judged(finding(r, "criterion.stands_between_stages")));
  EXPECT_THAT(finding(r, "stability.stage_1").text, HasSubstr("Not judged: the last frame before"));
  EXPECT_THAT(judge(r, staged("C-A*-0", "5 ms", "")).text, HasSubstr("found: not judged"));
}

// 0.12 s of free fall are 7 cm and 1.2 m/s: in its place still, and falling.
TEST(StabilityRunPhysics, AFallThatHasJustBegunIsNotTakenForStanding) {
  record::Record r;
  EXPECT_THAT(judge(r, staged("C-*-0", "0.12 s", "")).text, HasSubstr("found: not judged"));
  const record::Finding& pause = finding(r, "stability.stage_1");
  EXPECT_EQ(pause.status, record::Status::NotJudged);
  EXPECT_THAT(pause.text, HasSubstr("it may sway or fall"));
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
  const record::Record r = run_plan(read(house(charge("C-A1-0", "0.1 s") + charge("C-B*-0", "0.3 s"), "0.4 s")),
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
