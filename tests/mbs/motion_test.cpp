// Motion of bodies and joints against closed forms. g = 9.81.
#include <gtest/gtest.h>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options options_of(double duration, double step) {
  Options o;
  o.duration = duration;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = duration;
  return o;
}

/// A rod of length 1 hinged at the origin about y, at the angle from the upright, falling towards +x.
Model make_rod(double angle) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body rod;
  rod.name = "rod";
  rod.mass = 1;
  rod.inertia = Mat3::diagonal({1.0 / 12, 1.0 / 12, 1e-3});
  rod.X_WB.q = exp_rotation({0, angle, 0});
  rod.X_WB.p = to_matrix(rod.X_WB.q) * Vec3{0, 0, 0.5};
  const BodyId b = add_body(m, rod);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "hinge";
  j.parent = kGround;
  j.child = b;
  // the joint's axis z along W's y
  j.X_PF.q = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
  j.X_CM.q = conjugate(rod.X_WB.q) * j.X_PF.q;  // the joint's angle is 0 at the start
  j.X_CM.p = {0, 0, -0.5};
  add_joint(m, j);
  return m;
}

TEST(RevoluteJoint, RodTopplesAsInClosedForm) {
  const double start = 5 * 3.14159265358979323846 / 180;
  // time and speed at the horizontal: elliptic integral, computed independently to 1e-11
  const double t90 = 0.948316677, w90 = 5.414610786;
  double time = 0, speed = 0, before_angle = 0, before_time = 0, before_w = 0;
  Options o = options_of(1.0, 1e-4);
  o.frame_interval = 1e-4;
  o.on_frame = [&](const View& v) {
    const double angle = 2 * std::atan2(v.X_WB[0].q.y, v.X_WB[0].q.w);
    const double quarter = 3.14159265358979323846 / 2;
    if (before_angle < quarter && angle >= quarter) {
      const double s = (quarter - before_angle) / (angle - before_angle);
      time = before_time + s * (v.time - before_time);
      speed = before_w + s * (v.w_WB[0].y - before_w);
    }
    before_angle = angle;
    before_time = v.time;
    before_w = v.w_WB[0].y;
  };
  const Summary s = run(make_rod(start), o);
  EXPECT_NEAR(time, t90, 1e-6);  // second order: h² ω² t is 3e-7
  EXPECT_NEAR(speed, w90, 1e-5);
  EXPECT_LT(s.joint_drift, 1e-10);
  EXPECT_LT(s.energy_error, 1e-5);
}

TEST(RevoluteJoint, ConvergesWithTheSquareOfTheStep) {
  const auto angle_after = [](double h) {
    double angle = 0;
    Options o = options_of(0.8, h);
    o.on_frame = [&](const View& v) { angle = 2 * std::atan2(v.X_WB[0].q.y, v.X_WB[0].q.w); };
    (void)run(make_rod(0.3), o);
    return angle;
  };
  const double a = angle_after(4e-3), b = angle_after(2e-3), c = angle_after(1e-3);
  EXPECT_NEAR(std::log2((a - b) / (b - c)), 2, 0.1);
}

TEST(RevoluteJoint, ReactionOfAHangingRodIsItsWeight) {
  Model m = make_rod(3.14159265358979323846);
  Vec3 force;
  Options o = options_of(0.1, 1e-4);
  o.on_frame = [&](const View& v) { force = v.ground_force; };
  (void)run(m, o);
  EXPECT_NEAR(force.z, 9.81, 1e-9);
  EXPECT_NEAR(force.x, 0, 1e-9);
}

TEST(RotationalElement, TurnsPlasticallyAtItsLimit) {
  // a horizontal rod held at a hinge whose limit is less than the weight's moment: the plastic moment slows the fall
  Model m = make_rod(3.14159265358979323846 / 2);
  const double weight_moment = 9.81 * 0.5, limit = 3;
  ZoneLaw law = test::plastic_hinge(limit);
  RotationalElement r;
  r.joint = {0};
  r.stiffness = 1e4;
  r.damping_ratio = 0.1;
  r.law = add_law(m, law);
  m.rotational_elements.push_back(r);
  Options o = options_of(0.2, 1e-5);
  double w = 0, rotation = 0;
  o.on_frame = [&](const View& v) {
    w = v.w_WB[0].y;
    rotation = v.rotation[0];
  };
  Summary s = run(m, o);
  EXPECT_GT(rotation, 0.05);
  EXPECT_LT(s.energy_error, 1e-3);
  // angular acceleration (M - limit) / (1/3) as long as the rod is near the horizontal; the hinge
  // gives way elastically for its first 3e-4 rad, at half the resistance: 1 ms of 200 ms at the full moment, 1 to 3 %
  EXPECT_NEAR(w, 3 * (weight_moment - limit) * 0.2, 0.04 * 3 * (weight_moment - limit) * 0.2);
  // and a limit above the moment holds the rod
  m.laws.set(0, test::plastic_hinge(3 * weight_moment));
  o.duration = 0.05;
  (void)run(m, o);
  EXPECT_EQ(rotation, 0);
}

TEST(RotationalElement, LimitFollowsTheReactionOfItsJoint) {
  // a rod upright on its hinge, pushed over by a sideways field: the family gives moment only under compression
  Model m = make_rod(0);
  m.bodies[0].mass = 100;
  m.bodies[0].inertia = Mat3::diagonal({100.0 / 12, 100.0 / 12, 0.1});
  m.gravity = {0.5, 0, -9.81};
  ZoneLaw law;
  law.moment_z = {{-981 * 2, 0, 981 * 2}, {0, 1}, {60, 60, 0, 0, 0, 0},
                  {60, 60, 0, 0, 0, 0},   {},     {}};  // 30 N·m under 981 N
  RotationalElement r;
  r.joint = {0};
  r.stiffness = 1e6;
  r.law = add_law(m, law);
  m.rotational_elements.push_back(r);
  Options o = options_of(0.2, 1e-4);
  o.equilibrium = true;
  double rotation = 0;
  o.on_frame = [&](const View& v) { rotation = v.rotation[0]; };
  EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);  // 25 N·m wanted
  EXPECT_EQ(rotation, 0);
  m.gravity.x = 0.7;  // 35 N·m wanted
  EXPECT_EQ(run(m, o).ending, Summary::Ending::NoEquilibrium);
}

TEST(FixedJoint, HoldsTwoBodiesAsOne) {
  // a dumb-bell thrown with spin: its common centre flies a parabola, the spin stays
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const Vec3 half{0.1, 0.1, 0.1};
  Body a = make_box("a", 2, half, {-1, 0, 5}), b = make_box("b", 1, half, {2, 0, 5});
  const Vec3 w{0, 0, 2};
  a.w_WB = b.w_WB = w;
  a.v_WB = cross(w, Vec3{-1, 0, 0});
  b.v_WB = cross(w, Vec3{2, 0, 0});
  add_body(m, a);
  add_body(m, b);
  Joint j;
  j.name = "weld";
  j.parent = {0};
  j.child = {1};
  j.X_PF.p = {1.5, 0, 0};
  j.X_CM.p = {-1.5, 0, 0};
  add_joint(m, j);
  Options o = options_of(1.0, 1e-3);
  Vec3 centre, apart;
  o.on_frame = [&](const View& v) {
    centre = (1.0 / 3) * (2 * v.X_WB[0].p + v.X_WB[1].p);
    apart = v.X_WB[1].p - v.X_WB[0].p;
  };
  const Summary s = run(m, o);
  EXPECT_NEAR(centre.z, 5 - 0.5 * 9.81, 1e-10);
  EXPECT_NEAR(centre.x, 0, 1e-10);
  EXPECT_NEAR(norm(apart), 3, 1e-9);
  EXPECT_NEAR(std::atan2(apart.y, apart.x), 2.0, 2e-6);  // (ωh)² t / 24 of the second-order rule
  EXPECT_LT(s.joint_drift, 1e-10);
}

TEST(FixedJoint, BreaksAtItsLimit) {
  // hanging under a body that hangs on the ground; the lower weighs 98.1 N
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const Vec3 half{0.1, 0.1, 0.1};
  add_body(m, make_box("upper", 1, half, {0, 0, 10}));
  add_body(m, make_box("lower", 10, half, {0, 0, 9.8}));
  Joint top;
  top.parent = kGround;
  top.child = {0};
  top.X_PF.p = {0, 0, 10};
  add_joint(m, top);
  Joint j;
  j.name = "weld";
  j.parent = {0};
  j.child = {1};
  j.X_PF = {{0, 0, -0.1}, to_quat(Mat3::from_columns({0, 0, -1}, {1, 0, 0}, {0, -1, 0}))};  // x down, parent to child
  j.X_CM = {{0, 0, 0.1}, j.X_PF.q};
  j.tension_limit = 99;
  add_joint(m, j);
  bool released = false;
  Options o = options_of(0.1, 1e-3);
  o.on_happening = [&](const Happening& h) { released = released || h.kind == Happening::Kind::JointReleased; };
  (void)run(m, o);
  EXPECT_FALSE(released);
  m.joints[1].tension_limit = 97;
  (void)run(m, o);
  EXPECT_TRUE(released);
}

TEST(DistanceJoint, ComesOffByThePullAlongItsOwnLine) {
  // a mass on a rod of 1 m that begins level is pulled by 3 m g sin θ
  constexpr double mass = 2, g = 9.81, limit = 40;
  for (const bool limits_shear : {false, true}) {
    Model m;
    m.contact.ground = m.contact.bodies = false;
    add_body(m, make_box("mass", mass, {0.05, 0.05, 0.05}, {1, 0, 0}));
    Joint j;
    j.kind = Joint::Kind::Distance;
    j.parent = kGround;
    j.child = {0};
    j.tension_limit = limit;
    if (limits_shear) j.shear_limit = 1;  // there is none
    add_joint(m, j);
    double angle = 0, last = 0;
    std::string reason;
    Options o = options_of(1, 1e-4);
    o.frame_interval = 1e-4;
    o.on_frame = [&](const View& v) { last = std::atan2(-v.X_WB[0].p.z, v.X_WB[0].p.x); };
    o.on_happening = [&](const Happening& h) {
      if (h.kind == Happening::Kind::JointReleased) angle = last, reason = h.reason;
    };
    (void)run(m, o);
    EXPECT_EQ(reason, "tension");
    EXPECT_NEAR(angle, std::asin(limit / (3 * mass * g)), 2e-3);
  }
}

TEST(FreeBody, TheStepFollowsWhatIsSpunUp) {
  // Euler's equations about the axis of the largest inertia, 25 N·m on 0.25 kg·m² for 5 s; the small torque about x
  // makes it wobble by 0.02 rad/s (computed independently)
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b;
  b.mass = 2;
  b.inertia = Mat3::diagonal({0.1, 0.2, 0.25});
  add_body(m, b);
  Load l;
  l.body = {0};
  l.torque = {0.01, 0, 25};
  l.follows_body = true;
  m.loads.push_back(l);
  Options o = options_of(5, 0);
  o.step_safety = 0.1, o.most_turn = 0.03, o.least_steps = 200;
  Vec3 w;
  double time = 0;
  o.on_frame = [&](const View& v) { w = transpose_times(to_matrix(v.X_WB[0].q), v.w_WB[0]), time = v.time; };
  const Summary s = run(m, o);
  EXPECT_NEAR(time, 5, 1e-4);
  EXPECT_NEAR(w.z, 100 * time, 1e-3);
  EXPECT_LT(std::hypot(w.x, w.y), 0.03);
  EXPECT_LT(s.energy_error, 1e-3);
}

/// A body with the inertia (1, 2, 3), without weight.
Model make_top(const Vec3& w) {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b;
  b.name = "top";
  b.inertia = Mat3::diagonal({1, 2, 3});
  b.w_WB = w;
  add_body(m, b);
  return m;
}

TEST(FreeBody, TorqueFreeTopTurnsAsInTheReference) {
  // I = (1, 2, 3), ω0 = (0.1, 1, 0.1) in the body's axes; angular velocity in body axes at t = 10 (computed
  // independently)
  const Model m = make_top({0.1, 1, 0.1});
  Vec3 w;
  const Vec3 wanted{-0.304543317, -0.957733454, 0.193861318};
  double off[2];
  for (const int i : {0, 1}) {
    Options o = options_of(10, i == 0 ? 2e-3 : 2e-4);
    o.on_frame = [&](const View& v) { w = transpose_times(to_matrix(v.X_WB[0].q), v.w_WB[0]); };
    (void)run(m, o);
    off[i] = norm(w - wanted);
  }
  EXPECT_LT(off[1], 1e-6);
  EXPECT_NEAR(std::log10(off[0] / off[1]), 2, 0.1);  // second order: a tenth of the step, a hundredth of the error
}

TEST(FreeBody, TorqueFreeTopComesBackAfterItsPeriod) {
  Options o = options_of(22.996262944, 2e-4);
  Vec3 w;
  o.on_frame = [&](const View& v) { w = transpose_times(to_matrix(v.X_WB[0].q), v.w_WB[0]); };
  EXPECT_NEAR(run(make_top({0.1, 1, 0.1}), o).time, 22.996262944, 2e-4);
  EXPECT_LT(norm(w - Vec3{0.1, 1, 0.1}), 2e-5);  // the last step ends up to 2e-4 s beside it, at 0.06 rad/s²
}

TEST(FreeBody, TurnsOverTwelveTimesAsInTheReference) {
  // I = (1, 2, 3), nearly about the middle axis: the times of its turns over (computed independently) and its energy,
  // free and held at its mass centre
  const double wanted[] = {1.280, 3.738, 6.196, 8.654, 11.112, 13.569, 16.027, 18.485, 20.943, 23.401, 25.859, 28.316};
  for (const bool is_held : {false, true}) {
    Model m = make_top({0.01, 10, 0.02});
    const Body b = m.bodies[0];
    Joint j;
    j.kind = Joint::Kind::Spherical;
    j.parent = kGround;
    j.child = {0};
    if (is_held) add_joint(m, j);
    Options o = options_of(30, 1e-3);
    o.frame_interval = 1e-2;
    std::vector<double> turned;
    double time = 0, before = 10, energy = 0;
    o.on_frame = [&](const View& v) {
      const Vec3 w = transpose_times(to_matrix(v.X_WB[0].q), v.w_WB[0]);
      if (w.y * before < 0) turned.push_back(time + before / (before - w.y) * (v.time - time));
      time = v.time, before = w.y;
      energy = dot(w, b.inertia * w) / dot(b.w_WB, b.inertia * b.w_WB) - 1;
    };
    (void)run(m, o);
    ASSERT_EQ(turned.size(), std::size(wanted));
    for (size_t i = 0; i < turned.size(); ++i) EXPECT_NEAR(turned[i], wanted[i], 2e-3);
    EXPECT_LT(std::abs(energy), 1e-7);
  }
}

TEST(FreeBody, KeepsItsAngularMomentumToRoundOff) {
  const Model m = make_top({0.3, 5, 0.1});
  const Body b = m.bodies[0];
  Vec3 first, last;
  Options o = options_of(5, 1e-3);
  bool begun = false;
  o.on_frame = [&](const View& v) {
    const Mat3 R = to_matrix(v.X_WB[0].q);
    last = R * (b.inertia * transpose_times(R, v.w_WB[0]));
    if (!begun) first = last;
    begun = true;
  };
  (void)run(m, o);
  EXPECT_NEAR(norm(last - first), 0, 1e-9);
}

}  // namespace
}  // namespace topple::mbs
