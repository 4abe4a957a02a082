#include "engines/mujoco.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cases.h"

namespace topple::engines {
namespace {

using test::add_box;
using test::make_ball;
using test::make_options;

TEST(MujocoPhysics, ABallBouncesAsHighAsItsRestitution) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  // from 10 m with e = 0.5: impacts at 1.427843 and 2.855686 s, between them up to 2.5 m
  const auto c = test::run(*make_engine("mujoco"), make_ball(10, 0.5), make_options(2.8, 1e-2, 1e-5));
  ASSERT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
  double highest = 0;
  for (const mbs::View& v : c.frames)
    if (v.time > 1.5) highest = std::max(highest, v.X_WB[0].p.z - 0.1);
  // found 2.29 with steps of 0.1 ms, 0.15 of the contact's time: MuJoCo's damper is explicit
  EXPECT_NEAR(highest, 2.5, 0.025);
  EXPECT_LT(c.summary.energy_error, 2e-3);  // the blow lasts 20 steps
}

TEST(MujocoPhysics, ABoxSlidesDownASlope) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({9.81 * 0.5, 0, -9.81 * std::sqrt(0.75)});  // 30°
  add_box(m, "box", 10, {0.3, 0.3, 0.1}, {0, 0, 0.1});
  m.contact.ground = true;
  m.contact.friction = 0.3;
  const auto c = test::run(*make_engine("mujoco"), m, make_options(1, 0.1, 2e-5));
  ASSERT_EQ(c.frames.size(), 11U) << c.summary.message;
  // g (sin - μ cos) for a second; the corners chatter, with steps of 0.1 ms so much that 1.2 % are lost
  EXPECT_NEAR(c.frames[10].v_WB[0].x, 2.356287237, 0.005 * 2.356);
}

TEST(MujocoPhysics, HullsAndBoxesComeToRestAlike) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({0, 0, -9.81});
  m.contact.ground = m.contact.bodies = true;
  add_box(m, "box", 10, {0.5, 0.5, 0.5}, {0, 0, 0.55});
  add_box(m, "hull", 10, {0.5, 0.5, 0.5}, {3, 0, 0.55});
  add_box(m, "on it", 5, {0.3, 0.3, 0.3}, {0, 0, 1.4});
  mbs::Shape& hull = m.bodies[1].shapes[0];
  hull.kind = mbs::Shape::Kind::Hull;
  for (int i = 0; i < 8; ++i) hull.vertices.push_back({i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5});
  const auto c = test::run(*make_engine("mujoco"), m, make_options(1, 1, 1e-4));
  ASSERT_EQ(c.frames.size(), 2U) << c.summary.message;
  const mbs::View& v = c.frames[1];
  // it sinks by g/ω² at most, 4e-6 m, and MuJoCo's widths
  EXPECT_NEAR(v.X_WB[0].p.z, 0.5, 1e-4);
  EXPECT_NEAR(v.X_WB[1].p.z, 0.5, 1e-4);
  EXPECT_NEAR(v.X_WB[2].p.z, 1.3, 2e-4);
  EXPECT_NEAR(v.contact_force_ground.z, 25 * 9.81, 1e-3 * 25 * 9.81);
  EXPECT_GE(v.body_contacts, 4);
}

TEST(MujocoPhysics, WhatTouchesFollowsWhatBreaks) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  // a slab lies on an element through a post; cut, it falls on the post, which then carries it by contact
  mbs::Model m = test::make_empty({0, 0, -9.81});
  m.contact.ground = m.contact.bodies = true;
  const auto post = add_box(m, "post", 100, {0.2, 0.2, 0.5}, {0, 0, 0.5});
  const auto slab = add_box(m, "slab", 50, {1, 1, 0.1}, {0, 0, 1.15});
  mbs::ZoneElement e;
  e.a = post;
  e.b = slab;
  e.X_AF.p = {0, 0, 0.5};
  e.X_BM.p = {0, 0, -0.15};
  e.translational_stiffness = {1e6, 1e6, 1e6};
  e.rotational_stiffness = {1e5, 1e5, 1e5};
  mbs::add_element(m, e);
  mbs::Event cut;
  cut.time = 0.3;
  mbs::Action a;
  a.kind = mbs::Action::Kind::RemoveElement;
  a.element = {0};
  cut.actions = {a};
  m.events.push_back(cut);
  const auto c = test::run(*make_engine("mujoco"), m, make_options(1.5, 0.25, 1e-4));
  ASSERT_EQ(c.frames.size(), 7U) << c.summary.message;
  EXPECT_EQ(c.frames[1].body_contacts, 0) << "held by the element";
  EXPECT_NEAR(c.frames[1].X_WB[1].p.z, 1.15, 1e-3);
  EXPECT_GE(c.frames[6].body_contacts, 3);
  EXPECT_NEAR(c.frames[6].X_WB[1].p.z, 1.1, 1e-3);
}

TEST(MujocoPhysics, WhatBreaksElsewhereDoesNotMakeRestingBodiesSink) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({0, 0, -9.81});
  m.contact.ground = m.contact.bodies = true;
  add_box(m, "lower", 10, {0.5, 0.5, 0.5}, {0, 0, 0.5});
  add_box(m, "upper", 10, {0.4, 0.4, 0.5}, {0, 0, 1.5});
  const auto far = add_box(m, "far", 10, {0.5, 0.5, 0.5}, {5, 0, 3});
  for (int i = 0; i < 40; ++i) {
    mbs::ZoneElement e;
    e.a = mbs::kGround;
    e.b = far;
    e.X_AF.p = {5, 0, 3};
    e.translational_stiffness = {1e5, 1e5, 1e5};
    mbs::Event cut;
    cut.time = 0.3 + 0.01 * i;
    mbs::Action a;
    a.kind = i % 2 ? mbs::Action::Kind::ReplaceBody : mbs::Action::Kind::RemoveElement;
    a.element = mbs::add_element(m, e);
    a.body = far;
    a.replacement = m.bodies[2];
    a.replacement.X_WB = {};
    cut.actions = {a};
    m.events.push_back(cut);
  }
  const auto c = test::run(*make_engine("mujoco"), m, make_options(0.8, 0.1, 1e-4));
  ASSERT_EQ(c.frames.size(), 9U) << c.summary.message;
  EXPECT_NEAR(c.frames[8].X_WB[0].p.z, c.frames[2].X_WB[0].p.z, 2e-6);
  EXPECT_NEAR(c.frames[8].X_WB[1].p.z, c.frames[2].X_WB[1].p.z, 2e-6);
}

TEST(MujocoPhysics, OverlapOfWhatIsLetGoIsForgiven) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({});
  m.contact.bodies = true;
  const auto a = add_box(m, "a", 10, {0.5, 0.5, 0.5}, {0, 0, 0}), b = add_box(m, "b", 10, {0.5, 0.5, 0.5}, {0.9, 0, 0});
  mbs::ZoneElement e;
  e.a = a;
  e.b = b;
  e.X_AF.p = {0.45, 0, 0};
  e.X_BM.p = {-0.45, 0, 0};
  e.translational_stiffness = {1e6, 1e6, 1e6};
  mbs::add_element(m, e);
  mbs::Event cut;
  cut.time = 0.1;
  mbs::Action remove;
  remove.kind = mbs::Action::Kind::RemoveElement;
  remove.element = {0};
  cut.actions = {remove};
  m.events.push_back(cut);
  const auto c = test::run(*make_engine("mujoco"), m, make_options(0.5, 0.1, 1e-4));
  ASSERT_EQ(c.frames.size(), 6U) << c.summary.message;
  EXPECT_NEAR(c.frames[5].X_WB[1].p.x - c.frames[5].X_WB[0].p.x, 0.9, 1e-9);
}

TEST(Mujoco, BadNumbersEndTheRunInsteadOfResettingIt) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({});
  mbs::add_body(m, test::make_body("mass", 1, {1, 1, 1}, {0, 0, 1}));
  mbs::SpringDamper s;
  s.a = mbs::kGround;
  s.b = {0};
  s.free_length = 0.9;
  s.spring.rate = 1e8;  // ω h = 10: unstable with this step
  m.springs.push_back(s);
  const auto c = test::run(*make_engine("mujoco"), m, make_options(1, 0.1, 1e-3));
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::Diverged);
  EXPECT_LT(c.summary.time, 1);
  EXPECT_NE(c.summary.message.find("MuJoCo found"), std::string::npos) << c.summary.message;
  for (const mbs::View& v : c.frames) EXPECT_TRUE(is_finite(v.X_WB[0].p));
}

TEST(Mujoco, ErrorsOfTheLibraryEndTheRunInsteadOfTheProgram) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::Body b = test::make_body("moon", 1, {1, 1, 1}, {});
  b.shapes.resize(1);
  b.shapes[0].kind = mbs::Shape::Kind::Hull;
  b.shapes[0].vertices = {{0, 0, 0}, {1e40, 0, 0}, {0, 1e40, 0}, {0, 0, 1e40}};  // beyond its single precision
  mbs::add_body(m, b);
  const mbs::Summary s = make_engine("mujoco")->run(m, make_options(0.1, 0.1, 1e-3));
  EXPECT_EQ(s.ending, mbs::Summary::Ending::Diverged);
  EXPECT_NE(s.message.find("MuJoCo does not take the model"), std::string::npos) << s.message;
}

TEST(Mujoco, ARunThatGainsEnergyFails) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  // boxes flush on others of the same faces: its contact throws them off
  mbs::Model m = test::make_empty({0, 0, -9.81});
  m.contact.ground = m.contact.bodies = true;
  for (int i = 0; i < 8; ++i) add_box(m, "box" + std::to_string(i), 100, {0.1, 0.1, 0.1}, {0, 0, 0.1 + 0.2 * i});
  const auto c = test::run(*make_engine("mujoco"), m, make_options(0.5, 0.1, 2e-4));
  ASSERT_GT(c.summary.energy_error, 1) << "the case is another one";
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::Diverged);
  EXPECT_NE(c.summary.message.find("the balance of energy lacks"), std::string::npos) << c.summary.message;
}

}  // namespace
}  // namespace topple::engines
