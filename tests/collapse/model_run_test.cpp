// Bare multibody models: the examples, what they write, and what a plan's model file keeps of its plan.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/file.h"
#include "collapse/run.h"
#include "mbs/model_json.h"
#include "mbs/quantity.h"

namespace topple::collapse {
namespace {

constexpr double kGravity = 9.81;

struct Example {
  mbs::Model model;
  record::Record record;
  mbs::Summary summary;
};

Example run(mbs::Model model, const RunOptions& o) {
  Example e;
  e.model = std::move(model);
  RunCallbacks callbacks;
  callbacks.on_summary = [&](const mbs::Summary& s) { e.summary = s; };
  e.record = run_model(e.model, o, callbacks);
  return e;
}

Example run_example(const std::string& name, double step = 0) {
  const std::string path = std::string(TOPPLE_SOURCE_DIR) + "/examples/mbs/" + name;
  mbs::RunSettings settings;
  mbs::Model model = mbs::model_from_json(read_file(path), path, &settings);
  RunOptions o;
  o.duration = settings.duration;
  o.step = step > 0 ? step : settings.step;
  o.equilibrium = settings.equilibrium.value_or(true);
  o.rest_speed = settings.rest_speed.value_or(0);
  return run(std::move(model), o);
}

const record::Output& output_of(const Example& e, const std::string& name) {
  for (const record::Output& o : e.record.outputs)
    if (o.name == name) return o;
  throw std::runtime_error("no output " + name);
}

/// Angles below the x axis of two rods of 1 m and 2 kg, 1 kg, turning about y, as those of the example; y = (a, b, a',
/// b'). From Lagrange's equations, with inertias about the centres as in the file.
std::array<double, 4> rate_of(const std::array<double, 4>& y) {
  const double m1 = 2, m2 = 1, c = 0.5, L = 1, I1 = 0.1667, I2 = 0.0833;
  const double m11 = I1 + m1 * c * c + m2 * L * L, m22 = I2 + m2 * c * c, m12 = m2 * L * c * std::cos(y[0] - y[1]);
  const double s = m2 * L * c * std::sin(y[0] - y[1]);
  const double f1 = (m1 * c + m2 * L) * kGravity * std::cos(y[0]) - s * y[3] * y[3];
  const double f2 = m2 * c * kGravity * std::cos(y[1]) + s * y[2] * y[2];
  const double det = m11 * m22 - m12 * m12;
  return {y[2], y[3], (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det};
}

std::array<double, 4> swing(double time) {
  std::array<double, 4> y{0, 0, 0, 0};
  const int n = static_cast<int>(std::lround(time * 20000));
  const double h = n > 0 ? time / n : 0;
  const auto moved = [](std::array<double, 4> a, const std::array<double, 4>& k, double f) {
    for (size_t i = 0; i < 4; ++i) a[i] += f * k[i];
    return a;
  };
  for (int i = 0; i < n; ++i) {
    const auto k1 = rate_of(y), k2 = rate_of(moved(y, k1, h / 2)), k3 = rate_of(moved(y, k2, h / 2)),
               k4 = rate_of(moved(y, k3, h));
    for (size_t k = 0; k < 4; ++k) y[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
  }
  return y;
}

TEST(ModelRunPhysics, TheDoublePendulumSwingsAsLagrangeSays) {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    const Example e = run_example("double_pendulum.json", i == 0 ? 4e-4 : 2e-4);
    EXPECT_EQ(e.record.ending, "time_limit");
    EXPECT_LT(e.summary.joint_drift, 1e-8);
    const record::Output& p = output_of(e, "lower_position");
    ASSERT_EQ(p.time.size(), 201u);
    error[i] = 0;
    for (size_t t = 0; t < p.time.size(); t += 20) {
      const auto y = swing(p.time[t]);
      error[i] = std::max(error[i], std::hypot(p.value[3 * t] - std::cos(y[0]) - 0.5 * std::cos(y[1]),
                                               p.value[3 * t + 2] + std::sin(y[0]) + 0.5 * std::sin(y[1])));
      EXPECT_NEAR(p.value[3 * t + 1], 0, 1e-12);
    }
  }
  EXPECT_LT(error[1], 2e-5);
  EXPECT_NEAR(error[0] / error[1], 4, 0.2) << "second order";
  const Example e = run_example("double_pendulum.json");
  const record::Output& q = output_of(e, "lower_orientation");
  ASSERT_EQ(q.value.size(), 4 * 101u);
  const auto y = swing(q.time.back());
  const double b = std::remainder(2 * std::atan2(q.value[4 * 100 + 2], q.value[4 * 100]) - y[1], 2 * 3.14159265358979);
  EXPECT_NEAR(b, 0, 1e-4);
  EXPECT_EQ(output_of(e, "top_reaction").quantity, "force of joint top");
  EXPECT_EQ(output_of(e, "top_reaction").time.size(), 401u);
}

/// The slider-crank of the example with one coordinate, the crank's angle from upright towards the piston: crank of
/// 0.3 m, rod of 0.5 m, piston at 0.4 m at the start.
struct SliderCrank {
  static double tabulated(double x, const std::vector<double>& at, const std::vector<double>& f) {
    if (x <= at.front()) return f.front();
    for (size_t i = 1; i < at.size(); ++i)
      if (x < at[i]) return f[i - 1] + (f[i] - f[i - 1]) * (x - at[i - 1]) / (at[i] - at[i - 1]);
    return f.back();
  }
  static double stroke(double a) {
    const double c = 0.3 * std::cos(a);
    return 0.3 * std::sin(a) + std::sqrt(0.25 - c * c) - 0.4;
  }
  static double stroke_rate(double a) {  // with the angle
    const double s = 0.3 * std::sin(a), c = 0.3 * std::cos(a);
    return c + c * s / std::sqrt(0.25 - c * c);
  }
  static double inertia(double a) {
    const double s = 0.3 * std::sin(a), c = 0.3 * std::cos(a), x = stroke_rate(a);
    const double rod_turn = s / std::sqrt(0.25 - c * c);
    return 0.0225 + 3 * 0.15 * 0.15 + 2 * 0.25 * ((c + x) * (c + x) + s * s) + 0.0417 * rod_turn * rod_turn + 4 * x * x;
  }
  /// Of the cushion on the ground, along the guide [N].
  static double cushion(double a, double rate) {
    return tabulated(stroke(a), {-0.2, 0, 0.2, 0.4}, {-10, 0, 10, 200}) + 5 * stroke_rate(a) * rate;
  }
  static double acceleration(double t, double a, double rate) {
    const double torque = 8 * tabulated(t, {0, 0.1, 0.6, 0.8}, {0, 1, 1, 0});
    const double weight = kGravity * 0.5 * (3 + 2) * 0.3 * std::sin(a), d = 1e-5;
    const double slope = (inertia(a + d) - inertia(a - d)) / (2 * d);
    return (torque + weight - cushion(a, rate) * stroke_rate(a) - 0.5 * slope * rate * rate) / inertia(a);
  }
};

TEST(ModelRunPhysics, TheSliderCrankTurnsAsLagrangeSays) {
  using S = SliderCrank;
  const Example e = run_example("slider_crank.json");
  EXPECT_EQ(e.record.ending, "time_limit");
  EXPECT_LT(e.summary.joint_drift, 1e-8);
  EXPECT_LT(e.summary.energy_error, 1e-5);
  ASSERT_EQ(e.summary.notes.size(), 1u);
  EXPECT_NE(e.summary.notes[0].find("1 constraint of 18"), std::string::npos) << e.summary.notes[0];
  const record::Output &angle = output_of(e, "crank_angle"), &stroke = output_of(e, "stroke"),
                       &cushion = output_of(e, "cushion_force"), &thrust = output_of(e, "side_thrust");
  ASSERT_EQ(angle.time.size(), 201u);
  double a = 0, v = 0, t = 0, largest = 0;
  const double h = 5e-5;
  for (size_t i = 0; i < angle.time.size(); ++i) {
    for (; t < angle.time[i] - h / 2; t += h) {
      const double k1 = S::acceleration(t, a, v), v2 = v + h / 2 * k1,
                   k2 = S::acceleration(t + h / 2, a + h / 2 * v, v2), v3 = v + h / 2 * k2,
                   k3 = S::acceleration(t + h / 2, a + h / 2 * v2, v3), v4 = v + h * k3,
                   k4 = S::acceleration(t + h, a + h * v3, v4);
      a += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    largest = std::max(largest, std::abs(a));
    EXPECT_NEAR(angle.value[i], a, 2e-6) << angle.time[i];
    EXPECT_NEAR(stroke.value[i], S::stroke(angle.value[i]), 1e-10) << angle.time[i];
    EXPECT_NEAR(cushion.value[3 * i], -S::cushion(a, v), 1e-3) << angle.time[i];
    EXPECT_NEAR(thrust.value[3 * i], 0, 1e-9) << "x of F is y of W";
  }
  EXPECT_GT(largest, 0.9);
}

TEST(ModelRunPhysics, TheBoxesFollowTheRulesOfTheirPairs) {
  const Example e = run_example("falling_boxes.json");
  EXPECT_EQ(e.record.ending, "time_limit");
  EXPECT_LT(e.summary.energy_error, 1e-3);
  const Vec3 up{std::sin(0.2), 0, std::cos(0.2)}, down{std::cos(0.2), 0, -std::sin(0.2)};
  const auto place = [&e](const std::string& name, size_t t) {
    const record::Output& o = output_of(e, name);
    return Vec3{o.value[3 * t], o.value[3 * t + 1], o.value[3 * t + 2]};
  };
  const size_t samples = output_of(e, "steel").time.size();
  ASSERT_EQ(samples, 76u);
  double rubber_after = 0, lowest = 1, nearest = 9;
  bool has_touched = false;
  for (size_t t = 0; t < samples; ++t) {
    for (const char* box : {"steel", "rubber"}) lowest = std::min(lowest, dot(up, place(box, t)) - 0.25);
    nearest = std::min(nearest, norm(place("ghost", t) - place("steel", t)));
    const double height = dot(up, place("rubber", t)) - 0.25;
    if (height < 0.06) has_touched = true;
    if (has_touched) rubber_after = std::max(rubber_after, height);
  }
  // steel of 800 kg falls from 0.9 m: a spring of its mass at 1500 rad/s yields v / 1500
  EXPECT_GT(lowest, -1.5 * std::sqrt(2 * kGravity * 0.9) / 1500) << "a box sinks into the slope";
  EXPECT_GT(rubber_after, 0.2) << "rubber bounces";
  EXPECT_LT(nearest, 0.25) << "the ghost falls through the steel";
  EXPECT_NEAR(dot(up, place("ghost", samples - 1)), 0.25, 0.01) << "and lies on the slope";
  // the wedge slides: friction 0.1 on a slope of tan 0.2 rad
  const record::Output& wedge = output_of(e, "wedge_speed");
  const size_t last = samples - 1, earlier = samples - 21;
  const double gain =
      dot(down, Vec3{wedge.value[3 * last], wedge.value[3 * last + 1], wedge.value[3 * last + 2]}) -
      dot(down, Vec3{wedge.value[3 * earlier], wedge.value[3 * earlier + 1], wedge.value[3 * earlier + 2]});
  const double a = kGravity * (std::sin(0.2) - 0.1 * std::cos(0.2));
  EXPECT_NEAR(gain / (wedge.time[last] - wedge.time[earlier]), a, 0.05 * a);
}

TEST(ModelRun, SaysWhatTheEngineSaysOfItsNumbers) {
  const Example e = run_example("double_pendulum.json");
  std::string ids;
  for (const record::Finding& f : e.record.findings) ids += f.id + " ";
  EXPECT_EQ(ids, "verification.energy verification.step verification.joints ");
  EXPECT_EQ(e.record.findings[0].value, e.summary.energy_error);
  EXPECT_EQ(e.record.findings[0].status, record::Status::Good);
}

/// What a file with these bodies and more gives without a step of its own.
Example run_text(const std::string& more, double duration, bool equilibrium = false) {
  mbs::RunSettings settings;
  mbs::Model model = mbs::model_from_json(R"({"format": "topple-mbs", "version": 2, "gravity": [0, 0, 0],
      "contact": {"ground": false, "bodies": false}, )" +
                                              more + "}",
                                          "here", &settings);
  RunOptions o;
  o.duration = duration;
  o.equilibrium = equilibrium;
  o.rest_speed = 0;
  o.frame_rate = 100;
  o.stability_share = settings.stability_share;
  return run(std::move(model), o);
}

const record::Finding& finding_of(const Example& e, const std::string& id) {
  for (const record::Finding& f : e.record.findings)
    if (f.id == id) return f;
  throw std::runtime_error("no finding " + id);
}

TEST(ModelRunPhysics, ItsOwnStepFollowsTheModesOfAModel) {
  // 1 kg on 10 N/m, thrown at 1 m/s: x = 1 + sin(wt)/w
  const Example e = run_text(R"("bodies": [{"name": "b", "mass": 1, "inertia": [1, 1, 1], "X_WB": {"p": [1, 0, 0]},
      "v_WB": [1, 0, 0]}],
      "springs": [{"name": "s", "a": "ground", "b": "b", "points": [[0, 0, 0], [1, 0, 0]], "spring": 10}])",
                             5);
  const double w = std::sqrt(10.0);
  ASSERT_GT(e.record.time.size(), 80U);
  for (size_t i = 0; i < e.record.time.size(); ++i)
    EXPECT_NEAR(e.record.position[3 * i], 1 + std::sin(w * e.record.time[i]) / w, 5e-3 / w) << e.record.time[i];
  EXPECT_LT(e.summary.energy_error, 0.01);
}

TEST(ModelRunPhysics, ItsOwnStepFollowsWhatSpins) {
  // a free body about its middle axis: the energy is that of the start
  const Example e =
      run_text(R"("bodies": [{"name": "b", "mass": 1, "inertia": [1, 2, 3], "X_WB": {}, "w_WB": [1, 800, 1]}])", 0.2);
  EXPECT_LE(e.summary.step, 0.03 / 800);
  EXPECT_LT(e.summary.energy_error, 0.01);
  EXPECT_EQ(finding_of(e, "verification.energy").status, record::Status::Good);
}

TEST(ModelRunPhysics, AShortRunHasManySteps) {
  const Example e =
      run_text(R"("bodies": [{"name": "b", "mass": 1, "inertia": [1, 2, 3], "X_WB": {}, "v_WB": [1, 0, 0]}])", 1e-3);
  EXPECT_GE(e.summary.steps, 200);
  EXPECT_NEAR(e.summary.time, 1e-3, 1e-5);
}

TEST(ModelRun, RestsWithoutAnErrorOfEnergyToSpeakOf) {
  const Example e = run_text(R"("bodies": [{"name": "a", "mass": 10, "inertia": [1, 1, 1], "X_WB": {"p": [1, 0, 0]}},
      {"name": "b", "mass": 10, "inertia": [1, 1, 1], "X_WB": {"p": [3, 0, 0]}}],
      "joints": [{"name": "root", "kind": "fixed", "parent": "ground", "child": "a", "at": [0, 0, 0]},
                 {"name": "tip", "kind": "fixed", "parent": "a", "child": "b", "at": [2, 0, 0]}],
      "loads": [{"name": "push", "body": "b", "force": [0, 0, -200]}])",
                             0.1, true);
  EXPECT_EQ(finding_of(e, "verification.energy").status, record::Status::Good);
}

TEST(ModelRun, TellsTheWorkOfLoads) {
  // 2 kg pushed by 6 N from rest: 3 m/s2
  const Example e = run_text(R"("bodies": [{"name": "b", "mass": 2, "inertia": [1, 1, 1], "X_WB": {}}],
      "loads": [{"name": "push", "body": "b", "force": [6, 0, 0]}])",
                             1);
  const auto series = [&e](const std::string& id) {
    for (const record::Series& s : e.record.series)
      if (s.id == id) return s.value;
    return std::vector<double>();
  };
  const std::vector<double> work = series("energy_loads"), kinetic = series("energy_kinetic");
  ASSERT_EQ(work.size(), e.record.time.size());
  ASSERT_GT(work.size(), 90U);
  for (size_t i = 0; i < work.size(); ++i) {
    const double v = 3 * e.record.time[i];
    EXPECT_NEAR(work[i], v * v, 0.05) << e.record.time[i];
    EXPECT_NEAR(kinetic[i] - work[i], series("energy_residual")[i], 1e-9) << e.record.time[i];
  }
}

TEST(ModelRun, FailsWhereTheBalanceOfEnergyIsLost) {
  // 1 kg in place of 100 on a spring of 1e4 N/m: the step of 50 ms is far too long then
  const std::string more = R"("run": {"step": 0.05, "equilibrium": false},
      "bodies": [{"name": "b", "mass": 100, "inertia": [1, 1, 1], "X_WB": {"p": [1, 0, 0]}, "v_WB": [0.1, 0, 0]}],
      "springs": [{"name": "s", "a": "ground", "b": "b", "points": [[0, 0, 0], [1, 0, 0]], "spring": 10000}],
      "events": [{"name": "shrink", "time": 0.5, "actions": [{"do": "replace_body", "body": "b",
                  "replacement": {"name": "b", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}}}]}])";
  mbs::RunSettings settings;
  const mbs::Model m = mbs::model_from_json(
      R"({"format": "topple-mbs", "version": 2, "gravity": [0, 0, 0], )" + more + "}", "here", &settings);
  RunOptions o;
  o.duration = 2;
  o.step = settings.step;
  o.equilibrium = false;
  const record::Record r = run_model(m, o, {});
  EXPECT_EQ(r.ending, "failed");
  EXPECT_NE(r.ending_text.find("energy"), std::string::npos) << r.ending_text;
}

TEST(ModelRun, FailsWhereJointsAreLost) {
  // three bars stretched between two hinges, torn apart by far more than a step can close
  std::string bodies, joints;
  const char* const names[] = {"ground", "a", "b", "c", "ground"};
  for (int i = 0; i < 4; ++i) {
    joints += fmt::format(R"({}{{"name": "{}", "kind": "revolute", "parent": "{}", "child": "{}", "at": [{}, 0, 0],
        "axis": [0, 1, 0]}})",
                          i > 0 ? "," : "", i, names[i], names[i + 1], i);
    if (i > 0)
      bodies +=
          fmt::format(R"({}{{"name": "{}", "mass": 1, "inertia": [0.01, 0.1, 0.1], "X_WB": {{"p": [{}, 0, 0]}}}})",
                      i > 1 ? "," : "", names[i], i - 0.5);
  }
  mbs::Model m = mbs::model_from_json(
      R"({"format": "topple-mbs", "version": 2, "contact": {"ground": false, "bodies": false}, "bodies": [)" + bodies +
          R"(], "joints": [)" + joints + R"(], "loads": [{"name": "pull", "body": "b", "force": [0, 0, -1e9]}]})",
      "here");
  RunOptions o;
  o.duration = 0.3;
  o.step = 1e-3;
  o.equilibrium = false;
  const record::Record r = run_model(m, o, {});
  EXPECT_EQ(r.ending, "failed");
  EXPECT_NE(r.ending_text.find("could not be closed"), std::string::npos) << r.ending_text;
}

TEST(ModelRun, ShowsWhereItEnds) {
  mbs::Model m = run_example("double_pendulum.json").model;
  RunOptions o;
  o.duration = 0.5;
  o.frame_rate = 5;
  o.equilibrium = false;
  const record::Record r = run_model(m, o, {});
  ASSERT_EQ(r.time.size(), 4U);
  EXPECT_NEAR(r.time.back(), 0.5, 0.01);
}

TEST(ModelRun, NotesAnInertiaThatNoBodyHas) {
  const char* bodies = R"("bodies": [{{"name": "rod", "mass": 1, "inertia": [{}, 1, 1], "X_WB": {{}}}},
      {{"name": "odd", "mass": 1, "inertia": [1, 1, {}], "X_WB": {{"p": [9, 0, 0]}}}}])";
  EXPECT_TRUE(run_text(fmt::format(fmt::runtime(bodies), 1e-3, 2), 0.1).summary.notes.empty());
  const Example e = run_text(fmt::format(fmt::runtime(bodies), 1e-3, 2.1), 0.1);
  ASSERT_EQ(e.summary.notes.size(), 1U);
  EXPECT_EQ(e.summary.notes[0],
            "bodies[1] \"odd\".inertia: an inertia with a principal moment larger than the sum of the two others, "
            "which no body has");
  const Example both = run_text(fmt::format(fmt::runtime(bodies), 9, 2.1), 0.1);
  ASSERT_EQ(both.summary.notes.size(), 1U);
  EXPECT_NE(both.summary.notes[0].find("; 1 more like it"), std::string::npos) << both.summary.notes[0];
}

TEST(ModelRun, NotesOutputsThatAskForMoreThanThereIs) {
  const Example fine = run_example("double_pendulum.json", 5e-3);
  EXPECT_TRUE(fine.summary.notes.empty()) << fine.summary.notes.front();
  const Example coarse = run_example("double_pendulum.json", 8e-3);
  ASSERT_EQ(coarse.summary.notes.size(), 1u);
  EXPECT_EQ(coarse.summary.notes[0], "output \"top_reaction\" asks for 200 samples a second, the steps give 125");
  EXPECT_EQ(output_of(coarse, "top_reaction").time.size(), 251u);
  EXPECT_EQ(coarse.record.findings.back().id, "note.1");
}

TEST(ModelRun, ShowsHullsAsTheirBoxesAndNoPlanes) {
  mbs::Model m;
  m.contact.ground = m.contact.bodies = false;
  mbs::Body hull;
  hull.name = "hull";
  hull.shapes.resize(1);
  hull.shapes[0].kind = mbs::Shape::Kind::Hull;
  hull.shapes[0].vertices = {{0, 0, 0}, {2, 0, 0}, {0, 4, 0}, {0, 0, 6}};
  hull.shapes[0].X_BS = {{1, 0, 0}, exp_rotation({0, 0, std::acos(0.0)})};
  mbs::Body ground;
  ground.name = "slope";
  ground.fixed = true;
  ground.shapes.resize(1);
  ground.shapes[0].kind = mbs::Shape::Kind::Plane;
  m.bodies = {hull, ground};
  RunOptions o;
  o.duration = 0.01;
  o.step = 0.001;
  o.equilibrium = false;
  const record::Record r = run_model(m, o, {});
  ASSERT_EQ(r.bodies[0].shapes.size(), 1u);
  EXPECT_EQ(r.bodies[0].shapes[0].half, (Vec3{1, 2, 3}));
  EXPECT_LT(norm(r.bodies[0].shapes[0].X_BS.p - Vec3{1 - 2, 1, 3}), 1e-15);
  EXPECT_TRUE(r.bodies[1].shapes.empty());
}

TEST(ModelRun, WritesAnOutputOfEachKindUnderTheNameOfItsItem) {
  const std::string path = std::string(TOPPLE_SOURCE_DIR) + "/tests/data/everything.mbs.json";
  mbs::RunSettings settings;
  RunOptions o;
  o.duration = 0.02;
  o.step = settings.step;
  o.equilibrium = false;
  const Example e = run(mbs::model_from_json(read_file(path), path, &settings), o);
  ASSERT_EQ(e.record.outputs.size(), e.model.outputs.size());
  for (size_t i = 0; i < e.model.outputs.size(); ++i) {
    const record::Output& out = e.record.outputs[i];
    EXPECT_FALSE(out.value.empty()) << out.name;
    EXPECT_EQ(out.quantity.find(std::string(mbs::traits_of(e.model.outputs[i].quantity.kind).word) + " of "), 0u)
        << out.quantity;
  }
  EXPECT_EQ(output_of(e, "knee m").quantity, "moment of rotational element knee");
  EXPECT_EQ(output_of(e, "coil torque").quantity, "torque of rotational_spring coil");
  EXPECT_EQ(output_of(e, "rope length").quantity, "length of cable rope");
}

}  // namespace
}  // namespace topple::collapse
