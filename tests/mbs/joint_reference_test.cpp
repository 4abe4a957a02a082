// Mechanisms of ideal joints against published and independently computed numbers. g = 9.81.
#include <gtest/gtest.h>

#include <functional>

#include "mechanisms.h"

namespace topple::mbs {
namespace {

using test::empty_model;

constexpr double kPi = 3.14159265358979323846;

/// Runs without equilibrium and gives the view at each of the times.
Summary run_to(const Model& m, double h, const std::vector<double>& times,
               const std::function<void(size_t, const View&)>& at) {
  Options o;
  o.equilibrium = false;
  o.step = h;
  o.duration = times.back();
  o.frame_interval = times.front();
  size_t next = 0;
  o.on_frame = [&](const View& v) {
    if (next < times.size() && std::abs(v.time - times[next]) < 0.5 * h) at(next++, v);
  };
  const Summary s = run(m, o);
  EXPECT_EQ(next, times.size());
  return s;
}

TEST(JointReference, PendulumOfAPointMass) {
  // IFToMM benchmark A01: m = l = 1, released from (-1, 0); the point hangs on a distance joint, so its inertia does
  // not count, or on a hinge with hardly any. Second order: (ω h)² ω t / 24 is 1e-8 at 1e-4.
  for (const bool hinge : {false, true}) {
    Model m = empty_model();
    Body b;
    b.name = "bob";
    b.inertia = 1e-12 * Mat3::identity();
    b.X_WB.p = {-1, 0, 0};
    add_body(m, b);
    if (hinge) {
      test::pin(m, kGround, {0}, {});
    } else {
      Joint j;
      j.kind = Joint::Kind::Distance;
      j.parent = kGround;
      j.child = {0};
      add_joint(m, j);
    }
    Vec3 p[2];
    const Summary s = run_to(m, 1e-4, {1, 10}, [&](size_t i, const View& v) { p[i] = v.X_WB[0].p; });
    EXPECT_NEAR(p[0].x, 0.986291751, 1e-6);
    EXPECT_NEAR(p[0].z, -0.165010853, 1e-6);
    EXPECT_NEAR(p[1].x, -0.275087463, 1e-6);
    EXPECT_NEAR(p[1].z, -0.961419205, 1e-6);
    EXPECT_LT(s.joint_drift, 1e-11);
    EXPECT_LT(s.energy_error, 1e-6);
    EXPECT_TRUE(s.notes.empty());
  }
}

TEST(JointReference, FourBarOfTwoWindowsPassesItsSingularPositions) {
  // IFToMM benchmark A02, N = 2. All rods lie on one line at 0.714355529 s and again and again after it.
  const auto end = [](double h, Vec3& p, Vec3& v) {
    return run_to(test::make_four_bars(2), h, {10}, [&](size_t, const View& view) {
      p = 2 * view.X_WB[0].p;  // the upper end of the first crank
      v = 2 * view.v_WB[0];
    });
  };
  const Vec3 p10{0.328458112, 0, 0.944518538}, v10{1.423051470, 0, -0.494868845};
  Vec3 p, v, p2, v2;
  const Summary s = end(1e-3, p, v);
  EXPECT_LT(norm(p - p10), 1e-4);
  EXPECT_LT(norm(v - v10), 1e-4);
  EXPECT_LT(s.joint_drift, 1e-8);
  // of 45 constraints, 6 repeat what the others hold: three for each window, all plane
  ASSERT_GE(s.notes.size(), 1U);
  EXPECT_NE(s.notes[0].find("6 constraints of 35 repeat"), std::string::npos) << s.notes[0];
  (void)end(5e-4, p2, v2);
  EXPECT_NEAR(std::log2(norm(p - p10) / norm(p2 - p10)), 2, 0.1);
}

TEST(JointReference, FourBarIsSingularAtItsTime) {
  // the first crank passes the horizontal
  double before_angle = 0, before_time = 0, time = 0;
  Options o;
  o.equilibrium = false;
  o.step = o.frame_interval = 2e-4;
  o.duration = 0.8;
  o.on_frame = [&](const View& v) {
    const double angle = v.joint_angle[0];
    if (before_angle < kPi / 2 && angle >= kPi / 2)
      time = before_time + (kPi / 2 - before_angle) / (angle - before_angle) * (v.time - before_time);
    before_angle = angle, before_time = v.time;
  };
  (void)run(test::make_four_bars(2), o);
  EXPECT_NEAR(time, 0.714355529, 1e-6);  // second order at 0.2 ms
}

TEST(JointReference, TopPrecessesSteadilySlowAndFast) {
  // m = l = 1, Jt = 0.2 about the centre, Ja = 0.5, 30 degrees, spin 20 rad/s about its axis in all; the point is held
  for (const double rate : {1.108756970, 8.513747516}) {
    const double lean = kPi / 6;
    Model m = empty_model();
    Body top;
    top.name = "top";
    top.inertia = Mat3::diagonal({0.2, 0.2, 0.5});
    top.X_WB.q = exp_rotation({0, lean, 0});
    const Vec3 axis = to_matrix(top.X_WB.q).column(2);
    top.X_WB.p = axis;
    // spin about the axis is 20: precession about z has its part in it
    top.w_WB = Vec3{0, 0, rate} + (20 - rate * axis.z) * axis;
    top.v_WB = cross(top.w_WB, axis);
    add_body(m, top);
    test::join(m, Joint::Kind::Spherical, kGround, {0}, {}, {});
    double turned = 0, before = 0, least = 1, most = 0, residual = 0;
    Options o;
    o.equilibrium = false;
    o.step = 5e-5;
    o.duration = 10;
    o.frame_interval = 0.01;
    o.on_frame = [&](const View& v) {
      const Vec3 a = v.X_WB[0].p;
      const double angle = std::atan2(a.y, a.x);
      turned += angle - before - 2 * kPi * std::round((angle - before) / (2 * kPi));
      before = angle;
      residual = std::max(residual, std::abs(v.energy.residual));
      least = std::min(least, a.z), most = std::max(most, a.z);
    };
    const Summary s = run(m, o);
    EXPECT_NEAR(turned / 10, rate, 1e-5);
    EXPECT_LT(most - least, 1e-5);  // it does not nod
    EXPECT_LT(s.joint_drift, 1e-11);
    EXPECT_LT(residual, 1e-4);  // of 103 J and 141 J
  }
}

TEST(JointReference, TwoRodsReleasedFromTheHorizontal) {
  // both 1 m and 1 kg; angles from the downward vertical
  Model m = empty_model();
  add_body(m, test::make_rod("upper", 1, {0, 0, 0}, {1, 0, 0}));
  add_body(m, test::make_rod("lower", 1, {1, 0, 0}, {2, 0, 0}));
  test::pin(m, kGround, {0}, {0, 0, 0});
  test::pin(m, {0}, {1}, {1, 0, 0});
  double angle[2][2], w[2][2];
  const Summary s = run_to(m, 1e-4, {1, 2}, [&](size_t i, const View& v) {
    for (size_t b = 0; b < 2; ++b) {
      const Vec3 x = to_matrix(v.X_WB[b].q).column(0);
      angle[i][b] = std::atan2(x.x, -x.z);
      w[i][b] = -v.w_WB[b].y;
    }
  });
  EXPECT_NEAR(angle[0][0], -1.207716238, 1e-4);
  EXPECT_NEAR(angle[0][1], -0.814391023, 1e-4);
  EXPECT_NEAR(w[0][0], -3.406517533, 1e-4);
  EXPECT_NEAR(w[0][1], -0.516045472, 1e-4);
  EXPECT_NEAR(angle[1][0], -0.082758307, 1e-4);
  EXPECT_NEAR(angle[1][1], 0.407362075, 1e-4);
  EXPECT_LT(s.joint_drift, 1e-11);
}

TEST(JointReference, ALightLinkBetweenTheGroundAndAHeavyBody) {
  // a double pendulum let go from the horizontal; by Lagrange's equations in both angles (Runge and Kutta, h = 1e-5)
  const struct {
    double mass, x, z;
  } cases[] = {
      {10, -1.134507552, -0.981241607}, {1e-2, -1.134503755, -0.981245920}, {1e-4, -1.134503751, -0.981245924}};
  for (const auto& c : cases) {
    Model m = empty_model();
    Body link;
    link.name = "link", link.mass = c.mass, link.inertia = Mat3::diagonal({1e-6, 1e-6, 1e-6});
    link.X_WB.p = {0.5, 0, 0};
    add_body(m, link);
    Body bob;
    bob.name = "bob", bob.mass = 1e6, bob.inertia = Mat3::diagonal({1e5, 1e5, 1e5});
    bob.X_WB.p = {1.5, 0, 0};
    add_body(m, bob);
    test::pin(m, kGround, {0}, {0, 0, 0}), test::pin(m, {0}, {1}, {1, 0, 0});
    for (const double h : {1e-3, 5e-4}) {
      Vec3 end;
      const Summary s = run_to(m, h, {1}, [&](size_t, const View& v) { end = v.X_WB[1].p; });
      EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << c.mass << ' ' << s.message;
      EXPECT_TRUE(s.notes.empty()) << c.mass << ' ' << s.notes.front();
      EXPECT_LT(s.joint_drift, 1e-11) << c.mass;
      EXPECT_NEAR(end.x, c.x, 12 * h * h) << c.mass;
      EXPECT_NEAR(end.z, c.z, 12 * h * h) << c.mass;
    }
  }
}

}  // namespace
}  // namespace topple::mbs
