// The engine's order of things: start, events, switches, steps, frames, snapshots, and models it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>

#include "base/error.h"
#include "mbs/contact_law.h"
#include "mbs/model_json.h"
#include "mbs/zone.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::hash_of;
using test::make_box;
using testing::HasSubstr;

constexpr double kGravity = 9.81;

/// Limit of the compression alone, whatever the shortening.
ZoneLaw crushing_at(double force) {
  ZoneLaw law;
  law.compression = {{0, 100}, {force, force}};
  return law;
}

ZoneElement upright_element(const std::string& name, BodyId a, const Vec3& p_AF, BodyId b, const Vec3& p_BM,
                            double stiffness) {
  ZoneElement e;
  e.name = name;
  e.a = a;
  e.b = b;
  e.X_AF = {p_AF, test::upright()};
  e.X_BM = {p_BM, test::upright()};
  e.translational_stiffness = {stiffness, stiffness, stiffness};
  e.rotational_stiffness = {0.1 * stiffness, 0.1 * stiffness, 0.1 * stiffness};
  return e;
}

Action switch_law(ElementId element, LawId law, double ramp, double share = 1) {
  Action a;
  a.kind = Action::Kind::SwitchLaw;
  a.element = element;
  a.law = law;
  a.ramp = ramp;
  a.stiffness_share = share;
  return a;
}

Action remove_element(ElementId element) {
  Action a;
  a.kind = Action::Kind::RemoveElement;
  a.element = element;
  return a;
}

/// A block of 20 t on a piece of column of 1 t on the ground, each on a zone that crushes far above the weight.
struct Column {
  Model model;
  LawId strong;
  ElementId foot, top;
};
Column make_column() {
  Column c;
  c.model.contact.ground = c.model.contact.bodies = false;
  c.strong = add_law(c.model, crushing_at(1e7));
  const BodyId piece = add_body(c.model, make_box("piece", 1000, {0.25, 0.25, 0.5}, {0, 0, 0.5}));
  const BodyId block = add_body(c.model, make_box("block", 20e3, {1, 1, 1}, {0, 0, 2}));
  c.foot = add_element(c.model, upright_element("foot", kGround, {}, piece, {0, 0, -0.5}, 8e8));
  c.top = add_element(c.model, upright_element("top", piece, {0, 0, 0.5}, block, {0, 0, -1}, 8e8));
  for (ZoneElement& e : c.model.elements) e.stations = {{0, c.strong}};
  return c;
}

std::string complaint_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) { return e.what(); }
  return "no complaint";
}

// ------------------------------------------------------------------------------------------------------------- charges

class LighterBodyPhysics : public testing::TestWithParam<double> {};

TEST_P(LighterBodyPhysics, KeepsTheAutomaticStepStable) {
  // the charge leaves 2 % of the piece; thrown out when the ramp is over, or earlier, when the zone above it is still
  // as stiff as ever
  const double firing = 0.05, ramp = 0.02, thrown_out = firing + GetParam() * ramp, share = 0.05, left = 20;
  Column c = make_column();
  for (ZoneElement& e : c.model.elements) {
    // the fastest mode is along the column, and most of its stiffness is that of the zone that fires
    const double k = &e == &c.model.elements[0] ? 8e8 : 24e8;
    e.translational_stiffness = {k, 1e-2 * k, 1e-2 * k};
    e.rotational_stiffness = {1e-3 * k, 1e-3 * k, 1e-3 * k};
  }
  const LawId weak = add_law(c.model, crushing_at(2e4));
  Event charge;
  charge.time = firing;
  charge.actions = {switch_law(c.top, weak, ramp, share)};
  Event lighter;
  lighter.time = thrown_out;
  Action a;
  a.kind = Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = make_box("piece", left, {0.25, 0.25, 0.05}, {0, 0, -0.45});
  a.replacement.inertia = test::box_inertia(left, {0.5, 0.5, 0.5});
  lighter.actions = {a};
  c.model.events = {charge, lighter};
  Options o;
  o.duration = 0.4;
  double fallen = 0;
  o.on_frame = [&](const View& v) { fallen = 2 - v.X_WB[1].p.z; };
  const Summary s = run(c.model, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_GT(fallen, 0.3);  // nearly free, 0.5 g t² from 0.07 s at the latest
  EXPECT_LT(s.energy_error, 0.02);
  // stiffness along the column on what is left of the piece, the block as good as fixed above it; the springs behind
  // the dampers add 4 ζ / (1 - 2 ζ)
  const double fast = 1 + 4 * 0.05 / 0.9, k = 8e8 * (1 + 3 * (GetParam() < 1 ? 1 : share));
  EXPECT_GT(s.highest_frequency, 0.99 * std::sqrt(fast * k / left));
  EXPECT_LT(s.shortest_step * std::sqrt(fast * k / left), 2);
  EXPECT_GT(s.step, 2 * s.shortest_step);  // it follows the model
}

INSTANTIATE_TEST_SUITE_P(AtRampShares, LighterBodyPhysics, testing::Values(0.0, 0.5, 1.0));

TEST(SetStep, LongerThanTheFastestModeBearsEndsTheRun) {
  // a block on a spring: its six modes alone, the fastest along the column
  Column c = make_column();
  c.model.bodies.resize(1);
  c.model.elements.resize(1);
  c.model.elements[0].damping_ratio = 0;
  c.model.elements[0].rotational_stiffness = {1e6, 1e6, 1e6};
  c.model.elements[0].translational_stiffness = {8e8, 1e6, 1e6};
  const double bears = 2 / std::sqrt(8e8 / 1000);  // [s]
  Options o;
  o.duration = 0.1;
  o.step = 0.98 * bears;
  EXPECT_EQ(run(c.model, o).ending, Summary::Ending::TimeLimit);
  o.step = 1.02 * bears;
  const Summary s = run(c.model, o);
  EXPECT_EQ(s.ending, Summary::Ending::Diverged);
  EXPECT_EQ(s.steps, 1);
  EXPECT_THAT(s.message, HasSubstr("the fastest mode has 894.4 rad/s and needs a step below 0.00224 s"));
}

TEST(SetStep, WhatAJointHoldsIsNoMode) {
  // the same spring between bodies that a joint holds together: one block on the spring below
  Column c = make_column();
  c.model.elements[1].translational_stiffness = {1e12, 1e12, 1e12};
  Options o;
  o.duration = 0.1;
  o.step = 1e-3;
  EXPECT_EQ(run(c.model, o).ending, Summary::Ending::Diverged);
  Joint j;
  j.kind = Joint::Kind::Fixed;
  j.parent = {0};
  j.child = {1};
  j.X_PF.p = {0, 0, 0.5};
  j.X_CM.p = {0, 0, -1};
  add_joint(c.model, j);
  const Summary s = run(c.model, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_EQ(s.step_needed, 0);
}

TEST(SetStep, TooLongForWhatAnEventLeavesIsTold) {
  // the piece becomes so light that its springs swing faster than the step bears
  Column c = make_column();
  for (ZoneElement& e : c.model.elements) {
    e.damping_ratio = 0;
    e.translational_stiffness = {8e8, 1e6, 1e6};
    e.rotational_stiffness = {1e6, 1e6, 1e6};
  }
  Event lighter;
  lighter.time = 0.01;
  Action a;
  a.kind = Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = make_box("piece", 100, {0.25, 0.25, 0.5}, {0, 0, 0});
  lighter.actions = {a};
  c.model.events = {lighter};
  Options o;
  o.duration = 0.02;
  o.step = 0.6e-3;
  const Summary s = run(c.model, o);
  // thrown about within some steps: the balance is lost
  EXPECT_EQ(s.ending, Summary::Ending::Diverged) << s.message;
  EXPECT_GT(s.energy_error, 1);
  EXPECT_NE(s.message.find("balance of energy"), std::string::npos) << s.message;
  // on both springs along the column, the block nearly at rest
  EXPECT_NEAR(s.step_needed, 2 / std::sqrt(2 * 8e8 / 100 + 8e8 / 20e3), 0.03 * s.step_needed);
  o.step = 0.0;
  EXPECT_EQ(run(c.model, o).step_needed, 0);  // the engine's own step follows
}

TEST(SwitchLaw, ASecondOneBeginsWhereTheFirstEnded) {
  // crushing all along: at half the block's weight from 0.05 s on, then down to a fifth of it within 20 ms
  const double weight = 20e3 * kGravity;
  for (const size_t stations : {1U, 2U}) {
    Column c = make_column();
    const LawId half = add_law(c.model, crushing_at(0.5 * weight)), fifth = add_law(c.model, crushing_at(0.2 * weight));
    ZoneElement& top = c.model.elements[static_cast<size_t>(c.top.index)];
    if (stations == 2) top.stations = {{-0.5, c.strong}, {0.5, c.strong}};
    top.damping_ratio = 0;
    Event first, second;
    first.time = 0.05;
    first.actions = {switch_law(c.top, half, 0)};
    second.time = 0.15;
    second.actions = {switch_law(c.top, fifth, 0.02)};
    c.model.events = {second, first};  // the order of the list does not matter
    Options o;
    o.duration = 0.2;
    o.step = o.frame_interval = 1e-4;
    double most = 0, least = 1e30, midway = 0;
    o.on_frame = [&](const View& v) {
      const double push = std::abs(v.element_force[1].x);
      if (v.time > 0.06 && v.time < 0.149) { EXPECT_NEAR(push, 0.5 * weight, 1e-9 * weight) << v.time; }
      if (v.time > 0.149) most = std::max(most, push), least = std::min(least, push);
      if (std::abs(v.time - 0.16) < 1e-4) midway = push;
    };
    (void)run(c.model, o);
    EXPECT_LT(most, 0.5 * weight * (1 + 1e-9));
    EXPECT_NEAR(midway, 0.35 * weight, 0.01 * weight);  // frames of 0.1 ms on a ramp of 20 ms
    EXPECT_NEAR(least, 0.2 * weight, 1e-9 * weight);
  }
}

/// A rod of 1 kg and 1 m, held at the origin by a hinge about W's y, pointing along +x.
Model make_rod() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body rod;
  rod.name = "rod";
  rod.mass = 1;
  rod.inertia = Mat3::diagonal({1e-3, 1.0 / 12, 1.0 / 12});
  rod.X_WB.p = {0.5, 0, 0};
  const BodyId b = add_body(m, rod);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "hinge";
  j.parent = kGround;
  j.child = b;
  j.X_PF.q = test::upright();
  j.X_CM = {{-0.5, 0, 0}, test::upright()};
  add_joint(m, j);
  return m;
}

TEST(SwitchLaw, ActsOnARotationalElement) {
  const double weight_moment = 0.5 * kGravity, limit = 3;
  Model m = make_rod();
  const LawId strong = add_law(m, test::plastic_hinge(10 * weight_moment));
  const LawId weak = add_law(m, test::plastic_hinge(limit));
  RotationalElement r;
  r.name = "hinge";
  r.joint = {0};
  r.stiffness = 1e4;
  r.damping_ratio = 0;  // a damper would answer the jump of the elastic moment
  r.law = strong;
  m.rotational_elements.push_back(r);
  Options o;
  o.step = 1e-5;
  o.duration = 0.3;
  double rotation = 0, w = 0;
  o.on_frame = [&](const View& v) {
    if (v.time < 0.0999) { EXPECT_EQ(v.rotation[0], 0) << v.time; }
    rotation = v.rotation[0];
    w = v.w_WB[0].y;
  };
  (void)run(m, o);
  EXPECT_EQ(rotation, 0);  // without an event it holds

  Event e;
  e.time = 0.1;
  Action a;
  a.kind = Action::Kind::SwitchLaw;
  a.rotational = 0;
  a.law = weak;
  e.actions = {a};
  m.events = {e};
  (void)run(m, o);
  // constant acceleration (M - limit) / (1/3) for 0.2 s; the lever falls with cos(0.12) by 0.7 % at the end
  const double w0 = 3 * (weight_moment - limit) * 0.2;
  EXPECT_NEAR(w, w0, 0.02 * w0);
  EXPECT_NEAR(rotation, 0.5 * w0 * 0.2, 0.02 * 0.5 * w0 * 0.2);

  const Model back = model_from_json(to_json(m), "rod.json");
  ASSERT_EQ(back.events.size(), 1u);
  EXPECT_EQ(back.events[0].actions[0].rotational, 0);
  EXPECT_FALSE(back.events[0].actions[0].element.is_valid());
}

// --------------------------------------------------------------------------------------------------------------- start

TEST(Start, EventsAtTimeZeroWaitForTheEquilibrium) {
  Column c = make_column();
  Event e;
  e.actions = {remove_element(c.top)};
  c.model.events = {e};
  Options o;
  std::vector<double> fired;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::EventFired) fired.push_back(h.time);
  };
  Simulation s(c.model, o);
  EXPECT_TRUE(fired.empty());
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  EXPECT_TRUE(fired.empty());
  const double rest = s.calc_view().X_WB[1].p.z;
  // shortened by the weight on two zones, the upper of which carries the block alone
  EXPECT_NEAR(rest, 2 - 20e3 * kGravity / 8e8 - 21e3 * kGravity / 8e8, 1e-9);
  while (s.time() < 0.1) ASSERT_TRUE(s.advance_step());
  EXPECT_EQ(fired, std::vector<double>{0});
  EXPECT_NEAR(s.calc_view().X_WB[1].p.z, rest - 0.5 * kGravity * s.time() * s.time(), 1e-6);
}

TEST(StartReplay, RunIsMadeOfTheSameSteps) {
  for (const bool equilibrium : {true, false}) {
    Column c = make_column();
    const LawId weak = add_law(c.model, crushing_at(2e4));
    Event e;
    e.actions = {switch_law(c.top, weak, 0.01, 0.3)};
    c.model.events = {e};
    c.model.contact.ground = c.model.contact.bodies = true;
    Options o;
    o.equilibrium = equilibrium;
    o.duration = 0.3;
    o.frame_interval = 0.01;
    std::vector<std::pair<double, std::uint64_t>> frames;
    o.on_frame = [&](const View& v) { frames.push_back({v.time, hash_of(v)}); };
    (void)run(c.model, o);
    o.on_frame = nullptr;
    Simulation s(c.model, o);
    std::string message;
    if (equilibrium) { ASSERT_TRUE(s.find_equilibrium(message)) << message; }
    ASSERT_GT(frames.size(), 25u);
    for (const auto& [time, hash] : frames) {
      while (s.time() < time) ASSERT_TRUE(s.advance_step());
      ASSERT_EQ(s.time(), time);
      ASSERT_EQ(hash_of(s.calc_view()), hash) << "at " << time;
    }
  }
}

TEST(Element, GoesOnToBeMeasuredWhenItIsBroken) {
  Model m;
  m.gravity = {kGravity, 0, 0};
  m.contact.ground = m.contact.bodies = false;
  const BodyId body = add_body(m, make_box("body", 100, {0.5, 0.5, 0.5}, {}));
  ZoneElement e;
  e.name = "thread";
  e.a = kGround, e.b = body;
  e.translational_stiffness = {1e5, 1e5, 1e5};
  e.rotational_stiffness = {1e4, 1e4, 1e4};
  ZoneLaw law;
  law.tension = {{0, 1}, {1, 1}};
  law.rupture_elongation = 1e-3;
  e.stations = {{0, add_law(m, law)}};
  add_element(m, e);
  Options o;
  o.equilibrium = false;
  o.duration = 0.3;
  o.frame_interval = 0.05;
  int broken = 0;
  o.on_frame = [&](const View& v) {
    if (v.element_state[0] != ElementState::Broken) return;
    ++broken;
    EXPECT_NEAR(v.element_translation[0].x, v.X_WB[0].p.x, 1e-12);
    EXPECT_EQ(norm(v.element_force[0]), 0);
  };
  EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  EXPECT_GT(broken, 3);
}

TEST(Start, AnOverloadedBrittleModelNamesItsMostLoadedElement) {
  // a table of 40 t, its mass centre over the left leg: that one has 1.5 times what it can carry, the right one little
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const double weight = 40e3 * kGravity;
  const BodyId table = add_body(m, make_box("table", 40e3, {2, 1, 0.2}, {0, 0, 3}));
  for (const double x : {-0.5, 1.5}) {
    ZoneElement e = upright_element(x < 0 ? "left leg" : "right leg", kGround, {x, 0, 2.8}, table, {x, 0, -0.2}, 1e9);
    e.rotational_stiffness = {1e6, 1e6, 1e6};
    ZoneLaw law = crushing_at(0.5 * weight);  // left carries 3/4, right 1/4
    law.crush_length = 1e-6;
    e.stations = {{0, add_law(m, law)}};
    add_element(m, e);
  }
  Options o;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::NoEquilibrium);
  EXPECT_THAT(s.message, HasSubstr("\"left leg\""));
  EXPECT_THAT(s.message, HasSubstr("150 %"));
}

// -------------------------------------------------------------------------------------------------------------- joints

TEST(RevoluteJoint, LetsGoAtItsRotationLimitWithoutARotationalElement) {
  Model m = make_rod();
  m.joints[0].rotation_limit = 0.3;
  Options o;
  o.equilibrium = false;
  o.step = 1e-4;
  o.duration = 0.5;
  o.frame_interval = 1e-4;
  double released = 0, turned = 0;
  std::string reason;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::JointReleased) released = h.time, reason = h.reason;
  };
  o.on_frame = [&](const View& v) {
    if (released == 0) turned = 2 * std::atan2(std::abs(v.X_WB[0].q.y), v.X_WB[0].q.w);
  };
  (void)run(m, o);
  EXPECT_GT(released, 0);
  EXPECT_EQ(reason, "rotation");
  EXPECT_NEAR(turned, 0.3, 4e-4);  // a step at 3 rad/s
  m.joints[0].rotation_limit = 2.9;
  released = 0;
  (void)run(m, o);
  EXPECT_EQ(released, 0);
}

TEST(Zone, EachStationBreaksAtTheRotationOfItsOwnLaw) {
  // a member in double curvature, both ends yield alike
  const auto walk = [](double first, double second) {
    ZoneLaw laws[2] = {test::plastic_hinge(1e5), test::plastic_hinge(1e5)};
    laws[0].rupture_rotation = first;
    laws[1].rupture_rotation = second;
    const CompiledLaws compiled{compile_law(laws[0]), compile_law(laws[1])};
    const ZoneParameters p = test::make_member(1);
    ZoneState z;
    double broken_at = 0;
    for (int i = 1; i <= 2000 && z.live; ++i) {
      const double u = 0.12 * i / 2000;
      advance_zone(p, compiled, {{0, u, 0, 0, 0, 0}}, 0, 0, z);
      // rotation of a station is the chord's less the elastic end rotation M L / 6 EI
      broken_at = u / test::kMemberLength - 1e5 * test::kMemberLength / (6 * test::kMemberEI);
    }
    EXPECT_EQ(z.reason, z.live ? BreakReason::None : BreakReason::Rotation);
    return z.live ? 0 : broken_at;
  };
  EXPECT_NEAR(walk(kUnlimited, 0.01), 0.01, 1e-4);  // a step is 2e-5
  EXPECT_NEAR(walk(0.01, kUnlimited), 0.01, 1e-4);
  EXPECT_NEAR(walk(0.02, 0.01), 0.01, 1e-4);
  EXPECT_EQ(walk(kUnlimited, kUnlimited), 0);
}

// ------------------------------------------------------------------------------------------------------ contact,
// frames

/// Four slabs of 9 t, dropped onto each other and the ground from gaps of 2 cm.
Model make_stack() {
  Model m;
  for (int i = 0; i < 4; ++i)
    add_body(m, make_box("slab" + std::to_string(i), 9000, {2.5, 2, 0.075}, {0, 0, 0.095 + 0.17 * i}));
  return m;
}

TEST(ContactPhysics, FourSlabsComeToRestOnEachOther) {
  Options o;
  o.equilibrium = false;
  o.duration = 6;
  o.rest_speed = 0.01;
  Energy e;
  double least_loss = 0;
  std::vector<Pose> X;
  o.on_frame = [&](const View& v) {
    e = v.energy;
    X = v.X_WB;
    least_loss = std::min(least_loss, e.contact_loss);
  };
  const Summary s = run(make_stack(), o);
  EXPECT_EQ(s.ending, Summary::Ending::AtRest) << s.message;
  // a resting contact's spring has the mean of the rates of approach and parting (docs/theory/contact.md): four corners
  // of m ω² on the ground, of half of that between two slabs
  const double rate = make_contact_law(0.1, 0).mean * 4 * 9000 * 1500 * 1500;
  double drop = 0, penetration = 4 * 9000 * kGravity / rate;
  for (int i = 0; i < 4; ++i) {
    const Vec3& p = X[static_cast<size_t>(i)].p;
    if (i > 0) penetration += 2 * (4 - i) * 9000 * kGravity / rate;
    EXPECT_NEAR(p.z, 0.075 + 0.15 * i - penetration, 1e-8);
    EXPECT_LT(std::hypot(p.x, p.y), 1e-3);
    drop += 0.095 + 0.17 * i - p.z;
  }
  // all of it falls straight down: impacts take the energy, sliding next to nothing
  EXPECT_NEAR(-e.gravity, 9000 * kGravity * drop, 1e-9 * e.released);
  EXPECT_EQ(least_loss, 0);                                                // never gave back more than it took
  EXPECT_NEAR(e.contact_loss + e.contact, -e.gravity, 5e-3 * e.released);  // error of the impacts at this step
  EXPECT_GE(e.friction, 0);
  EXPECT_LT(e.friction, 0.01 * e.released);
  EXPECT_LT(s.energy_error, 5e-3);
}

TEST(Frames, RiseStrictlyInTimeToTheLast) {
  for (const double interval : {1e-5, 1.0 / 60, 0.1}) {
    for (const double rest_speed : {0.0, 0.05}) {
      Options o;
      o.equilibrium = false;
      o.duration = 2;
      o.rest_speed = rest_speed;
      o.rest_time = 0.1;
      o.frame_interval = interval;
      std::vector<double> times;
      o.on_frame = [&](const View& v) { times.push_back(v.time); };
      const Summary s = run(make_stack(), o);
      EXPECT_EQ(s.ending, rest_speed > 0 ? Summary::Ending::AtRest : Summary::Ending::TimeLimit);
      ASSERT_GT(times.size(), 2u);
      EXPECT_EQ(times.front(), 0);
      EXPECT_EQ(std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()), times.end()) << interval;
      if (rest_speed > 0) { EXPECT_EQ(times.back(), s.time); }
      // one frame each interval, or each step where the interval is shorter
      const double spacing = std::max(interval, s.step);
      EXPECT_NEAR(static_cast<double>(times.size()), s.time / spacing + 1, 1.5);
    }
  }
}

// ------------------------------------------------------------------------------------------------------------ refusals

/// Poses and energies of two runs to the last bit. (The bytes of snapshots hold padding, which means nothing.)
void expect_same_state(Simulation& a, Simulation& b) {
  const View &x = a.calc_view(), &y = b.calc_view();
  EXPECT_EQ(x.X_WB, y.X_WB);
  EXPECT_EQ(x.v_WB, y.v_WB);
  EXPECT_EQ(x.w_WB, y.w_WB);
  EXPECT_EQ(x.utilisation, y.utilisation);
  EXPECT_EQ(x.energy.elastic, y.energy.elastic);
  EXPECT_EQ(x.energy.residual, y.energy.residual);
}

TEST(SnapshotReplay, RefusesASnapshotOfOtherMassesAndStaysAsItIs) {
  const Column c = make_column();
  Column heavier = make_column();
  heavier.model.bodies[1].mass *= 1 + 1e-15 * 4;  // a few units in the last place
  ASSERT_NE(heavier.model.bodies[1].mass, c.model.bodies[1].mass);
  Options o;
  o.equilibrium = false;
  o.step = 1e-4;
  Simulation s(c.model, o), twin(c.model, o), other(heavier.model, o);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(s.advance_step());
    ASSERT_TRUE(twin.advance_step());
    ASSERT_TRUE(other.advance_step());
  }
  EXPECT_THROW(s.restore(other.snapshot()), InputError);
  auto bytes = s.snapshot();
  for (const size_t cut : {bytes.size() - 1, bytes.size() / 2, size_t{80}, size_t{8}, size_t{3}}) {
    EXPECT_THROW(s.restore({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut)}), InputError) << cut;
  }
  bytes.push_back(std::byte{0});
  EXPECT_THROW(s.restore(bytes), InputError);
  expect_same_state(s, twin);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(s.advance_step());
    ASSERT_TRUE(twin.advance_step());
  }
  expect_same_state(s, twin);
}

TEST(SnapshotReplay, RefusesASnapshotOfAnotherStep) {
  const Column c = make_column();
  Options o;
  o.equilibrium = false;
  o.step = 1e-4;
  Simulation a(c.model, o);
  o.step = 0.5e-4;
  Simulation b(c.model, o);
  EXPECT_THROW(b.restore(a.snapshot()), InputError);
}

TEST(CheckModel, RefusesASwitchOfAnElementWithoutStations) {
  Column c = make_column();
  c.model.elements[0].stations.clear();
  Event e;
  e.actions = {switch_law(c.foot, c.strong, 0)};
  c.model.events = {e};
  EXPECT_THAT(complaint_of([&] { check_model(c.model); }), HasSubstr("has no station whose law could change"));
}

TEST(CheckModel, RefusesAMemberWithoutLength) {
  Column c = make_column();
  c.model.elements[0].stations = {{0.5, c.strong}, {0.5, c.strong}};
  EXPECT_THAT(complaint_of([&] { check_model(c.model); }), HasSubstr("is that of the other station"));
}

TEST(CheckModel, RefusesASwitchOfARotationalElementWithoutALaw) {
  Model m = make_rod();
  RotationalElement r;
  r.joint = {0};
  r.stiffness = 1e4;
  m.rotational_elements = {r};
  add_law(m, ZoneLaw{});
  Event e;
  Action a;
  a.kind = Action::Kind::SwitchLaw;
  a.rotational = 0;
  a.law = {0};
  e.actions = {a};
  m.events = {e};
  EXPECT_THAT(complaint_of([&] { check_model(m); }), HasSubstr("has no law that could change"));
}

TEST(CheckModel, RefusesLengthsOfRuptureThatAreZero) {
  for (double ZoneLaw::*length : {&ZoneLaw::rupture_rotation, &ZoneLaw::crush_length, &ZoneLaw::rupture_elongation,
                                  &ZoneLaw::slip_rupture, &ZoneLaw::twist_rupture}) {
    Column c = make_column();
    c.model.laws.edit(0, [length](ZoneLaw& law) { law.*length = 0; });
    EXPECT_THAT(complaint_of([&] { check_model(c.model); }), HasSubstr("rupture must be > 0"));
    c.model.laws.edit(0, [length](ZoneLaw& law) { law.*length = 1e-9; });
    EXPECT_EQ(complaint_of([&] { check_model(c.model); }), "no complaint");
  }
}

TEST(CheckModel, RefusesCrackingOfWhatDoesNotCrack) {
  Model m;
  add_body(m, make_box("b", 1, {0.1, 0.1, 0.1}, {0, 0, 1}));
  ZoneElement e;
  e.a = kGround, e.b = {0};
  e.X_AF.p = {0, 0, 1};
  e.cracking[1] = {{10, 10}, {20, 20}, 1e-6};
  add_element(m, e);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.parent = kGround, j.child = {0};
  j.X_PF.p = {0, 0, 1};
  RotationalElement r;
  r.joint = add_joint(m, j);
  r.stiffness = 1;
  r.cracking = e.cracking[1];
  m.rotational_elements.push_back(r);
  const std::string said = complaint_of([&] { check_model(m); });
  EXPECT_NE(said.find("elements[0].cracking_z"), std::string::npos) << said;
  EXPECT_EQ(said.find("cracking_y"), std::string::npos) << said;
  EXPECT_NE(said.find("rotational_elements[0].cracking"), std::string::npos) << said;
  add_law(m, {});
  m.elements[0].stations = {{0, {0}}};
  m.rotational_elements[0].law = {0};
  EXPECT_NO_THROW(check_model(m));
}

TEST(CheckModel, RefusesAReplacementThatIsTurnedOrFixed) {
  Column c = make_column();
  Action a;
  a.kind = Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = make_box("piece", 500, {0.25, 0.25, 0.25}, {0, 0, -0.25});
  Event e;
  e.actions = {a};
  c.model.events = {e};
  EXPECT_EQ(complaint_of([&] { check_model(c.model); }), "no complaint");
  c.model.events[0].actions[0].replacement.X_WB.q = exp_rotation({0, 0, 0.1});
  EXPECT_THAT(complaint_of([&] { check_model(c.model); }), HasSubstr("axes stay"));
  c.model.events[0].actions[0] = a;
  c.model.events[0].actions[0].replacement.fixed = true;
  EXPECT_THAT(complaint_of([&] { check_model(c.model); }), HasSubstr("fixed"));
}

TEST(CheckModel, RefusesToLoosenAJointThatNothingTakesOverFrom) {
  Model m = make_rod();
  m.events = {test::make_event(0, Action::Kind::LoosenJoint, 0)};
  EXPECT_THAT(complaint_of([&] { check_model(m); }),
              HasSubstr("has no rotational element with loose_translational > 0"));
  RotationalElement r;
  r.joint = {0};
  r.stiffness = 1;
  m.rotational_elements = {r};
  EXPECT_THAT(complaint_of([&] { check_model(m); }),
              HasSubstr("has no rotational element with loose_translational > 0"));
  m.rotational_elements[0].loose_translational = {1, 1, 1};
  EXPECT_EQ(complaint_of([&] { check_model(m); }), "no complaint");
  m.rotational_elements[0].loose_bending = -1;
  EXPECT_THAT(complaint_of([&] { check_model(m); }), HasSubstr("loose_bending"));
}

TEST(CheckModel, RefusesTwoRotationalElementsOnOneJoint) {
  Model m = make_rod();
  RotationalElement r;
  r.joint = {0};
  r.stiffness = 1;
  m.rotational_elements = {r};
  EXPECT_EQ(complaint_of([&] { check_model(m); }), "no complaint");
  m.rotational_elements = {r, r};
  EXPECT_THAT(complaint_of([&] { check_model(m); }), HasSubstr("has rotational element number 0 already"));
}

TEST(CheckModel, RefusesAJointWhoseFramesAreAMicrometreApart) {
  Model m = make_rod();
  m.joints[0].X_CM.p.x += 1e-6;
  EXPECT_THAT(complaint_of([&] { check_model(m); }), HasSubstr("they must meet"));
  m = make_rod();
  m.joints[0].X_CM.q = exp_rotation({1e-6, 0, 0}) * m.joints[0].X_CM.q;
  EXPECT_THAT(complaint_of([&] { check_model(m); }), HasSubstr("they must meet"));
}

TEST(ModelJson, RefusesAnIntegerBeyondEveryRange) {
  const std::string text = to_json(make_column().model);
  for (const char* number : {"18446744073709551615", "9223372036854775808", "-9223372036854775808", "4294967296"}) {
    std::string t = text;
    const std::string from = "\"law\": 0";
    ASSERT_NE(t.find(from), std::string::npos);
    t.replace(t.find(from), from.size(), std::string("\"law\": ") + number);
    const std::string said = complaint_of([&] { (void)model_from_json(t, "m.json"); });
    EXPECT_THAT(said, HasSubstr("out of range")) << number;
    EXPECT_THAT(said, HasSubstr("law")) << number;
  }
}

}  // namespace
}  // namespace topple::mbs
