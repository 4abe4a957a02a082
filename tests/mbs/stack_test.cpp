// Bodies at rest on each other, and floors that crush those below.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mbs/contact_law.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options free_options(double duration, double interval = 0.1) {
  Options o;
  o.duration = duration;
  o.equilibrium = false;
  o.frame_interval = interval;
  return o;
}

double find_fastest(const View& v) {
  double most = 0;
  for (const Vec3& u : v.v_WB) most = std::max(most, norm(u));
  return most;
}

TEST(StackPhysics, TenBoxesStayForTenSeconds) {
  Model m;
  std::vector<Vec3> start;
  for (int i = 0; i < 10; ++i) {
    // not quite above each other, and of different sizes
    const Vec3 p{0.03 * (i % 3), 0.02 * (i % 2), 0.25 + 0.5 * i};
    start.push_back(p);
    add_body(m, make_box("b" + std::to_string(i), 500 - 30 * i, {0.5 - 0.01 * i, 0.4, 0.25}, p));
  }
  Vec3 settled[10];
  double way = 0, fastest = 0, last = 1;
  Options o = free_options(10);
  o.on_frame = [&](const View& v) {
    for (size_t i = 0; i < 10; ++i) {
      if (v.time < 1) settled[i] = v.X_WB[i].p;
      way = std::max(way, norm(v.X_WB[i].p - settled[i]));
    }
    last = find_fastest(v);
    if (v.time >= 1) fastest = std::max(fastest, last);
  };
  const Summary s = run(m, o);
  // what is left is the sway that the start by a sudden load has stirred up
  EXPECT_LT(way, 2e-5);
  EXPECT_LT(fastest, 1e-3);
  EXPECT_LT(last, 1e-5);
  EXPECT_LT(s.energy_error, 1e-2);  // of the few tenths of a millimetre by which they settle
}

TEST(StackPhysics, BeamOfStiffMembersLiesStill) {
  // its pieces swing at up to 9,000 rad/s along it, at steps where contacts of 250 are looked at every second or third
  // step
  constexpr double height = 0.4;
  Model m = test::make_cantilever(8, 6, 0.3, height, 3e10, 2500).model;
  m.elements.erase(m.elements.begin());
  for (ZoneElement& e : m.elements) e.damping_ratio = 0.02;
  m.gravity = {0, 0, -9.81};
  m.contact.ground = m.contact.bodies = true;
  m.contact.contact_frequency = 250;
  // a box lies across it, another on its end
  add_body(m, make_box("across", 800, {0.2, 0.8, 0.2}, {2, 0.1, height / 2 + 0.2}));
  add_body(m, make_box("end", 300, {0.3, 0.3, 0.3}, {5.4, 0, height / 2 + 0.3}));
  for (const double fall : {0.0, 0.3}) {
    m.contact.offset = -height / 2 - fall;
    for (const int interval : {1, 0, 3}) {
      Options o = free_options(6);
      o.contact_interval = interval;
      double last = 1, way = 0;
      std::vector<Pose> settled;
      o.on_frame = [&](const View& v) {
        last = find_fastest(v);
        if (v.time < 5) settled = v.X_WB;
        for (size_t b = 0; b < settled.size(); ++b)
          way = std::max(way, v.time < 5 ? 0 : norm(v.X_WB[b].p - settled[b].p));
      };
      const Summary s = run(m, o);
      EXPECT_LT(s.step, 2.5e-4);
      EXPECT_LT(last, 1e-5) << fall << " " << interval;
      EXPECT_LT(way, 1e-5) << fall << " " << interval;
      EXPECT_LT(s.energy_error, 1e-2) << fall << " " << interval;
    }
  }
}

TEST(StackPhysics, LightBodyUnderAHeavyOneIsQuiet) {
  Model m;
  add_body(m, make_box("light", 100, {0.5, 0.5, 0.1}, {0, 0, 0.1}));
  add_body(m, make_box("heavy", 5000, {0.4, 0.4, 0.4}, {0.05, 0.02, 0.6}));
  double fastest = 0, last = 1;
  Options o = free_options(3, 1e-3);
  o.on_frame = [&](const View& v) {
    last = find_fastest(v);
    if (v.time > 1) fastest = std::max(fastest, last);
  };
  (void)run(m, o);
  EXPECT_LT(fastest, 1e-3);
  EXPECT_LT(last, 5e-5);  // a sway of about 2 Hz that dies
  // and when it is dropped onto it, with a small tilt
  m.bodies[1].X_WB.p.z += 0.3;
  m.bodies[1].X_WB.q = exp_rotation({0.05, 0.1, 0});
  Energy e;
  o.duration = 5;
  o.on_frame = [&](const View& v) {
    last = find_fastest(v);
    e = v.energy;
  };
  const Summary s = run(m, o);
  EXPECT_LT(last, 1e-4);
  EXPECT_LT(s.energy_error, 0.01);
}

TEST(StackReference, OverhangsToTheHarmonicLimitAndNotBeyond) {
  // n equal blocks over the edge of a table: L/2 (1 + 1/2 + ... + 1/n) = 0.5, 0.75, 0.916667, 1.041667 L
  const double limits[] = {0.5, 0.75, 0.916667, 1.041667};
  for (int n = 1; n <= 4; ++n)
    for (const double share : {0.99, 1.01}) {
      Model m;
      m.contact.ground = false;
      Body table = make_box("table", 1, {2, 1, 0.5}, {-2, 0, -0.5});
      table.fixed = true;
      add_body(m, table);
      // the top block first: its centre lies over the limit of the one below
      double front = 0;
      std::vector<double> x(static_cast<size_t>(n));
      double overhang = 0;
      for (int i = n; i >= 1; --i) {  // block i from the top, upwards
        overhang += share * 0.5 / i;
        x[static_cast<size_t>(i - 1)] = overhang - 0.5;
        front = overhang;
      }
      EXPECT_NEAR(front, share * limits[n - 1], 1e-6);
      for (int i = n; i >= 1; --i)
        add_body(m, make_box("block" + std::to_string(i), 100, {0.5, 0.25, 0.1},
                             {x[static_cast<size_t>(i - 1)], 0, 0.1 + 0.2 * (n - i)}));
      double fallen = 0;
      Options o = free_options(4);
      o.on_frame = [&](const View& v) {
        fallen = 0;
        for (size_t b = 1; b < v.X_WB.size(); ++b) fallen = std::max(fallen, m.bodies[b].X_WB.p.z - v.X_WB[b].p.z);
      };
      (void)run(m, o);
      if (share < 1) {
        // they settle; of four, steps of 1e-13 in the share make 0.4 to 6 mm, 0.5 of three, 0.03 of two
        EXPECT_LT(fallen, n < 4 ? 1e-3 : 1e-2) << n;
      } else {
        EXPECT_GT(fallen, 0.3) << n;
      }
    }
}

/// Times at which a block of five storeys that crushes those below comes to floors 15, 10, 5 and the ground.
std::vector<double> run_crush_down(double frequency, double angle_per_step, double* end_speed) {
  // 20 floors of 1000 kg, 3.5 m from the top of one to the bottom of the next; each hangs until it is hit
  constexpr double thick = 0.3, clear = 3.5;
  constexpr int floors = 15;
  Model m;
  m.contact.body_restitution = 0;
  m.contact.contact_frequency = frequency;
  for (int i = 1; i <= floors; ++i) {
    const BodyId id = add_body(
        m, make_box("floor" + std::to_string(i), 1000, {3, 3, thick / 2}, {0, 0, i * clear + (i - 0.5) * thick}));
    Joint j;
    j.name = "hold" + std::to_string(i);
    j.parent = kGround;
    j.child = id;
    j.X_PF.p = m.bodies[static_cast<size_t>(id.index)].X_WB.p;
    j.shear_limit = 1.2 * 1000 * 9.81;
    add_joint(m, j);
  }
  add_body(m, make_box("block", 5000, {3, 3, 0.5}, {0, 0, (floors + 1) * clear + floors * thick + 0.5}));
  // the theory knows no rotation, while plates on plates tilt from the smallest difference on
  for (Body& b : m.bodies) b.inertia = 1e4 * b.inertia;
  Options o = free_options(4.3);
  o.step = angle_per_step / frequency;
  std::vector<double> times;
  double speed = 0;
  o.on_happening = [&](const Happening& h) {
    const bool counts = h.kind == Happening::Kind::BodyContact
                            ? (h.other == floors && h.index == 14) || h.index == 9 || h.index == 4
                            : h.kind == Happening::Kind::GroundContact && times.size() == 3;
    if (counts) times.push_back(h.time);
    if (h.kind == Happening::Kind::GroundContact && speed == 0) speed = h.speed;
  };
  (void)run(m, o);
  *end_speed = speed;
  return times;
}

TEST(CrushDownReference, FloorsAreReachedWhenMomentumSaysSo) {
  // plastic impacts without resistance: 0.844723383, 2.352296051, 3.395385546, 4.266717078 s, 22.080692924 m/s at the
  // end
  const double expected[] = {0.844723383, 2.352296051, 3.395385546, 4.266717078};
  double worst[2] = {0, 0}, speed[2];
  for (int stiff = 0; stiff < 2; ++stiff) {
    const std::vector<double> t = run_crush_down(stiff ? 1500 : 500, stiff ? 0.01 : 0.05, &speed[stiff]);
    ASSERT_EQ(t.size(), 4u);
    for (size_t i = 0; i < 4; ++i) worst[stiff] = std::max(worst[stiff], std::abs(t[i] - expected[i]));
  }
  // Floors that are hit while others lie on them do not leave with one speed but with several close to each other, and
  // what holds a floor takes its share of the first step of an impact.
  EXPECT_LT(worst[0], 6e-3);
  EXPECT_LT(worst[1], 4e-3);  // 2.0e-3 at 6000 rad/s in steps of 0.005 rad
  EXPECT_NEAR(speed[1], 22.080692924, 0.015 * 22.08);
}

/// Six boxes that tumble, onto each other or each on its own: largest error of the balance over the energy released.
double run_tumbling(bool touch_each_other, double step) {
  Model m;
  m.contact.bodies = touch_each_other;
  for (int i = 0; i < 6; ++i) {
    Body b = make_box("b" + std::to_string(i), 300, {0.3, 0.2, 0.15}, {0.1 * (i % 2), 0.08 * (i % 3), 0.6 + 0.7 * i});
    b.X_WB.q = exp_rotation({0.3 * i, 0.2, 0.5 * i});
    add_body(m, b);
  }
  Options o = free_options(4, 0.01);
  o.step = step;
  o.on_frame = [&](const View& v) {
    const Energy& e = v.energy;
    EXPECT_GE(e.friction, -1e-9 * e.released);
    EXPECT_GE(e.contact_loss, -1e-6 * e.released);
    EXPECT_GE(e.contact, 0);
  };
  return run(m, o).energy_error;
}

TEST(ContactLedgerPhysics, ErrorOnTheGroundFallsWithTheStep) {
  const double coarse = run_tumbling(false, 2e-4), fine = run_tumbling(false, 2.5e-5);
  EXPECT_LT(coarse, 2e-3);
  EXPECT_LT(fine, coarse / 8);  // at least first order; impacts fall where they do in a step
}

TEST(ContactLedgerPhysics, ErrorBetweenBodiesIsThatOfTheirGeometry) {
  // the area of overlap changes while it is pressed (docs/theory/contact.md): some tenths of a per cent at any step
  for (const double step : {1e-4, 2e-5}) EXPECT_LT(run_tumbling(true, step), 0.005) << step;
}

}  // namespace
}  // namespace topple::mbs
