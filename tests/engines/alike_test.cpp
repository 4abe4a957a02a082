// The native engine and the others on the same models: force elements, loads, events. The integrators differ (leapfrog
// of second order; Runge-Kutta of fourth), as do the coordinates and all code but the law of a zone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cases.h"
#include "engines/compare.h"

namespace topple::engines {
namespace {

using Kind = mbs::Joint::Kind;

constexpr double kStep = 1e-4;  // [s]

class EnginesAlikeReference : public testing::TestWithParam<std::string> {
 protected:
  EngineRun compare_with_native(const mbs::Model& model, double duration, double step = kStep,
                                bool equilibrium = false) {
    std::vector<std::unique_ptr<Engine>> list;
    list.push_back(make_engine("native"));
    list.push_back(make_engine(GetParam(), {1e-9}));
    mbs::Options o = test::make_options(duration, duration / 20, step);
    o.equilibrium = equilibrium;
    Comparison c = compare(model, o, list);
    EXPECT_EQ(c.runs[0].summary.ending, mbs::Summary::Ending::TimeLimit) << c.runs[0].summary.message;
    EXPECT_EQ(c.runs[1].summary.ending, mbs::Summary::Ending::TimeLimit) << c.runs[1].summary.message;
    EXPECT_EQ(c.runs[1].time.size(), 21U);
    EXPECT_EQ(c.runs[0].broken, c.runs[1].broken);
    return c.runs[1];
  }
  /// Errors of the native engine fall with the square of the step; at 0.1 ms they are this large. [m, rad]
  void expect_alike(const mbs::Model& model, double duration, double tolerance) {
    const EngineRun r = compare_with_native(model, duration);
    EXPECT_LT(r.position.value, tolerance);
    EXPECT_LT(r.orientation.value, tolerance);
    EXPECT_LT(r.summary.energy_error, 1e-5);
  }
};

#define NEEDS_ENGINE() TOPPLE_NEEDS_ENGINE(GetParam())

mbs::BodyId add_brick(mbs::Model& m, const std::string& name, const Vec3& p) {
  return mbs::add_body(m, test::make_body(name, 10, {0.5, 0.8, 1.1}, p));
}

TEST_P(EnginesAlikeReference, SpringsOfAllLaws) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto a = add_brick(m, "a", {0, 0, 0}), b = add_brick(m, "b", {1, 0.2, 0.1});
  mbs::SpringDamper s;
  s.a = mbs::kGround;
  s.b = a;
  s.p_A = {0, 0, 2};
  s.p_B = {0.2, 0.1, 0.3};
  s.free_length = 1.5;
  s.spring.rate = 400;
  s.damper.kind = mbs::Characteristic::Kind::Table;
  s.damper.x = {-1, 0, 1};
  s.damper.f = {-5, 0, 20};
  m.springs.push_back(s);
  s.a = a;
  s.b = b;
  s.p_A = {0.3, 0, 0};
  s.p_B = {-0.3, 0, 0.1};
  s.free_length = 0.5;
  s.spring.kind = mbs::Characteristic::Kind::Polynomial;
  s.spring.coefficients = {5, 300, 100, 50};
  s.damper = {};
  s.damper.rate = 4;
  m.springs.push_back(s);
  expect_alike(m, 2, 1e-6);
}

TEST_P(EnginesAlikeReference, Bushing) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto a = add_brick(m, "a", {0, 0, 0});
  m.bodies[0].w_WB = {0.5, -0.3, 0.8};
  mbs::Bushing b;
  b.a = mbs::kGround;
  b.b = a;
  b.X_AF.q = exp_rotation({0.2, 0.5, -0.3});
  b.X_BM = {{0.1, -0.2, 0.3}, exp_rotation({-0.4, 0.1, 0.6})};
  for (int i = 0; i < 6; ++i) {
    b.spring[i].rate = i < 3 ? 2000 + 300 * i : 60 + 10 * i;
    b.damper[i].rate = i < 3 ? 20 : 1;
  }
  m.bushings.push_back(b);
  expect_alike(m, 2, 3e-6);
}

TEST_P(EnginesAlikeReference, BushingTurnedBeyondHalfATurn) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({});
  const auto a = add_brick(m, "a", {0, 0, 0});
  m.bodies[0].w_WB = {0.3, 0.2, 12};
  mbs::Bushing b;
  b.a = mbs::kGround;
  b.b = a;
  for (int i = 0; i < 6; ++i) b.spring[i].rate = i < 3 ? 2000 : 8;
  m.bushings.push_back(b);
  expect_alike(m, 0.9, 1e-5);  // to 4.4 rad and back
}

TEST_P(EnginesAlikeReference, CantileverOfBushings) {
  NEEDS_ENGINE();
  // bars of 1 m joined by bushings of a steel tube's stiffness, let go
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::BodyId before = mbs::kGround;
  for (int i = 0; i < 4; ++i) {
    const auto bar = mbs::add_body(m, test::make_body("bar", 20, {0.1, 1.7, 1.7}, {i + 0.5, 0, 0}));
    mbs::Bushing b;
    b.a = before;
    b.b = bar;
    b.X_AF.p = i == 0 ? Vec3{} : Vec3{0.5, 0, 0};
    b.X_BM.p = {-0.5, 0, 0};
    const double rate[6] = {4e6, 1e6, 1e6, 2e4, 4e4, 4e4};
    for (int k = 0; k < 6; ++k) {
      b.spring[k].rate = rate[k];
      b.damper[k].rate = 1e-3 * rate[k];
    }
    m.bushings.push_back(b);
    before = bar;
  }
  expect_alike(m, 1, 5e-7);
}

TEST_P(EnginesAlikeReference, ElasticElementsWithTheirDamping) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::BodyId before = mbs::kGround;
  for (int i = 0; i < 3; ++i) {
    const auto block = add_brick(m, "block", {i + 0.5, 0, 0});
    mbs::ZoneElement e;
    e.a = before;
    e.b = block;
    e.X_AF.p = i == 0 ? Vec3{} : Vec3{0.5, 0, 0};
    e.X_BM.p = {-0.5, 0, 0};
    e.translational_stiffness = {4e5, 2e5, 2e5};
    e.rotational_stiffness = {3e3, 5e3, 5e3};
    e.damping_ratio = 0.05;
    mbs::add_element(m, e);
    before = block;
  }
  expect_alike(m, 1, 3e-7);
}

/// A beam held by one element that yields at `moment`.
mbs::Model make_hinged_block(double moment) {
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto block = add_brick(m, "block", {0.5, 0, 0});
  mbs::ZoneLaw law;
  law.moment_y.normal_force = {-1e9, 1e9};
  law.moment_y.plastic_rotation = {0, 10};
  law.moment_y.positive = law.moment_y.negative = {moment, moment, moment, moment};
  mbs::ZoneElement e;
  e.a = mbs::kGround;
  e.b = block;
  e.X_BM.p = {-0.5, 0, 0};
  e.translational_stiffness = {4e5, 2e5, 2e5};
  e.rotational_stiffness = {3e3, 5e3, 5e3};
  e.stations = {{0, mbs::add_law(m, law)}};
  mbs::add_element(m, e);
  return m;
}

TEST_P(EnginesAlikeReference, YieldingZone) {
  NEEDS_ENGINE();
  // 49 N·m of dead load against 30 N·m: the block turns down while the zone flows
  const EngineRun r = compare_with_native(make_hinged_block(30), 0.8);
  EXPECT_LT(r.position.value, 5e-7);
  EXPECT_LT(r.summary.energy_error, 1e-6);
}

TEST_P(EnginesAlikeReference, RupturingZone) {
  NEEDS_ENGINE();
  mbs::Model m = make_hinged_block(30);
  m.laws.edit(0, [](mbs::ZoneLaw& law) { law.rupture_rotation = 0.3; });
  const EngineRun r = compare_with_native(m, 0.8);
  EXPECT_EQ(r.broken, 1);
  EXPECT_LT(r.position.value, 5e-4);  // half a step, 0.05 ms, at 3 m/s and what follows
}

TEST_P(EnginesAlikeReference, CableThatGoesSlackAndBreaks) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto a = add_brick(m, "a", {0, 0, 0});
  m.bodies[0].v_WB = {0, 0, 3};
  mbs::Cable c;
  c.a = mbs::kGround;
  c.b = a;
  c.p_A = {0.3, 0, 0.5};
  c.p_B = {0.1, 0, 0.2};
  c.stiffness = 2e4;
  c.pretension = 50;
  m.cables.push_back(c);
  expect_alike(m, 0.8, 5e-6);  // the slope of the force jumps where the cable gets taut
  m.cables[0].strength = 300;
  const EngineRun r = compare_with_native(m, 0.8);
  EXPECT_EQ(r.broken, 1);
  EXPECT_LT(r.position.value, 1e-3);  // some tenths of 300 N for 0.1 ms, and half a second of flight after it
}

TEST_P(EnginesAlikeReference, LoadsInBothFrames) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto a = add_brick(m, "a", {0, 0, 0});
  mbs::Load l;
  l.body = a;
  l.p_B = {0.2, 0.1, 0};
  l.force = {10, 20, 120};
  l.torque = {1, -2, 0.5};
  l.follows_body = true;
  m.loads.push_back(l);
  l.follows_body = false;
  l.force = {-30, 0, 10};
  l.time = {0, 0.5, 1};
  l.factor = {0, 1, -1};
  m.loads.push_back(l);
  expect_alike(m, 1.5, 2e-6);
}

/// Of the first joint.
mbs::RotationalElement make_hinge() {
  mbs::RotationalElement e;
  e.joint = {0};
  e.stiffness = 20;
  return e;
}

TEST_P(EnginesAlikeReference, RotationalElementsAndSprings) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  m.joints[0].X_PF.q = test::z_along_y() * exp_rotation({0, 0, 0.3});  // an angle at the start
  mbs::RotationalSpring s;
  s.joint = {0};
  s.free_angle = 0.2;
  s.spring.rate = 15;
  s.damper.rate = 0.5;
  m.rotational_springs.push_back(s);
  m.rotational_elements.push_back(make_hinge());
  expect_alike(m, 2, 3e-7);
}

TEST_P(EnginesAlikeReference, AJointThatIsLoosened) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  mbs::RotationalElement e = make_hinge();
  e.loose_translational = {4e3, 3e3, 5e3};
  e.loose_torsion = 30, e.loose_bending = 40;
  m.rotational_elements.push_back(e);
  mbs::Event event;
  event.time = 0.4;
  event.actions.resize(1);
  event.actions[0].kind = mbs::Action::Kind::LoosenJoint;
  event.actions[0].joint = {0};
  m.events.push_back(event);
  expect_alike(m, 1.5, 1e-5);
  EXPECT_LT(compare_with_native(m, 1.5, kStep / 2).position.value, 3e-6);  // events fire at steps
  // what the element says of itself, too
  const auto ours = test::run(*make_engine("native"), m, test::make_options(1.5, 0.01, kStep));
  const auto theirs = test::run(*make_engine(GetParam()), m, test::make_options(1.5, 0.01, kStep));
  ASSERT_EQ(ours.frames.size(), theirs.frames.size());
  double most = 0;
  for (size_t i = 0; i < ours.frames.size(); ++i) {
    const mbs::View &a = ours.frames[i], &b = theirs.frames[i];
    most = std::max(most, std::abs(a.hinge_moment[0]));
    EXPECT_NEAR(a.hinge_rotation[0], b.hinge_rotation[0], 1e-4) << a.time;
    EXPECT_NEAR(a.hinge_moment[0], b.hinge_moment[0], 20e-4) << a.time;
  }
  EXPECT_GT(most, 5);
}

TEST_P(EnginesAlikeReference, ARotationalElementThatIsRemoved) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  m.rotational_elements.push_back(make_hinge());
  mbs::Event event;
  event.time = 0.4;
  event.actions.resize(1);
  event.actions[0].kind = mbs::Action::Kind::RemoveElement;
  event.actions[0].rotational = 0;
  m.events.push_back(event);
  EXPECT_LT(compare_with_native(m, 1.2).position.value, 1e-3);  // events fire at steps
  const auto theirs = test::run(*make_engine(GetParam()), m, test::make_options(0.5, 0.5, kStep));
  EXPECT_EQ(theirs.frames.back().hinge_moment[0], 0);
}

TEST_P(EnginesAlikeReference, EventsAndReleases) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  mbs::add_body(m, test::make_body("tail", 1, {0.04, 0.1, 0.1}, {6, 0, 0}));
  mbs::add_joint(m, test::make_joint(m, Kind::Fixed, {0}, {1}, {{4, 0, 0}, {}}));
  mbs::SpringDamper s;
  s.a = mbs::kGround;
  s.b = {1};
  s.p_A = {6, 0, 3};
  s.free_length = 2.9;
  s.spring.rate = 50;
  m.springs.push_back(s);
  mbs::Load l;
  l.body = {1};
  l.force = {0, 5, 0};
  l.time = {0, 0.2};
  l.factor = {1, 0};
  m.loads.push_back(l);
  const auto add = [&](double time, mbs::Action a) {
    mbs::Event e;
    e.time = time;
    e.actions = {a};
    m.events.push_back(e);
  };
  mbs::Action a;
  a.kind = mbs::Action::Kind::RemoveSpring;
  a.index = 0;
  add(0.3, a);
  a = {};
  a.kind = mbs::Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = test::make_body("bar", 0.5, {0.02, 0.06, 0.06}, {0.3, 0, 0.1});
  add(0.5, a);
  a = {};
  a.kind = mbs::Action::Kind::ReleaseJoint;
  a.joint = {1};
  add(0.7, a);
  a = {};
  a.kind = mbs::Action::Kind::ApplyLoad;
  a.index = 0;
  add(0.8, a);
  a = {};
  a.kind = mbs::Action::Kind::ReleaseJoint;
  a.joint = {0};
  mbs::Event low;
  mbs::Trigger t;
  t.quantity = {mbs::Quantity::Kind::Position, 0};
  t.component = 2;
  t.limit = -1.8;
  t.rising = false;
  low.time = 0.9;
  low.triggers = {t};
  low.actions = {a};
  m.events.push_back(low);
  const EngineRun r = compare_with_native(m, 1.4);
  EXPECT_EQ(r.broken, 2);
  EXPECT_LT(r.position.value, 1e-3);  // the trigger is seen at steps, 0.1 ms at some m/s
}

// The first one takes the angle that the second one waits for, too.
TEST_P(EnginesAlikeReference, EventsOfOneInstantAreDecidedOnTogether) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  const auto other = add_brick(m, "other", {0, 5, 0});
  mbs::SpringDamper s;
  s.a = mbs::kGround, s.b = other;
  s.p_A = {0, 5, 3};
  s.free_length = 3;
  s.spring.rate = 500;
  m.springs.push_back(s);
  mbs::Trigger t;
  t.quantity = {mbs::Quantity::Kind::JointAngle, 0};
  t.component = 3;
  t.limit = 0.5;
  for (const auto kind : {mbs::Action::Kind::ReleaseJoint, mbs::Action::Kind::RemoveSpring}) {
    mbs::Event e;
    e.triggers = {t};
    e.actions.resize(1);
    e.actions[0].kind = kind;
    e.actions[0].joint = {0}, e.actions[0].index = 0;
    m.events.push_back(e);
  }
  const EngineRun r = compare_with_native(m, 1.5);
  EXPECT_EQ(r.broken, 1);
  EXPECT_LT(r.position.value, 2e-3) << "the limit is seen at steps; 2 m where the spring stays";
}

TEST_P(EnginesAlikeReference, AHingeThatHasBrokenTurnsFreely) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  m.joints[0].rotation_limit = 1;
  mbs::ZoneLaw law;
  law.moment_y.normal_force = {-1e9, 1e9};
  law.moment_y.plastic_rotation = {0, 1};
  law.moment_y.positive = law.moment_y.negative = {1, 1, 1, 1};
  law.moment_z = law.moment_y;
  law.rupture_rotation = 0.2;
  m.laws.push_back(law);
  mbs::RotationalElement e = make_hinge();
  e.law = {0};
  m.rotational_elements.push_back(e);
  const EngineRun r = compare_with_native(m, 1.5);
  EXPECT_EQ(r.broken, 1) << "the element, and not the joint";
  EXPECT_LT(r.position.value, 5e-3);
}

TEST_P(EnginesAlikeReference, WhatEventsRemoveLeavesWithItsEnergyAtTheEvent) {
  NEEDS_ENGINE();
  using Do = mbs::Action::Kind;
  // masses of 2 and 3 kg that part with 1 m/s against 100 N/m; a bar of 1 kg·m² that turns against 100 N·m/rad
  const double masses = 0.6 * std::pow(std::sin(0.2 * std::sqrt(100 / 1.2)), 2);
  const double bar = 0.5 * std::pow(std::sin(0.2 * 10), 2);
  for (const Do kind : {Do::RemoveSpring, Do::RemoveBushing, Do::ReleaseCable, Do::RemoveElement, Do::ReleaseJoint}) {
    mbs::Model m = test::make_empty({0, 0, 0});
    mbs::add_body(m, test::make_body("a", kind == Do::ReleaseJoint ? 1 : 2, {1, 1, 1}, {0, 0, 0}));
    if (kind != Do::ReleaseJoint) {
      m.bodies[0].v_WB = {-1, 0, 0};
      mbs::add_body(m, test::make_body("b", 3, {1, 1, 1}, {1, 0, 0}));
    }
    mbs::Event e;
    e.time = 0.2;
    e.actions.resize(1);
    e.actions[0].kind = kind;
    e.actions[0].index = 0;
    if (kind == Do::RemoveSpring) {
      mbs::SpringDamper s;
      s.a = {0};
      s.b = {1};
      s.free_length = 1;
      s.spring.rate = 100;
      m.springs.push_back(s);
    } else if (kind == Do::RemoveBushing) {
      mbs::Bushing s;
      s.a = {0};
      s.b = {1};
      s.X_BM.p = {-1, 0, 0};
      s.spring[0].rate = 100;
      m.bushings.push_back(s);
    } else if (kind == Do::ReleaseCable) {
      mbs::Cable s;
      s.a = {0};
      s.b = {1};
      s.stiffness = 100;
      m.cables.push_back(s);
      e.actions[0].cable = 0;
    } else if (kind == Do::RemoveElement) {
      mbs::ZoneElement s;
      s.a = {0};
      s.b = {1};
      s.X_BM.p = {-1, 0, 0};
      s.translational_stiffness = {100, 100, 100};
      s.rotational_stiffness = {100, 100, 100};
      s.damping_ratio = 0;
      e.actions[0].element = mbs::add_element(m, s);
    } else {
      m.bodies[0].w_WB = {0, 0, 1};
      mbs::add_joint(m, test::make_joint(m, Kind::Revolute, mbs::kGround, {0}, {}));
      mbs::RotationalSpring s;
      s.joint = {0};
      s.spring.rate = 100;
      m.rotational_springs.push_back(s);
      e.actions[0].joint = {0};
    }
    m.events.push_back(e);
    const auto c = test::run(*make_engine(GetParam()), m, test::make_options(0.4, 1e-3, 1e-4));
    const mbs::Energy& last = c.frames.back().energy;
    const double exact = kind == Do::ReleaseJoint ? bar : masses;
    // a step before it was 0.27 mJ or more off
    EXPECT_NEAR(last.removed + last.plastic, exact, 1e-5 * exact) << "action " << static_cast<int>(kind);
    EXPECT_LT(c.summary.energy_error, 1e-5) << "action " << static_cast<int>(kind);
  }
}

TEST_P(EnginesAlikeReference, ALoadThatWasRemovedIsAppliedAgain) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, 0});
  mbs::add_body(m, test::make_body("b", 2, {1, 1, 1}, {0, 0, 0}));
  mbs::Load l;
  l.body = {0};
  l.force = {10, 0, 0};
  m.loads.push_back(l);
  using Do = mbs::Action::Kind;
  const std::pair<double, Do> actions[] = {{0.1, Do::ApplyLoad}, {0.5, Do::RemoveLoad}, {0.7, Do::ApplyLoad}};
  for (const auto& [time, kind] : actions) {
    mbs::Event e;
    e.time = time;
    e.actions.resize(1);
    e.actions[0].kind = kind;
    e.actions[0].index = 0;
    m.events.push_back(e);
  }
  const auto c = test::run(*make_engine(GetParam()), m, test::make_options(1, 1e-2, 1e-3));
  EXPECT_NEAR(c.frames.back().v_WB[0].x, 3.5, 1e-6) << "5 m/s² for 0.4 and 0.3 s";
}

TEST_P(EnginesAlikeReference, WithoutAStepTheyFollowWhatEventsLeave) {
  NEEDS_ENGINE();
  // 1 kg in place of 100 on 10 kN/m: the step of the start is ten times too long then
  mbs::Model m = test::make_empty({0, 0, 0});
  mbs::add_body(m, test::make_body("mass", 100, {1, 1, 1}, {1, 0, 0}));
  m.bodies[0].v_WB = {0.1, 0, 0};
  mbs::SpringDamper s;
  s.a = mbs::kGround;
  s.b = {0};
  s.free_length = 1;
  s.spring.rate = 1e4;
  m.springs.push_back(s);
  mbs::Event shrink;
  shrink.time = 0.5;
  shrink.actions.emplace_back();
  shrink.actions[0].kind = mbs::Action::Kind::ReplaceBody;
  shrink.actions[0].body = {0};
  shrink.actions[0].replacement = test::make_body("mass", 1, {1, 1, 1}, {0, 0, 0});
  m.events = {shrink};
  std::vector<std::unique_ptr<Engine>> list;
  list.push_back(make_engine("native"));
  list.push_back(make_engine(GetParam(), {1e-9}));
  mbs::Options o = test::make_options(1, 0.05, 0);
  o.equilibrium = false;
  o.step_safety = 0.05;
  const Comparison c = compare(m, o, list);
  EXPECT_LE(c.step, 1.05 * 2 * 0.05 / 100);
  EXPECT_LT(c.runs[1].position.value, 2e-3);  // of a swing of 10 mm
}

TEST_P(EnginesAlikeReference, ADoorOnMoreThanItNeeds) {
  NEEDS_ENGINE();
  // a hinge on z, and on its line another joint; or the first on a ball that the door hangs on
  for (const Kind second : {Kind::Revolute, Kind::Cylindrical, Kind::Spherical, Kind::Distance})
    for (const bool is_first : {true, false})
      for (const bool is_free : {false, true}) {
        if (is_first && second == Kind::Distance) continue;  // closes loops only
        mbs::Model m = test::make_empty({0.5, -2, -9.81});
        mbs::BodyId frame = mbs::kGround;
        if (is_free) frame = mbs::add_body(m, test::make_body("frame", 20, {2, 3, 1}, {-0.3, 0, 1}));
        const auto door = mbs::add_body(m, test::make_body("door", 10, {3.4, 4.2, 0.85}, {0.5, 0, 1}));
        m.bodies.back().w_WB = {0, 0, 3};
        m.bodies.back().v_WB = {0, 1.5, 0};
        const auto hinge = [&] {
          mbs::add_joint(m, test::make_joint(m, Kind::Revolute, frame, door, {{0, 0, 0.2}, {}}));
        };
        if (!is_first) hinge();
        mbs::Joint j = test::make_joint(m, second, frame, door, {{0, 0, 1.8}, {}});
        if (second == Kind::Distance) j.X_CM.p += Vec3{0.2, 0.3, 0};
        mbs::add_joint(m, j);
        if (is_first) hinge();
        const std::string what = std::to_string(static_cast<int>(second)) + (is_first ? " first" : " second") +
                                 (is_free ? " of a free frame" : "");
        const EngineRun r = compare_with_native(m, 0.5);
        EXPECT_LT(r.position.value, 2e-7) << what;
        EXPECT_LT(r.orientation.value, 2e-7) << what;
        EXPECT_LT(r.summary.joint_drift, 1e-7) << what;
        // who bears what is the engine's own; in all they bear the same
        const auto own = test::run(*make_engine(GetParam(), {1e-9}), m, test::make_options(0.5, 0.05, kStep));
        const auto native = test::run(*make_engine("native"), m, test::make_options(0.5, 0.05, kStep));
        ASSERT_EQ(own.frames.size(), native.frames.size()) << what;
        for (size_t i = 1; i < own.frames.size() && second != Kind::Distance; ++i) {
          const auto sum = [](const mbs::View& v) {
            Vec3 f;
            for (const Vec3& x : v.joint_force) f += x;
            return f;
          };
          EXPECT_LT(norm(sum(own.frames[i]) - sum(native.frames[i])), 0.05) << what;  // N, of 140 N
        }
      }
}

TEST_P(EnginesAlikeReference, ADoorsSecondHingeHoldsItWhenTheFirstIsReleased) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, -2, -9.81});
  const auto door = mbs::add_body(m, test::make_body("door", 10, {3.4, 4.2, 0.85}, {0.5, 0, 1}));
  mbs::add_joint(m, test::make_joint(m, Kind::Revolute, mbs::kGround, door, {{0, 0, 0.2}, {}}));
  mbs::add_joint(m, test::make_joint(m, Kind::Spherical, mbs::kGround, door, {{0, 0, 1.8}, {}}));
  mbs::Event e;
  e.time = 0.2;
  e.actions.resize(1);
  e.actions[0].kind = mbs::Action::Kind::ReleaseJoint;
  e.actions[0].joint = {0};
  m.events.push_back(e);
  const EngineRun r = compare_with_native(m, 0.7);
  EXPECT_LT(r.position.value, 5e-4);  // the native engine lets an event act from half a step before
  EXPECT_LT(r.summary.joint_drift, 1e-7);
}

TEST_P(EnginesAlikeReference, JointThatIsPulledApart) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  m.joints[0].shear_limit = 20;  // grows from 0.24 N as the bar swings down
  const EngineRun r = compare_with_native(m, 1.5);
  EXPECT_EQ(r.broken, 1);
  EXPECT_LT(r.position.value, 2e-3);  // a step of 0.1 ms under g, and a second of free flight after it
}

TEST_P(EnginesAlikeReference, StandsInTheEquilibrium) {
  NEEDS_ENGINE();
  mbs::Model m = make_hinged_block(100);
  const EngineRun r = compare_with_native(m, 1, kStep, true);
  EXPECT_LT(r.position.value, 1e-9);
}

TEST_P(EnginesAlikeReference, BoxesOfCrushedMembers) {
  NEEDS_ENGINE();
  // a plate on a post, one body, whose element holds the foot half a metre high and is crushed by 0.78 m before it is
  // cut: what is left of the post lands
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto plate = test::add_box(m, "plate", 4000, {1, 1, 0.25}, {0, 0, 2.75});
  mbs::Shape post;
  post.half = {0.15, 0.15, 1};
  post.X_BS.p = {0, 0, -1.25};
  m.bodies[0].shapes.push_back(post);
  m.bodies[0].v_WB = {0, 0, -8};
  m.contact.ground = true;
  m.contact.restitution = 0.1;
  mbs::ZoneLaw law;
  law.compression = {{0, 0.78, 0.8, 10}, {2e5, 2e5, 1e9, 1e9}};
  law.crush_length = 0.3;
  const mbs::LawId id = mbs::add_law(m, law);
  mbs::ZoneElement e;
  e.a = mbs::kGround;
  e.b = plate;
  const Quat up = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
  e.X_AF = {{0, 0, 1.5}, up};
  e.X_BM = {{0, 0, -1.25}, up};
  e.translational_stiffness = {1e8, 1e8, 1e8};
  e.rotational_stiffness = {1e7, 1e7, 1e7};
  e.stations = {{-1, id}, {1, id}};
  e.crush_through = 1.9;
  mbs::add_element(m, e);
  mbs::Event cut;
  cut.time = 0.4;
  mbs::Action a;
  a.kind = mbs::Action::Kind::RemoveElement;
  a.element = {0};
  cut.actions = {a};
  m.events.push_back(cut);
  const mbs::Options o = test::make_options(1.2, 0.4, kStep);
  for (const std::string& engine : {std::string("native"), GetParam()}) {
    const auto c = test::run(*make_engine(engine), m, o);
    ASSERT_EQ(c.frames.size(), 4U) << engine << c.summary.message;
    EXPECT_NEAR(c.frames[1].X_WB[0].p.z, 2.75 - 0.78, 0.02) << engine;
    EXPECT_NEAR(c.frames[3].X_WB[0].p.z, 2.25 - 0.78, 0.07) << engine;  // others shorten boxes by 5 cm at once
    const auto& notes = c.summary.notes;
    EXPECT_EQ(std::any_of(notes.begin(), notes.end(),
                          [](const std::string& n) { return n.find("rigid ends") != std::string::npos; }),
              engine != "native");
  }
}

TEST_P(EnginesAlikeReference, RestWaitsForLawsThatStillGoOver) {
  NEEDS_ENGINE();
  // a bar that a law holds which goes over to a twentieth of it within 2 s, at a time or by a limit
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto a = add_brick(m, "a", {0, 0, 0});
  for (const double bears : {1e3, 50.0}) {
    mbs::ZoneLaw law;
    law.compression = {{0, 0.1}, {bears, bears}};
    law.tension = law.compression;
    mbs::add_law(m, law);
  }
  mbs::ZoneElement e;
  e.a = mbs::kGround, e.b = a;
  e.X_AF.q = e.X_BM.q = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
  e.translational_stiffness = {1e6, 1e6, 1e6};
  e.rotational_stiffness = {1e5, 1e5, 1e5};
  e.stations = {{0, {0}}};
  mbs::add_element(m, e);
  mbs::Action weaken;
  weaken.kind = mbs::Action::Kind::SwitchLaw;
  weaken.element = {0}, weaken.law = {1}, weaken.ramp = 2;
  mbs::Event event;
  event.time = 0.1, event.actions = {weaken};
  mbs::Options o = test::make_options(2.3, 2.3, 1e-3);
  o.equilibrium = true, o.rest_speed = 1e-3, o.rest_time = 0.3;
  for (const bool is_triggered : {false, true}) {
    if (is_triggered) event.triggers = {{{mbs::Quantity::Kind::Position, 0}, 2, -1, true}};
    m.events = {event};
    const auto c = test::run(*make_engine(GetParam()), m, o);
    EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
    EXPECT_LT(c.frames.back().X_WB[0].p.z, -0.02);
  }
}

TEST_P(EnginesAlikeReference, RestWaitsForLoadsToCome) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({});
  const auto a = add_brick(m, "a", {0, 0, 0});
  mbs::Load l;
  l.body = a;
  l.force = {10, 0, 0};
  l.time = {0, 2, 2.5}, l.factor = {0, 0, 1};
  m.loads = {l};
  mbs::Options o = test::make_options(4, 4, 1e-3);
  o.rest_speed = 1e-3;
  const auto c = test::run(*make_engine(GetParam()), m, o);
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
  // 1 m/s² within half a second, then on for 1.5 s
  EXPECT_NEAR(c.frames.back().v_WB[0].x, 0.25 + 1.5, 1e-6);
}

TEST_P(EnginesAlikeReference, RestBeginsAnewAfterAnEventByALimit) {
  NEEDS_ENGINE();
  // it drifts below the rest speed to a limit; what happens there resets the time
  mbs::Model m = test::make_empty({});
  const auto a = add_brick(m, "a", {0, 0, 0});
  m.bodies[0].v_WB = {0.01, 0, 0};
  mbs::Event event;
  event.triggers = {{{mbs::Quantity::Kind::Position, a.index}, 0, 0.004, true}};
  m.events = {event};
  mbs::Options o = test::make_options(4, 4, 1e-3);
  o.rest_speed = 0.1, o.rest_time = 0.5;
  for (const std::string& engine : {std::string("native"), GetParam()}) {
    const auto c = test::run(*make_engine(engine), m, o);
    EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::AtRest) << engine;
    EXPECT_NEAR(c.summary.time, 0.4 + 0.5, 0.01) << engine;
  }
}

TEST_P(EnginesAlikeReference, ALoosenedJointGoesOnToTellItsForce) {
  NEEDS_ENGINE();
  // the weight of a bar before and after, and an event waits for it
  mbs::Model m = test::make_bar(Kind::Revolute, test::z_along_y());
  m.damping_frequency = 300;
  mbs::RotationalElement e;
  e.joint = {0};
  e.stiffness = 1e5;
  e.damping_ratio = 0.2;
  e.loose_translational = {1e5, 1e5, 1e5};
  e.loose_torsion = e.loose_bending = 1e5;
  m.rotational_elements.push_back(e);
  mbs::Event loosen;
  loosen.time = 0.1;
  loosen.actions.resize(1);
  loosen.actions[0].kind = mbs::Action::Kind::LoosenJoint;
  loosen.actions[0].joint = {0};
  mbs::Event pressed;
  pressed.name = "pressed";
  pressed.time = 0.4;
  pressed.triggers = {{{mbs::Quantity::Kind::JointForce, 0}, 3, 5, true}};
  mbs::Event free = pressed;
  free.name = "free";
  free.triggers[0].limit = 1, free.triggers[0].rising = false;
  m.events = {loosen, pressed, free};
  mbs::Options o = test::make_options(0.5, 0.5, kStep);
  o.equilibrium = true;
  for (const std::string& engine : {std::string("native"), GetParam()}) {
    const auto c = test::run(*make_engine(engine), m, o);
    std::vector<std::string> fired;
    for (const auto& h : c.happenings)
      if (h.kind == mbs::Happening::Kind::EventFired && h.index > 0) fired.push_back(h.reason);
    EXPECT_EQ(fired, std::vector<std::string>{"pressed"}) << engine;
    EXPECT_NEAR(norm(c.frames.back().joint_force[0]), test::kAdamsGravity, 0.02 * test::kAdamsGravity) << engine;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, EnginesAlikeReference, testing::Values("simbody", "mujoco"),
                         [](const testing::TestParamInfo<std::string>& subject) { return subject.param; });

}  // namespace
}  // namespace topple::engines
