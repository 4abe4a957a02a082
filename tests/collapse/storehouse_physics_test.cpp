// What the storehouse in Weida has to do: stand, stand again, topple to the front, and the same each time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/unit.h"
#include "collapse/run.h"
#include "mbs/model_json.h"

namespace topple::collapse {
namespace {

product::Plan read_example(const std::string& name = "plan.toml") {
  std::vector<Diagnostic> warnings;
  std::string text;
  return product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/" + name, warnings, text);
}

/// The plan with its second stage soon after the first, for short runs that hold everything.
product::Plan read_hurried() {
  product::Plan plan = read_example();
  plan.stages[1].time = 0.2;
  plan.analysis.duration = 1.2;
  return plan;
}

const std::vector<double>& series(const record::Record& r, const std::string& id) {
  for (const record::Series& s : r.series)
    if (s.id == id) return s.value;
  ADD_FAILURE() << id;
  static const std::vector<double> none;
  return none;
}

const record::Finding& finding(const record::Record& r, const std::string& id) {
  const auto it = std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
  if (it != r.findings.end()) return *it;
  ADD_FAILURE() << id;
  static const record::Finding none;
  return none;
}

/// Value of a series between its frames.
double value_at(const record::Record& r, const std::string& id, double time) {
  const std::vector<double>& v = series(r, id);
  const auto after = std::lower_bound(r.time.begin(), r.time.end(), time);
  if (after == r.time.begin() || after == r.time.end()) {
    ADD_FAILURE() << id << " at " << time;
    return std::numeric_limits<double>::quiet_NaN();
  }
  const size_t i = static_cast<size_t>(after - r.time.begin());
  const double s = (time - r.time[i - 1]) / (r.time[i] - r.time[i - 1]);
  return (1 - s) * v[i - 1] + s * v[i];
}

Pose pose_of(const record::Record& r, size_t frame, size_t body) {
  const float* p = &r.position[3 * (frame * r.bodies.size() + body)];
  const float* q = &r.orientation[4 * (frame * r.bodies.size() + body)];
  return {{p[0], p[1], p[2]}, normalized(Quat{q[0], q[1], q[2], q[3]})};
}

/// Farthest way of any corner of any part from where it was in the first frame, over all frames.
double find_largest_way(const record::Record& r) {
  double most = 0;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    const Pose start = pose_of(r, 0, b);
    for (const record::BoxShape& s : r.bodies[b].shapes)
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p = s.X_BS * Vec3{corner & 1 ? s.half.x : -s.half.x, corner & 2 ? s.half.y : -s.half.y,
                                     corner & 4 ? s.half.z : -s.half.z};
        for (size_t f = 0; f < r.time.size(); ++f) most = std::max(most, norm(pose_of(r, f, b) * p - start * p));
      }
  }
  return most;
}

TEST(StorehousePhysics, StandsStillWithoutCharges) {
  product::Plan plan = read_example();
  plan.stages.clear();
  plan.analysis.duration = 10;
  Knowledge k = default_knowledge();
  k.rest_speed = 0;  // a run that would end at rest would end at once
  const record::Record r = run_plan(plan, k, {}, {});
  ASSERT_EQ(r.ending, "time_limit") << r.ending_text;
  ASSERT_NEAR(r.time.back(), 10, 1e-3);
  EXPECT_EQ(finding(r, "mechanism").title, "Mechanism: stands");
  const double way = find_largest_way(r);
  EXPECT_LT(way, 1e-3);  // what the issue asks for
  const size_t yielded =
      static_cast<size_t>(std::count_if(r.zone_state.begin(), r.zone_state.end(), [](std::uint8_t s) {
        return s != static_cast<std::uint8_t>(record::ZoneState::Elastic);
      }));
  EXPECT_EQ(yielded, 0u);
  EXPECT_TRUE(std::none_of(r.events.begin(), r.events.end(), [](const auto& e) { return e.kind != "rest"; }));
  double mass = 0, worst = 0;
  for (const record::BodyInfo& b : r.bodies) mass += b.fixed ? 0 : b.mass;
  for (const double f : series(r, "ground_force")) worst = std::max(worst, std::abs(f / (mass * 9.81) - 1));
  EXPECT_LT(worst, 1e-6);  // what the issue asks for
  EXPECT_LT(finding(r, "verification.equilibrium").value, 1e-6);
  RecordProperty("largest_way_m", std::to_string(way));
}

/// The upper block's mean displacement at a frame [m].
Vec3 calc_displacement(const record::Record& r, const std::vector<bool>& upper, size_t frame) {
  Vec3 sum;
  double mass = 0;
  for (size_t b = 0; b < upper.size(); ++b) {
    if (!upper[b]) continue;
    sum += r.bodies[b].mass * (pose_of(r, frame, b).p - pose_of(r, 0, b).p);
    mass += r.bodies[b].mass;
  }
  return (1 / mass) * sum;
}

TEST(StorehousePhysics, StandsOnTwoRowsAndThenTopplesToTheFront) {
  product::Plan plan = read_example();
  plan.analysis.duration = 5.05;
  std::vector<bool> upper;
  RunCallbacks callbacks;
  callbacks.on_model = [&](const mbs::Model&, const ModelMap& map, const record::Counts&) {
    for (const BodyEntry& b : map.bodies) upper.push_back(b.is_upper);
  };
  const record::Record r = run_plan(plan, default_knowledge(), {}, callbacks);
  ASSERT_EQ(r.ending, "time_limit") << r.ending_text;

  // the paper's model: about 255 bodies, 19 revolute and 43 rigid joints, 640 force elements, 1900 t
  EXPECT_NEAR(r.counts.bodies, 255, 0.33 * 255);
  EXPECT_NEAR(r.counts.revolute_joints, 19, 0.33 * 19);
  EXPECT_NEAR(r.counts.rigid_joints, 43, 0.33 * 43);
  EXPECT_NEAR(r.counts.force_elements, 640, 0.33 * 640);
  EXPECT_NEAR(r.counts.mass, 1900e3, 0.02 * 1900e3);

  // between the stages
  const double second = plan.stages[1].time;
  const size_t Z = r.zones.size();
  for (size_t f = 0; f < r.time.size() && r.time[f] < second - 0.005; ++f) {
    for (size_t z = 0; z < Z; ++z)
      ASSERT_NE(r.zone_state[f * Z + z], static_cast<std::uint8_t>(record::ZoneState::Broken))
          << r.zones[z].name << " at " << r.time[f];
    EXPECT_LT(norm(calc_displacement(r, upper, f)), 0.05) << r.time[f];  // 0.4 % of the width
    if (r.time[f] > 2) {
      const size_t midway = static_cast<size_t>(std::lower_bound(r.time.begin(), r.time.end(), 2) - r.time.begin());
      EXPECT_LT(norm(calc_displacement(r, upper, f) - calc_displacement(r, upper, midway)), 0.005) << r.time[f];
    }
  }

  // after the second
  const double touchdown = finding(r, "touchdown.first").value;
  EXPECT_GT(touchdown, second + 0.3);
  const std::vector<double>& tilt = series(r, "tilt_angle");
  int watched = 0;
  for (size_t f = 1; f < r.time.size() && r.time[f] <= std::min(touchdown, r.time.back()); ++f) {
    if (r.time[f - 1] < second + 0.02) continue;  // it sways by a thousandth of a degree when row C goes
    EXPECT_GT(tilt[f], tilt[f - 1]) << r.time[f];
    ++watched;
  }
  EXPECT_GT(watched, 20);
  const double after = value_at(r, "tilt_angle", second + 1);
  EXPECT_GT(after, 0.05);
  // the front, at x < 0, comes down ahead of the rear, and the whole moves to the front
  const size_t last = r.time.size() - 1;
  double drop[2] = {0, 0}, mass[2] = {0, 0};
  for (size_t b = 0; b < upper.size(); ++b) {
    const double x = pose_of(r, 0, b).p.x;
    if (!upper[b] || (x > 3 && x < 9)) continue;
    const size_t side = x < 6 ? 0 : 1;
    mass[side] += r.bodies[b].mass;
    drop[side] += r.bodies[b].mass * (pose_of(r, 0, b).p.z - pose_of(r, last, b).p.z);
  }
  EXPECT_GT(drop[0] / mass[0], 2 * drop[1] / mass[1]);
  const Vec3 moved = calc_displacement(r, upper, last);
  EXPECT_LT(moved.x, 0);
  EXPECT_LT(std::abs(moved.y), 0.05);  // the plan is symmetric but for 1 ms of scatter

  const record::Finding& energy = finding(r, "verification.energy");
  EXPECT_LT(energy.value, 0.01) << energy.text;  // what the issue asks for

  // near a rigid block on plastic hinges
  const double block = value_at(r, "tilt_angle_rigid_block", second + 1);
  EXPECT_GT(after, 0.5 * block);
  EXPECT_LT(after, 2 * block);
  EXPECT_NEAR(finding(r, "rigid_block").value, after - block, 0.001);  // read between frames, a millisecond later

  // until it lands half the step gives the same (0.1423 with its own step, 0.1417, 0.1418 and 0.1419 with a half, a
  // quarter and an eighth); behind it, in the debris, nearly so (10.71 degrees and 10.70 to 10.73)
  RunOptions fine;
  fine.step = 0.5 * r.provenance.step;
  const record::Record half = run_plan(plan, default_knowledge(), fine, {});
  const double finer = value_at(half, "tilt_angle", second + 1);
  const double landing = value_at(r, "tilt_angle", second + 0.78),
               landing_finer = value_at(half, "tilt_angle", second + 0.78);
  EXPECT_NEAR(landing, landing_finer, 0.005 * landing_finer);
  EXPECT_NEAR(after, finer, 0.02 * finer);
  EXPECT_NEAR(touchdown, finding(half, "touchdown.first").value, 0.01);
  RecordProperty("tilt_deg", std::to_string(after / unit::deg));
  RecordProperty("tilt_at_half_the_step_deg", std::to_string(finer / unit::deg));
  RecordProperty("tilt_of_a_rigid_block_deg", std::to_string(block / unit::deg));
}

TEST(StorehouseReplay, ThreadsDoNotChangeABit) {
  const product::Plan plan = read_hurried();
  record::Record first;
  for (const int threads : {1, 2, 4}) {
    RunOptions o;
    o.threads = threads;
    record::Record r = run_plan(plan, default_knowledge(), o, {});
    if (threads == 1) {
      EXPECT_TRUE(std::any_of(r.events.begin(), r.events.end(), [](const auto& e) { return e.kind == "touchdown"; }));
      first = std::move(r);
      continue;
    }
    EXPECT_EQ(r.time, first.time) << threads;
    EXPECT_EQ(r.position, first.position) << threads;
    EXPECT_EQ(r.orientation, first.orientation) << threads;
    EXPECT_EQ(series(r, "energy_residual"), series(first, "energy_residual")) << threads;
  }
}

TEST(StorehouseReplay, TheWrittenModelRunsAgainToTheSamePoses) {
  const product::Plan plan = read_hurried();
  std::string file;
  RunCallbacks callbacks;
  callbacks.on_model = [&](const mbs::Model& m, const ModelMap&, const record::Counts&) { file = mbs::to_json(m); };
  const record::Record a = run_plan(plan, default_knowledge(), {}, callbacks);
  RunOptions again;
  again.duration = plan.analysis.duration;
  again.stability_share = settings_of(plan, default_knowledge(), {}).stability_share;
  again.frame_rate = plan.analysis.frame_rate;
  const record::Record b = run_model(mbs::model_from_json(file, "model.json"), again, {});
  ASSERT_EQ(a.time, b.time);
  // a plan's record has the debris after the bodies
  const size_t A = a.bodies.size(), B = b.bodies.size();
  ASSERT_EQ(static_cast<size_t>(a.counts.bodies), B);
  for (size_t f = 0; f < a.time.size(); ++f) {
    for (size_t i = 0; i < 3 * B; ++i) ASSERT_EQ(a.position[3 * f * A + i], b.position[3 * f * B + i]) << a.time[f];
    for (size_t i = 0; i < 4 * B; ++i)
      ASSERT_EQ(a.orientation[4 * f * A + i], b.orientation[4 * f * B + i]) << a.time[f];
  }
}

class StorehouseSlow : public testing::TestWithParam<const char*> {};

TEST_P(StorehouseSlow, RunsToItsEndAndSaysWhatBecomesOfIt) {
  const product::Plan plan = read_example(GetParam());
  const record::Record r = run_plan(plan, default_knowledge(), {}, {});
  EXPECT_TRUE(r.ending == "at_rest" || r.ending == "time_limit") << r.ending_text;
  EXPECT_GT(r.time.back(), plan.stages[1].time);
  const record::Finding& mechanism = finding(r, "mechanism");
  EXPECT_THAT(mechanism.title, testing::MatchesRegex("Mechanism: .+"));
  EXPECT_FALSE(mechanism.text.empty());
  for (const record::Series& s : r.series)
    for (const double v : s.value) ASSERT_TRUE(std::isfinite(v)) << s.id;
  for (const float p : r.position) ASSERT_LT(std::abs(p), 200) << "a part was thrown out of the site";
  const record::Finding& energy = finding(r, "verification.energy");
  EXPECT_LT(energy.value, 0.01) << energy.text;  // what the issue asks for
  RecordProperty("mechanism", mechanism.text);
  if (std::string(GetParam()) != "plan.toml") return;  // the others ask what happens
  for (const char* id : {"mechanism", "azimuth", "stands_between_stages"}) {
    const record::Finding& met = finding(r, std::string("criterion.") + id);
    EXPECT_EQ(met.status, record::Status::Good) << met.text;
  }
}

INSTANTIATE_TEST_SUITE_P(Plans, StorehouseSlow,
                         testing::Values("plan.toml", "plan-equal-bays.toml", "plan-left-values.toml"));

}  // namespace
}  // namespace topple::collapse
