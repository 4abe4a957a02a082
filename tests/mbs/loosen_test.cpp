// Joints that go over to their rotational elements. g = 9.81.
#include <gtest/gtest.h>

#include <cmath>

#include "mbs/batch.h"
#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::hash_of;
using test::make_box;
using test::make_event;

constexpr double kStubMass = 20, kBlockMass = 4000, kFall = 1, kStub = 0.5;  // [kg, kg, m, m]
constexpr double kBears = 2e5;  // the stub, whatever it is shortened by [N]

/// A block on top of a short stub, joined by a revolute joint with a rotational element, falling from `kFall` on flat
/// ground; the joint is loosened on the way.
Model make_falling_block(double crush_length = kUnlimited) {
  Model m;
  m.contact.restitution = 0;
  add_body(m, make_box("stub", kStubMass, {0.2, 0.2, kStub / 2}, {0, 0, kFall + kStub / 2}));
  add_body(m, make_box("block", kBlockMass, {1, 1, 0.5}, {0, 0, kFall + kStub + 0.5}));
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "top";
  j.parent = {0};
  j.child = {1};
  j.X_PF = {{0, 0, kStub / 2}, test::upright()};
  j.X_CM = {{0, 0, -0.5}, test::upright()};
  RotationalElement r;
  r.name = "top";
  r.joint = add_joint(m, j);
  r.stiffness = 1e7;
  r.damping_ratio = 0;
  r.loose_translational = {1e8, 1e8, 1e8};
  r.loose_torsion = r.loose_bending = 1e7;
  ZoneLaw law;
  law.compression = {{0, 10}, {kBears, kBears}};
  law.crush_length = crush_length;
  r.law = add_law(m, law);
  m.rotational_elements.push_back(r);
  m.events.push_back(make_event(0.05, Action::Kind::LoosenJoint, 0, "loosen"));
  return m;
}

Options options_of(double duration, double step) {
  Options o;
  o.duration = duration;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = 1e-3;
  return o;
}

TEST(LoosenJointPhysics, ABlockCrushesTheStubThatItFallsOn) {
  // its fall and the way of crushing are the work of the stub: m g (h + s) = F s
  const double s = kBlockMass * 9.81 * kFall / (kBears - kBlockMass * 9.81);
  for (const double step : {2e-4, 1e-4}) {
    double least = 1e9, released = 0, force = 0;
    Options o = options_of(0.75, step);
    o.on_frame = [&](const View& v) {
      least = std::min(least, v.X_WB[1].p.z - v.X_WB[0].p.z - 0.5 - kStub / 2);
      released += v.joint_released[0];
      force = std::max(force, v.joint_force[0].x);
    };
    const Summary sum = run(make_falling_block(), o);
    // the spring of the zone, 2 mm, takes a part of the way
    EXPECT_NEAR(-least, s, 0.01 * s) << step;
    EXPECT_EQ(released, 0);  // it goes on to hold
    EXPECT_NEAR(force, kBears, 0.02 * kBears);
    EXPECT_LT(sum.energy_error, 1e-3);
  }
}

TEST(LoosenJointPhysics, WhatIsCrushedThroughComesApart) {
  Options o = options_of(0.75, 1e-4);
  std::vector<std::string> told;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::ElementBroken) told.push_back("element " + std::to_string(h.index) + " " + h.reason);
    if (h.kind == Happening::Kind::JointReleased) told.push_back("joint");
  };
  bool released = false;
  o.on_frame = [&](const View& v) {
    released = v.joint_released[0];
    if (released) { EXPECT_EQ(norm(v.joint_force[0]), 0); }
  };
  const Summary sum = run(make_falling_block(0.1), o);
  EXPECT_EQ(told, std::vector<std::string>{"element 0 crushing"});
  EXPECT_TRUE(released);
  EXPECT_LT(sum.energy_error, 1e-3);
}

/// A bar that turns about its hinge against a rotational element, without gravity: sin ωt.
Model make_turning_bar(double rate, double stiffness, double& frequency) {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body bar = make_box("bar", 12, {0.5, 0.1, 0.1}, {0.5, 0, 0});
  bar.v_WB = {0, 0.5 * rate, 0}, bar.w_WB = {0, 0, rate};
  frequency = std::sqrt(stiffness / (bar.inertia(2, 2) + 12 * 0.25));
  add_body(m, bar);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.child = {0};
  j.X_CM.p = {-0.5, 0, 0};
  RotationalElement r;
  r.joint = add_joint(m, j);
  r.stiffness = stiffness;
  r.damping_ratio = 0;
  r.loose_translational = {1e6, 1e6, 1e6};
  r.loose_torsion = r.loose_bending = 1e4;
  m.rotational_elements.push_back(r);
  return m;
}

TEST(RotationalElementPhysics, TellsItsRotationAndMomentBeforeAndAfterItsJointIsLoosened) {
  constexpr double rate = 0.4, stiffness = 200;
  double w = 0;
  Model m = make_turning_bar(rate, stiffness, w);
  m.events.push_back(make_event(0.1, Action::Kind::LoosenJoint, 0, "loosen"));
  Options o = options_of(0.3, 2e-4);
  double off = 0, pull = 0;
  o.on_frame = [&](const View& v) {
    const double angle = rate / w * std::sin(w * v.time);
    off = std::max(
        {off, std::abs(v.hinge_rotation[0] - angle) * stiffness, std::abs(v.hinge_moment[0] + stiffness * angle)});
    if (v.time > 0.01) pull = std::max(pull, std::abs(v.hinge_normal[0] + v.joint_force[0].x));
  };
  (void)run(m, o);
  EXPECT_LT(off, 0.01 * stiffness * rate / w);
  EXPECT_LT(pull, 0.01);  // of 1 N: 12 kg at 0.5 m
}

TEST(RotationalElementPhysics, RemovedItLetsItsJointTurnFreely) {
  constexpr double rate = 0.4, stiffness = 200, taken = 0.1003;
  double w = 0;
  const Model still = make_turning_bar(rate, stiffness, w);
  double before = 0;
  for (const double step : {1e-3, 5e-4}) {
    Model m = still;
    Action a;
    a.kind = Action::Kind::RemoveElement;
    a.rotational = 0;
    Event e;
    e.time = taken;
    e.actions = {a};
    m.events = {e};
    Options o = options_of(0.3, step);
    View last;
    o.on_frame = [&](const View& v) { last = v; };
    const Summary sum = run(m, o);
    const double wrong = std::abs(last.w_WB[0].z - rate * std::cos(w * taken));
    if (before > 0) { EXPECT_LT(wrong, 0.3 * before); }  // second order
    before = wrong;
    EXPECT_LT(wrong, 1e-5);
    EXPECT_EQ(last.hinge_moment[0], 0);
    EXPECT_EQ(last.element_state[0], ElementState::Removed);
    EXPECT_FALSE(last.joint_released[0]);
    const double angle = rate / w * std::sin(w * taken);
    EXPECT_NEAR(last.hinge_rotation[0], angle + (last.time - taken) * rate * std::cos(w * taken), 1e-5);
    EXPECT_NEAR(last.energy.removed, 0.5 * stiffness * angle * angle, 1e-4);
    EXPECT_LT(sum.energy_error, 1e-4);
  }
}

TEST(RotationalElementPhysics, StaysAtTheRotationAtWhichItsJointWent) {
  constexpr double rate = 0.4, stiffness = 200;
  double w = 0;
  Model m = make_turning_bar(rate, stiffness, w);
  Event removed = make_event(0.1, Action::Kind::RemoveElement, 0);
  removed.actions[0].element = {}, removed.actions[0].rotational = 0;
  m.events = {removed, make_event(0.2, Action::Kind::ReleaseJoint, 0)};
  Options o = options_of(0.3, 5e-4);
  View last;
  o.on_frame = [&](const View& v) { last = v; };
  (void)run(m, o);
  EXPECT_TRUE(last.joint_released[0]);
  EXPECT_NEAR(last.hinge_rotation[0], rate / w * std::sin(w * 0.1) + 0.1 * rate * std::cos(w * 0.1), 5e-4 * rate);
}

TEST(LoosenJointPhysics, GoesOnBearingWhatTheJointDid) {
  // a box on a post and one that hangs beside it, both at rest: nothing moves when their joints are loosened
  for (const double side : {0.0, 0.3}) {
    Model m;
    m.contact.ground = m.contact.bodies = false;
    add_body(m, make_box("box", 1000, {0.5, 0.5, 0.5}, {side, 0, 1}));
    Joint j;
    j.kind = Joint::Kind::Revolute;
    j.child = {0};
    j.X_PF = {{0, 0, 0.5}, test::upright()};
    j.X_CM = {{-side, 0, -0.5}, test::upright()};
    RotationalElement r;
    r.joint = add_joint(m, j);
    r.stiffness = 1e9;
    r.damping_ratio = 0;
    r.loose_translational = {1e7, 1e7, 1e7};
    r.loose_torsion = r.loose_bending = 1e7;
    m.rotational_elements.push_back(r);
    m.events.push_back(make_event(0.05, Action::Kind::LoosenJoint, 0, "loosen"));
    Options o = options_of(0.3, 1e-4);
    o.equilibrium = true;
    double before = 0, least = 1e9, most = 0, moved = 0;
    Vec3 begun;
    o.on_frame = [&](const View& v) {
      const double force = norm(v.joint_force[0]);
      if (v.time == 0) before = force, begun = v.X_WB[0].p;
      least = std::min(least, force), most = std::max(most, force);
      moved = std::max(moved, norm(v.X_WB[0].p - begun));
    };
    const Summary s = run(m, o);
    EXPECT_NEAR(before, 1000 * 9.81, 1e-3);
    EXPECT_NEAR(least, before, 1e-6 * before) << side;
    EXPECT_NEAR(most, before, 1e-6 * before) << side;
    EXPECT_LT(moved, 1e-8) << side;  // loaded anew, its springs would sag by 1e-3
    EXPECT_LT(s.energy_error, 1e-6);
  }
}

TEST(LoosenJoint, KeepsTheRotationAndWhatItStores) {
  // a rod that swings on an elastic hinge: stiff enough, the element goes on as the joint did
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body rod = make_box("rod", 1, {0.5, 0.02, 0.02}, {0.5, 0, 0});
  rod.shapes.clear();
  add_body(m, rod);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
  j.X_CM.p = {-0.5, 0, 0};
  RotationalElement r;
  r.joint = add_joint(m, j);
  r.stiffness = 30;
  r.loose_translational = {1e7, 1e7, 1e7};
  r.loose_torsion = r.loose_bending = 1e5;
  m.rotational_elements.push_back(r);
  Options o = options_of(0.6, 2e-5);
  o.frame_interval = 0.6;
  Pose joined, loose;
  Energy energy;
  o.on_frame = [&](const View& v) { joined = v.X_WB[0]; };
  (void)run(m, o);
  m.events.push_back(make_event(0.25, Action::Kind::LoosenJoint, 0));
  o.on_frame = [&](const View& v) { loose = v.X_WB[0], energy = v.energy; };
  const Summary s = run(m, o);
  EXPECT_GT(std::abs(joined.p.z), 0.01);
  EXPECT_NEAR(norm(loose.p - joined.p), 0, 2e-5);
  EXPECT_LT(s.energy_error, 1e-4);
  EXPECT_GT(energy.elastic, 0.01);
}

TEST(LoosenJoint, OneThatTurnsFreelyStaysAJoint) {
  Model m = make_falling_block();
  m.laws.edit(0, [](ZoneLaw& law) {
    law.moment_z = test::plastic_hinge(1).moment_z;
    law.rupture_rotation = 1e-9;
  });
  m.bodies[1].w_WB = m.bodies[0].w_WB = {};
  m.bodies[1].w_WB.y = 0.01;  // breaks the hinge before the event
  m.bodies[1].v_WB.x = 0.005;
  Options o = options_of(0.1, 1e-4);
  bool released = true;
  double drift = 0;
  o.on_frame = [&](const View& v) {
    released = v.joint_released[0];
    drift = norm(v.X_WB[0].p + to_matrix(v.X_WB[0].q) * Vec3{0, 0, kStub / 2} - v.X_WB[1].p -
                 to_matrix(v.X_WB[1].q) * Vec3{0, 0, -0.5});
  };
  (void)run(m, o);
  EXPECT_FALSE(released);
  EXPECT_LT(drift, 1e-9);
}

TEST(LoosenJoint, AReleaseAfterwardsEndsTheElement) {
  Model m = make_falling_block();
  m.events.push_back(make_event(0.1, Action::Kind::ReleaseJoint, 0));
  Options o = options_of(0.2, 1e-4);
  bool released = false;
  ElementState state = ElementState::Elastic;
  o.on_frame = [&](const View& v) { released = v.joint_released[0], state = v.element_state[0]; };
  (void)run(m, o);
  EXPECT_TRUE(released);
  EXPECT_EQ(state, ElementState::Removed);
}

TEST(LoosenJointReplay, GoesOnFromASnapshotWithTheSameBits) {
  const Model m = make_falling_block();
  Options o;
  o.equilibrium = false;
  o.step = 1e-4;
  Simulation whole(m, o), other(m, o);
  std::vector<std::vector<std::byte>> kept;
  for (int i = 0; i < 6000; ++i) {
    if (i == 600 || i == 5000) kept.push_back(whole.snapshot());  // loose in flight, and while it is crushed
    ASSERT_TRUE(whole.advance_step());
  }
  const std::uint64_t end = hash_of(whole.calc_view());
  for (size_t k = 0; k < 2; ++k) {
    other.restore(kept[k]);
    for (int i = k == 0 ? 600 : 5000; i < 6000; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(hash_of(other.calc_view()), end) << k;
  }
}

TEST(LoosenJointReplay, InABatchASampleHasTheBitsOfItsRunAlone) {
  // an element between two boxes beside it is cut before, in the middle or never, so that sums are made anew without it
  Model base = make_falling_block();
  const BodyId left = add_body(base, make_box("left", 10, {0.1, 0.1, 0.1}, {5, 0, 3}));
  ZoneElement e;
  e.name = "beside";
  e.a = left;
  e.b = add_body(base, make_box("right", 10, {0.1, 0.1, 0.1}, {6, 0, 3}));
  e.X_AF.p = {0.5, 0, 0}, e.X_BM.p = {-0.5, 0, 0};
  e.translational_stiffness = {1e5, 1e5, 1e5}, e.rotational_stiffness = {1e3, 1e3, 1e3};
  add_element(base, e);
  base.events.push_back(make_event(0.02, Action::Kind::RemoveElement, 0, "cut"));
  std::vector<Variation> variations;
  for (int i = 0; i < 9; ++i)
    variations.push_back([i](Model& m) {
      m.events[0].time = 0.03 + 0.06 * i;
      m.bodies[1].mass *= 1 + 0.01 * i;
      if (i >= 7) m.events[1].time = 0.1 * (i - 4);
    });
  Options o = options_of(0.7, 2e-4);
  o.frame_interval = 0.01;
  std::vector<std::vector<std::uint64_t>> alone(variations.size()), together(variations.size());
  for (size_t i = 0; i < variations.size(); ++i) {
    Model m = base;
    variations[i](m);
    o.on_frame = [&](const View& v) { alone[i].push_back(hash_of(v)); };
    EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  }
  EXPECT_NE(alone[0].back(), alone[1].back());
  BatchOptions b;
  b.run = o;
  b.on_frame = [&](size_t i, const View& v) { together[i].push_back(hash_of(v)); };
  (void)run_batch(base, variations, b);
  EXPECT_EQ(together, alone);
}

TEST(LoosenJoint, TheKernelCrushesIt) {
  System s(make_falling_block(), options_of(0.75, 1e-4), 0);
  s.start();
  long outside = 0, steps = 0;
  while (s.state.time < 0.75) {
    ASSERT_TRUE(s.advance_step());
    ++steps;
    outside += static_cast<long>(s.lanes->outside.size());
  }
  s.unpack_elements();
  EXPECT_GT(s.state.element[s.E].shortened, 0.05);
  EXPECT_LT(outside, steps / 50);
}

}  // namespace
}  // namespace topple::mbs
