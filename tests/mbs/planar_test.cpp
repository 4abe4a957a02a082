// Models whose bodies keep to planes y = const.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "mbs/batch.h"
#include "mbs/model_json.h"
#include "models.h"
#include "views.h"

namespace topple::mbs {
namespace {

using test::look;
using test::make_box;

constexpr double kStep = 1e-3;  // [s]

/// The same model in space and in its plane, for so long.
struct Both {
  std::vector<View> in_space, in_plane;
  double drift_in_plane = 0;
};
Both run_in_both(Model m, double duration) {
  Both out;
  for (const bool is_planar : {false, true}) {
    m.is_planar = is_planar;
    Options o = look(duration, is_planar ? out.in_plane : out.in_space);
    o.step = kStep;
    out.drift_in_plane = run(m, o).joint_drift;
  }
  return out;
}

TEST(PlanarPhysics, NothingLeavesItsPlane) {
  Model m;
  m.is_planar = true;
  m.contact.ground = m.contact.bodies = false;
  const BodyId b = add_body(m, make_box("b", 1000, {1, 0.5, 0.2}, {0, 3, 0}));
  Load l;
  l.name = "across", l.body = b;
  l.p_B = {1, 0.5, 0.2};
  l.force = {500, 2000, 100};
  m.loads.push_back(l);
  std::vector<View> views;
  const Summary s = run(m, look(1, views));
  ASSERT_EQ(s.ending, Summary::Ending::TimeLimit);
  const View& v = views.back();
  EXPECT_EQ(v.X_WB[0].p.y, 3);
  EXPECT_EQ(v.v_WB[0].y, 0);
  // 2000 N at 0.2 m, 500 N at 0.5 m and the like: in space it turns at 5 rad/s
  EXPECT_EQ(v.w_WB[0].x, 0);
  EXPECT_EQ(v.w_WB[0].z, 0);
  EXPECT_NE(v.w_WB[0].y, 0);
  // in its plane it moves as ever: half a t² of the force over the mass
  EXPECT_NEAR(v.X_WB[0].p.x, 0.25, 1e-3) << "the kick and drift of the step";
}

TEST(PlanarPhysics, PlacesAlongTheNormalChangeNothing) {
  // two blocks on feet, one linked to the other by a beam along y; how far their planes are apart is drawing alone
  const auto fall = [](double apart) {
    Model m;
    m.is_planar = true;
    m.contact.ground = m.contact.bodies = false;
    BodyId block[2];
    for (int i = 0; i < 2; ++i) {
      const double y = i * apart;
      block[i] = add_body(m, make_box("b" + std::to_string(i), 5000, {1, 0.5, 1}, {0, y, 3}));
      ZoneElement foot;
      foot.name = "foot" + std::to_string(i);
      foot.a = kGround, foot.b = block[i];
      foot.X_AF.p = {0, y, 2};
      foot.X_BM.p = {0, 0, -1};
      // the second one is softer, so that the link carries shear
      foot.translational_stiffness = (i == 0 ? 1 : 0.2) * Vec3{1e7, 1e7, 1e7};
      foot.rotational_stiffness = {1e7, 1e7, 1e7};
      add_element(m, foot);
    }
    ZoneElement link;
    link.name = "link";
    link.a = block[0], link.b = block[1];
    link.X_AF.p = {0, 2, 0};
    link.X_BM.p = {0, 2 - apart, 0};
    link.translational_stiffness = {2e6, 2e6, 2e6};
    link.rotational_stiffness = {1e6, 1e6, 1e6};
    add_element(m, link);
    std::vector<View> views;
    EXPECT_EQ(run(m, look(5, views, true)).ending, Summary::Ending::TimeLimit);
    return views.back();
  };
  const View near = fall(4), far = fall(40);
  EXPECT_GT(std::abs(near.element_force[2].z), 1000) << "the link carries";
  for (size_t i = 0; i < 3; ++i)
    // round-off of places at 40 m, 1e-14 m, times stiffness over some thousand steps
    EXPECT_LT(norm(far.element_force[i] - near.element_force[i]), 1e-3) << i;
}

TEST(PlanarPhysics, BodiesTurnAboutYAsTheirInertiaSays) {
  const Mat3 inertia{{{0.1, 0.02, 0}, {0.02, 0.2, 0.03}, {0, 0.03, 0.3}}};
  const double quarter = 1.5707963267948966;
  for (const Vec3& turn : {Vec3{0.1, 0, 0}, Vec3{0.5, 0, 0}, Vec3{0, 0, quarter}, Vec3{2, 0, 0}, Vec3{0.3, 1, -0.7}}) {
    Model m;
    m.is_planar = true;
    m.contact.ground = m.contact.bodies = false;
    Body body = make_box("b", 2, {1, 0.5, 0.2}, {0, 1, 5});
    body.inertia = inertia;
    body.X_WB.q = exp_rotation(turn);
    body.w_WB = {0, 2, 0};
    const BodyId b = add_body(m, body);
    Load l;
    l.name = "torque", l.body = b;
    l.torque = {3, 0.5, -2};
    m.loads.push_back(l);
    std::vector<View> views;
    const Summary s = run(m, look(1, views));
    ASSERT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    const Vec3 n = transpose_times(to_matrix(body.X_WB.q), {0, 1, 0});
    const View& v = views.back();
    EXPECT_NEAR(v.w_WB[0].y, 2 + 0.5 * v.time / dot(n, inertia * n), 1e-9) << turn.x;
    EXPECT_LT(std::hypot(v.w_WB[0].x, v.w_WB[0].z), 1e-9) << turn.x;
    EXPECT_LT(norm(transpose_times(to_matrix(v.X_WB[0].q), {0, 1, 0}) - n), 1e-9) << turn.x;
    EXPECT_LT(s.energy_error, 1e-5) << turn.x;
  }
}

TEST(PlanarPhysics, ReplacedBodiesTurnAboutYAsTheirInertiaSays) {
  Model m;
  m.is_planar = true;
  m.contact.ground = m.contact.bodies = false;
  Body body = make_box("b", 2, {1, 0.5, 0.2}, {0, 1, 5});
  body.X_WB.q = exp_rotation({0.5, 0, 0});
  const BodyId b = add_body(m, body);
  Load l;
  l.name = "torque", l.body = b;
  l.torque = {0, 0.5, 0};
  m.loads.push_back(l);
  Action replace;
  replace.kind = Action::Kind::ReplaceBody;
  replace.body = b;
  replace.replacement = make_box("c", 1, {0.3, 0.2, 0.1}, {});
  replace.replacement.inertia = Mat3::diagonal({0.1, 0.2, 0.3});
  Event e;
  e.actions.push_back(replace);
  m.events.push_back(e);
  std::vector<View> views;
  ASSERT_EQ(run(m, look(0.5, views)).ending, Summary::Ending::TimeLimit);
  const double c = std::cos(0.5), s = std::sin(0.5);
  EXPECT_NEAR(views.back().w_WB[0].y, 0.5 * views.back().time / (0.2 * c * c + 0.3 * s * s), 1e-9);
}

TEST(PlanarPhysics, JointsThatRepeatEachOtherShareAsInSpace) {
  // a body on two welds; (7a) of multibody.md weighs turns by a length that the hard turns out of the plane are none of
  const auto moment_of = [](bool is_planar) {
    Model m;
    m.is_planar = is_planar;
    m.contact.ground = m.contact.bodies = false;
    Body body = make_box("b", 2, {1, 0.5, 0.2}, {});
    body.inertia = Mat3::diagonal({0.1, 0.2, 0.3});
    const BodyId b = add_body(m, body);
    for (const double x : {-1.0, 1.0}) {
      Joint j;
      j.kind = Joint::Kind::Fixed;
      j.parent = kGround, j.child = b;
      j.X_PF.p = j.X_CM.p = {x, 0, 0};
      add_joint(m, j);
    }
    Load l;
    l.name = "torque", l.body = b;
    l.torque = {0, 100, 0};
    m.loads.push_back(l);
    std::vector<View> views;
    EXPECT_EQ(run(m, look(0.1, views)).ending, Summary::Ending::TimeLimit);
    return views.back().joint_moment[0].y;
  };
  // ℓ² = 1 + (0.1 + 0.2 + 0.3) / (2 · 2)
  const double length2 = 1.15, by_moments = 0.5 * length2 / (length2 + 1);
  EXPECT_NEAR(moment_of(false), -100 * by_moments, 1e-9);
  EXPECT_NEAR(moment_of(true), -100 * by_moments, 1e-9);
}

TEST(PlanarPhysics, BarsStretchedBetweenTwoHingesStand) {
  for (const int bars : {2, 3, 6}) {
    Model m;
    m.is_planar = true;
    m.contact.ground = m.contact.bodies = false;
    Joint j;
    j.kind = Joint::Kind::Revolute;
    j.X_PF.q = j.X_CM.q = exp_rotation({-1.5707963267948966, 0, 0});  // about y
    j.parent = kGround;
    for (int i = 0; i < bars; ++i) {
      Body bar = make_box("bar", 10, {1, 0.1, 0.1}, {i + 0.5, 0, 0});
      bar.inertia = Mat3::diagonal({0.01, 0.84, 0.84});
      j.child = add_body(m, bar);
      j.X_CM.p = {-0.5, 0, 0};
      add_joint(m, j);
      j.parent = j.child;
      j.X_PF.p = {0.5, 0, 0};
    }
    j.child = kGround;
    j.X_CM.p = {static_cast<double>(bars), 0, 0};
    add_joint(m, j);
    std::vector<View> views;
    Options o = look(1, views);
    o.step = 1e-3;
    const Summary s = run(m, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    for (const View& v : views)
      for (const Pose& X : v.X_WB) EXPECT_LT(std::abs(X.p.z), 2e-5) << bars;
  }
}

TEST(PlanarPhysics, GravityAcrossThePlaneDoesNothing) {
  const auto fall = [](double across, double tilt) {
    Model m;
    m.is_planar = true;
    m.gravity = {1, across, -9.81};
    m.contact.ground = m.contact.bodies = false;
    Body body = make_box("b", 2, {1, 0.5, 0.2}, {0, 3, 0});
    body.X_WB.q = exp_rotation({tilt, 0, 0});
    body.w_WB = {0, 2, 0};
    add_body(m, body);
    std::vector<View> views;
    EXPECT_LT(run(m, look(0.5, views)).energy_error, 1e-9);
    return views;
  };
  for (const double tilt : {0.0, 0.4}) {
    const View with = fall(5, tilt).back(), without = fall(0, tilt).back();
    EXPECT_EQ(with.X_WB[0].p.y, 3);
    EXPECT_EQ(with.X_WB[0].p, without.X_WB[0].p);
    EXPECT_EQ(with.X_WB[0].q, without.X_WB[0].q);
    EXPECT_EQ(with.energy.gravity, without.energy.gravity);
  }
}

TEST(PlanarPhysics, PendulumSwingsAsInSpace) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const BodyId b = add_body(m, make_box("rod", 10, {0.5, 0.05, 0.05}, {0.5, 0, 0}));
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "pin";
  j.parent = kGround, j.child = b;
  j.X_PF.q = j.X_CM.q = test::upright();  // z along W's y
  j.X_CM.p = {-0.5, 0, 0};
  add_joint(m, j);
  const Both both = run_in_both(m, 2);
  const std::vector<View>&in_space = both.in_space, &in_plane = both.in_plane;
  ASSERT_EQ(in_space.size(), in_plane.size());
  // the same equations; only what round-off makes of them differs
  for (size_t i = 0; i < in_space.size(); ++i)
    EXPECT_LT(norm(in_space[i].X_WB[0].p - in_plane[i].X_WB[0].p), 1e-9) << in_space[i].time;
  EXPECT_LT(both.drift_in_plane, 1e-8);
}

TEST(PlanarPhysics, HingedBodiesFlyAsInSpace) {
  // two bars that spin apart about a hinge with offset centres, thrown up
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {0, 0, -9.81};
  for (int i = 0; i < 2; ++i) {
    Body b = make_box(i == 0 ? "left" : "right", 10 + 7 * i, {0.5, 0.05, 0.05}, {i == 0 ? -0.5 : 0.5, 2, 0.1 * i});
    b.w_WB = {0, i == 0 ? 3.0 : -5.0, 0};
    b.v_WB = Vec3{1, 0, 4} + cross(b.w_WB, b.X_WB.p - Vec3{0, 2, 0});
    add_body(m, b);
  }
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "pin";
  j.parent = {0}, j.child = {1};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
  j.X_PF.p = {0.5, 0, 0}, j.X_CM.p = {-0.5, 0, -0.1};
  add_joint(m, j);
  const Both both = run_in_both(m, 1);
  const std::vector<View>&in_space = both.in_space, &in_plane = both.in_plane;
  ASSERT_EQ(in_space.size(), in_plane.size());
  EXPECT_GT(std::abs(in_space.back().joint_angle[0]), 2) << "it turns";
  // iterations end at a gap of 1e-9 of the size; of a step that is a speed, and with 20 kg a force
  const double rate = 1e-9 / kStep;
  for (size_t i = 0; i < in_space.size(); ++i) {
    const View &a = in_space[i], &b = in_plane[i];
    for (size_t k = 0; k < 2; ++k) {
      EXPECT_LT(norm(a.X_WB[k].p - b.X_WB[k].p), 1e-9) << a.time;
      EXPECT_LT(norm(a.w_WB[k] - b.w_WB[k]), rate) << a.time;
    }
    EXPECT_LT(norm(a.joint_force[0] - b.joint_force[0]), 20 * rate / kStep) << a.time;
    EXPECT_NEAR(a.joint_angle[0], b.joint_angle[0], 1e-9) << a.time;
  }
  EXPECT_LT(both.drift_in_plane, 1e-8);
}

TEST(PlanarPhysics, EquilibriumIsThatOfThePlane) {
  // a beam that bends downwards alone: in space and in the plane it is the same
  test::Cantilever c = test::make_cantilever(8, 4, 0.3, 0.3, 30e9, 2500);
  c.model.gravity = {0, 0, -9.81};
  std::vector<View> in_space, in_plane;
  ASSERT_EQ(run(c.model, look(1e-4, in_space, true)).ending, Summary::Ending::TimeLimit);
  c.model.is_planar = true;
  const Summary s = run(c.model, look(1e-4, in_plane, true));
  ASSERT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  const size_t tip = static_cast<size_t>(c.tip.index);
  EXPECT_LT(in_space.front().X_WB[tip].p.z, -1e-3) << "it does bend";
  EXPECT_NEAR(in_plane.front().X_WB[tip].p.z, in_space.front().X_WB[tip].p.z, 1e-9);
}

TEST(PlanarReplay, ABatchRubsOnTheGroundAsItsSamplesDo) {
  // two blocks slide side by side; what pulls one to the other acts across their planes and is nothing to friction
  Model m;
  m.is_planar = true;
  m.contact.ground = true, m.contact.bodies = false;
  BodyId block[2];
  for (int i = 0; i < 2; ++i) {
    Body b = make_box("b" + std::to_string(i), 1000, {1, 0.5, 0.2}, {0, 4.0 * i, 0.21});
    b.v_WB = {2.0 + i, 0, 0};
    block[i] = add_body(m, b);
  }
  ZoneElement link;
  link.name = "link";
  link.a = block[0], link.b = block[1];
  link.X_AF.p = {0, 2, 0.1};
  link.X_BM.p = {0, -2.01, 0.1};
  link.translational_stiffness = {2e5, 2e5, 2e5};
  link.rotational_stiffness = {1e4, 1e4, 1e4};
  add_element(m, link);
  std::vector<View> alone;
  ASSERT_EQ(run(m, look(0.5, alone)).ending, Summary::Ending::TimeLimit);
  EXPECT_GT(norm(alone.back().element_force[0]), 500) << "the link pulls";
  EXPECT_LT(alone.back().v_WB[0].x, 1.5) << "friction slows the blocks";
  BatchOptions o;
  std::vector<View> unused, together;
  o.run = look(0.5, unused);
  o.on_frame = [&](size_t sample, const View& v) {
    if (sample == 0) together.push_back(v);
  };
  (void)run_batch(m, {nullptr, nullptr, nullptr}, o);
  ASSERT_EQ(alone.size(), together.size());
  for (size_t f = 0; f < alone.size(); ++f)
    for (size_t b = 0; b < 2; ++b) {
      ASSERT_EQ(alone[f].X_WB[b].p, together[f].X_WB[b].p) << alone[f].time;
      ASSERT_EQ(alone[f].v_WB[b], together[f].v_WB[b]) << alone[f].time;
    }
}

TEST(Planar, RefusesAJointBesideThePlaneOfItsBody) {
  Model m;
  m.is_planar = true;
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "pin";
  j.parent = kGround, j.child = add_body(m, make_box("rod", 10, {0.5, 0.05, 0.05}, {0.5, 2, 0}));
  j.X_PF.q = j.X_CM.q = test::upright();
  j.X_PF.p = {0, 2.1, 0};
  j.X_CM.p = {-0.5, 0.1, 0};
  add_joint(m, j);
  try {
    (void)run(m, {});
    ADD_FAILURE() << "it ran";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("joints[0].X_CM \"pin\": lies 0.1 m off the plane"), std::string::npos)
        << e.what();
  }
  m.is_planar = false;
  EXPECT_NO_THROW((void)run(m, {}));
}

TEST(Planar, RefusesVelocitiesThatLeaveThePlane) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body b = make_box("rod", 10, {0.5, 0.05, 0.05}, {0.5, 2, 0});
  const auto complaint = [&](const Vec3& v, const Vec3& w, bool is_planar) -> std::string {
    m.is_planar = is_planar;
    m.bodies.clear();
    b.v_WB = v, b.w_WB = w;
    add_body(m, b);
    Options o;
    o.duration = 0.01;
    try {
      (void)run(m, o);
    } catch (const InputError& e) { return e.what(); }
    return {};
  };
  EXPECT_NE(complaint({1, 0.5, 0}, {}, true).find("bodies[0].v_WB \"rod\": has 0.5 m/s along y"), std::string::npos);
  for (const Vec3& w : {Vec3{1, 0, 0}, Vec3{0, 1, 2}})
    EXPECT_NE(complaint({}, w, true).find("bodies[0].w_WB \"rod\": has a part about x or z"), std::string::npos);
  EXPECT_EQ(complaint({1, 0, 2}, {0, 3, 0}, true), "");
  EXPECT_EQ(complaint({1, 0.5, 0}, {1, 2, 3}, false), "");
}

TEST(Planar, GoesThroughItsFile) {
  Model m;
  add_body(m, make_box("b", 1, {1, 1, 1}, {0, 0, 0}));
  EXPECT_EQ(to_json(m, {}).find("is_planar"), std::string::npos) << "files of others stay as they were";
  m.is_planar = true;
  EXPECT_TRUE(model_from_json(to_json(m, {}), "model", nullptr).is_planar);
}

TEST(Planar, RefusesAGroundThatRisesAcross) {
  Model m;
  add_body(m, make_box("b", 1, {1, 1, 1}, {0, 0, 2}));
  m.is_planar = true;
  m.contact.normal = {std::sin(0.3), 0, std::cos(0.3)};
  EXPECT_NO_THROW(check_model(m));
  m.contact.normal = {0, std::sin(0.3), std::cos(0.3)};
  EXPECT_THROW(check_model(m), InputError);
}

}  // namespace
}  // namespace topple::mbs
