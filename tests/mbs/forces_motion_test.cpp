// Bushings in free flight and loads against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options options_of(double duration, double step) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = step;
  return o;
}

/// Two unlike bodies that tumble about each other on a soft bushing off their centres.
Model make_tumblers() {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body a = make_box("a", 3, {0.3, 0.2, 0.1}, {0, 0, 0}), b = make_box("b", 2, {0.1, 0.3, 0.4}, {0.7, 0.1, 0.2});
  a.w_WB = {0.4, -0.9, 1.3};
  b.w_WB = {-1.1, 0.7, -0.8};
  b.v_WB = {0.1, 0.3, -0.2};
  b.X_WB.q = exp_rotation({0.3, -0.2, 0.5});
  add_body(m, a);
  add_body(m, b);
  Bushing k;
  k.name = "bushing";
  k.a = {0};
  k.b = {1};
  k.X_AF = {{0.35, 0.05, 0}, exp_rotation({0, 0.4, 0.1})};
  k.X_BM = {{-0.2, 0.1, -0.1}, exp_rotation({0.2, 0, -0.3})};
  const double stiffness[6] = {60, 90, 40, 0.5, 0.9, 0.4};
  for (int c = 0; c < 6; ++c) k.spring[c].rate = stiffness[c];
  m.bushings.push_back(k);
  return m;
}

TEST(BushingPhysics, KeepsItsEnergyInLargeRotations) {
  const Model m = make_tumblers();
  double residual[2], turned = 0;
  for (int i = 0; i < 2; ++i) {
    Options o = options_of(10, 2e-3 / (1 << i));
    residual[i] = 0;
    double total = 0;
    Vec3 start, momentum;
    o.on_frame = [&](const View& v) {
      residual[i] = std::max(residual[i], std::abs(v.energy.residual));
      total = v.energy.kinetic + v.energy.elastic;
      turned = std::max(turned, norm(v.bushing_rotation[0]));
      momentum = {};
      for (size_t b = 0; b < 2; ++b) {
        const Mat3 R = to_matrix(v.X_WB[b].q);
        const Body& body = m.bodies[b];
        momentum += cross(v.X_WB[b].p, v.mass[b] * v.v_WB[b]) + R * (body.inertia * transpose_times(R, v.w_WB[b]));
      }
      if (v.time == 0) start = momentum;
    };
    const Summary s = run(m, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(residual[i], 1e-4 * total / (1 << (2 * i))) << i;
    EXPECT_LT(norm(momentum - start), 1e-4 * norm(start) / (1 << (2 * i)));
  }
  EXPECT_GT(turned, 1.5);
  EXPECT_NEAR(std::log2(residual[0] / residual[1]), 2, 0.1);
}

TEST(BushingPhysics, GoesOnBeyondAHalfTurn) {
  // about one axis only, through an angle of 180° and back: the rotation is that of a pendulum on a linear spring
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b = make_box("b", 1, {0.1, 0.1, 0.1}, {0, 0, 0});
  b.inertia = Mat3::diagonal({1, 1, 1});
  b.w_WB = {0, 0, 4.5};
  add_body(m, b);
  Bushing k;
  k.name = "bushing";
  k.a = kGround;
  k.b = {0};
  for (int c = 0; c < 6; ++c) k.spring[c].rate = 1;
  m.bushings.push_back(k);
  double off = 0, most = 0;
  Options o = options_of(6, 1e-3);
  o.on_frame = [&](const View& v) {
    off = std::max(off, std::abs(v.bushing_rotation[0].z - 4.5 * std::sin(v.time)));
    most = std::max(most, v.bushing_rotation[0].z);
  };
  (void)run(m, o);
  EXPECT_LT(off, 1e-5);
  EXPECT_NEAR(most, 4.5, 1e-5);
  // and short of a full turn it says that it cannot
  m.bodies[0].w_WB.z = 7;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::Diverged);
  EXPECT_NE(s.message.find("bushing \"bushing\" is turned"), std::string::npos) << s.message;
}

TEST(BushingPhysics, DampsWithOrderTwo) {
  Model m = make_tumblers();
  for (int c = 0; c < 6; ++c) m.bushings[0].damper[c].rate = 0.2 * m.bushings[0].spring[c].rate;
  Vec3 end[3];
  double residual[3], damped = 0;
  for (int i = 0; i < 3; ++i) {
    Options o = options_of(4, 8e-3 / (1 << i));
    residual[i] = 0;
    o.on_frame = [&](const View& v) {
      end[i] = v.X_WB[1].p;
      residual[i] = std::max(residual[i], std::abs(v.energy.residual));
      damped = v.energy.damping;
    };
    (void)run(m, o);
    EXPECT_GT(damped, 0.1);
  }
  EXPECT_NEAR(std::log2(norm(end[0] - end[1]) / norm(end[1] - end[2])), 2, 0.15);
  EXPECT_NEAR(std::log2(residual[1] / residual[2]), 2, 0.15);
}

TEST(BushingPhysics, BreaksInItsWeakestComponent) {
  Model m = make_tumblers();
  m.bushings[0].strength[4] = 0.6;
  Options o = options_of(10, 2e-3);
  int broken = 0;
  Energy end;
  o.on_happening = [&](const Happening& h) {
    if (h.kind != Happening::Kind::BushingBroken) return;
    ++broken;
    EXPECT_EQ(h.reason, "rotation");
  };
  o.on_frame = [&](const View& v) {
    EXPECT_LE(std::abs(v.bushing_moment[0].y), broken > 0 ? 0 : 0.6);
    end = v.energy;
  };
  (void)run(m, o);
  EXPECT_EQ(broken, 1);
  EXPECT_GT(end.plastic, 0);
  EXPECT_EQ(end.elastic, 0);
  EXPECT_LT(std::abs(end.residual), 1e-4);
}

/// A mass of 4 kg with one load along x.
Model make_loaded(const Load& load) {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  add_body(m, make_box("mass", 4, {0.1, 0.1, 0.1}, {0, 0, 0}));
  m.loads.push_back(load);
  m.loads[0].body = {0};
  return m;
}

Event event_of(Action::Kind kind, double time) {
  Event e;
  e.time = time;
  e.actions.emplace_back();
  e.actions[0].kind = kind;
  e.actions[0].index = 0;
  return e;
}

struct End {
  double x = 0, v = 0, residual = 0, work = 0;
};
End end_of(const Model& m, double duration, double step) {
  Options o = options_of(duration, step);
  End e;
  o.on_frame = [&](const View& v) {
    e.x = v.X_WB[0].p.x;
    e.v = v.v_WB[0].x;
    e.work = v.energy.loads;
    e.residual = std::max(e.residual, std::abs(v.energy.residual));
  };
  (void)run(m, o);
  return e;
}

TEST(LoadPhysics, GivesTheImpulseOfItsTable) {
  // 0 until 0.1 s, to 30 N at 0.25 s, back to -10 N at 0.4 s and on to 0 at 0.55 s
  Load l;
  l.force = {10, 0, 0};
  l.time = {0.1, 0.25, 0.4, 0.55};
  l.factor = {0, 3, -1, 0};
  const double impulse = 10 * 0.15 * (1.5 + 1 - 0.5);
  // way by the integral of the velocity: impulse times the time left from the centroid of each piece
  const auto way = [](double t) {
    const double x[4] = {0.1, 0.25, 0.4, 0.55}, f[4] = {0, 30, -10, 0};
    double s = 0;
    for (int i = 0; i < 3; ++i) {
      const double d = x[i + 1] - x[i];
      s += 0.5 * f[i] * d * (t - x[i] - d / 3) + 0.5 * f[i + 1] * d * (t - x[i] - 2 * d / 3);
    }
    return s / 4;
  };
  double off[3];
  for (int i = 0; i < 3; ++i) {
    const double h = 4e-3 / 3 / (1 << i);
    const End e = end_of(make_loaded(l), 0.8, h);
    EXPECT_NEAR(e.v, impulse / 4, 1e-12);
    EXPECT_NEAR(e.work, 0.5 * 4 * e.v * e.v, 1e-12);
    off[i] = std::abs(e.x - way(0.8));
    EXPECT_LT(e.residual, 1e-4 / (1 << (2 * i)));
    EXPECT_LT(off[i], 1e-5 / (1 << (2 * i)));  // h² times the change of force over the mass
  }
}

TEST(LoadPhysics, BeginsAndEndsAtTheTimesOfItsEvents) {
  // 8 N from 0.2007 s to 0.5003 s, at times between the steps: the impulse is exact, the way of second order
  Load l;
  l.force = {8, 0, 0};
  Model m = make_loaded(l);
  m.events = {event_of(Action::Kind::ApplyLoad, 0.2007), event_of(Action::Kind::RemoveLoad, 0.5003)};
  const double v = 2 * (0.5003 - 0.2007), x = v * (0.8 - 0.5 * (0.2007 + 0.5003));
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    const End e = end_of(m, 0.8, h);
    EXPECT_NEAR(e.v, v, 1e-12) << h;
    EXPECT_NEAR(e.x, x, 2 * h * h) << h;  // acceleration times h²/8 at each end, and more for the place within the step
    EXPECT_LT(e.residual, 2 * h) << h;
  }
}

TEST(LoadPhysics, CanBeAppliedAgain) {
  // 8 N from 0.1 to 0.2 s and from 0.5 to 0.6003 s; what ends it before it has begun does nothing
  Load l;
  l.force = {8, 0, 0};
  Model m = make_loaded(l);
  using Kind = Action::Kind;
  m.events = {event_of(Kind::RemoveLoad, 0.05), event_of(Kind::ApplyLoad, 0.1), event_of(Kind::RemoveLoad, 0.2),
              event_of(Kind::ApplyLoad, 0.5), event_of(Kind::RemoveLoad, 0.6003)};
  for (const double h : {4e-3, 1e-3}) {
    const End e = end_of(m, 0.8, h);
    EXPECT_NEAR(e.v, 2 * (0.1 + 0.1003), 1e-12) << h;
    EXPECT_NEAR(e.x, 2 * (0.1 * (0.8 - 0.15) + 0.1003 * (0.8 - 0.55015)), 4 * h * h) << h;
  }
}

TEST(LoadPhysics, GivesItsImpulseWhateverTheStepDoes) {
  // stiff company beside the mass bounds the step until an event lets it go, in the middle of a table and of a load
  // that comes at the same time
  Load l;
  l.force = {10, 0, 0};
  l.time = {0.1, 0.25, 0.4, 0.55};
  l.factor = {0, 3, -1, 0};
  Model m = make_loaded(l);
  m.loads.push_back(m.loads[0]);
  m.loads[1].time = m.loads[1].factor = {};
  add_body(m, make_box("company", 1, {0.1, 0.1, 0.1}, {0, 5, 0}));
  for (const double stiffness : {1e6, 1e4}) {
    Bushing k;
    k.a = kGround;
    k.b = {1};
    k.X_AF.p = {0, 5, 0};
    for (int c = 0; c < 6; ++c) k.spring[c].rate = stiffness;
    m.bushings.push_back(k);
  }
  Event both = event_of(Action::Kind::RemoveBushing, 0.3003);
  both.actions.push_back(event_of(Action::Kind::ApplyLoad, 0).actions[0]);
  both.actions[1].index = 1;
  m.events = {both, event_of(Action::Kind::RemoveLoad, 0.6)};
  m.events[1].actions[0].index = 1;
  Options o = options_of(0.8, 0);
  o.frame_interval = 0.01;
  double least = kUnlimited, most = 0, before = 0;
  Simulation s(m, o);
  while (s.time() < 0.8) {
    before = s.time();
    ASSERT_TRUE(s.advance_step());
    least = std::min(least, s.time() - before);
    most = std::max(most, s.time() - before);
  }
  EXPECT_GT(most, 5 * least);
  EXPECT_NEAR(s.calc_view().v_WB[0].x, (10 * 0.15 * (1.5 + 1 - 0.5) + 10 * (0.6 - 0.3003)) / 4, 1e-12);
}

TEST(LoadPhysics, StartsItsTableWhenApplied) {
  Load l;
  l.force = {8, 0, 0};
  l.time = {0, 0.1, 0.2};
  l.factor = {0, 1, 0};
  Model m = make_loaded(l);
  m.events = {event_of(Action::Kind::ApplyLoad, 0.31)};
  const End e = end_of(m, 0.8, 1e-3);
  EXPECT_NEAR(e.v, 0.1 * 8 / 4, 1e-12);
  EXPECT_NEAR(e.x, 0.2 * (0.8 - 0.41), 1e-6);
}

TEST(LoadPhysics, HasOrderTwoOnAnOscillator) {
  // a load that swings as a table of 40 corners on a damped spring, ledger included
  Load l;
  l.force = {50, 0, 0};
  for (int i = 0; i <= 40; ++i) {
    l.time.push_back(0.02 * i);
    l.factor.push_back(std::sin(10 * 0.02 * i));
  }
  Model m = make_loaded(l);
  SpringDamper s;
  s.a = kGround;
  s.b = {0};
  s.p_A = {-1, 0, 0};
  s.free_length = 1;
  s.spring.rate = 900;
  s.damper.rate = 12;
  m.springs.push_back(s);
  End e[3];
  for (int i = 0; i < 3; ++i) e[i] = end_of(m, 0.8, 4e-3 / (1 << i));
  EXPECT_NEAR(std::log2((e[0].x - e[1].x) / (e[1].x - e[2].x)), 2, 0.1);
  EXPECT_NEAR(std::log2(e[1].residual / e[2].residual), 2, 0.2);
}

TEST(LoadPhysics, FollowsItsBody) {
  // a body-fixed force off the centre in the plane: θ = F d t²/(2 J), v = F/m ∫ exp(iθ)
  Load l;
  l.force = {3, 0, 0};
  l.p_B = {0, -0.2, 0};
  l.torque = {0, 0, 0.1};
  l.follows_body = true;
  Model m = make_loaded(l);
  m.bodies[0].w_WB = {0, 0, 1};
  const double J = m.bodies[0].inertia(2, 2), turning = (3 * 0.2 + 0.1) / J;
  std::complex<double> v = 0, x = 0;
  constexpr int n = 200000;
  const double d = 1.0 / n;
  const auto a = [&](double t) { return 0.75 * std::exp(std::complex<double>(0, t + 0.5 * turning * t * t)); };
  for (int i = 0; i < n; ++i) {
    const auto mean = (a(i * d) + 4.0 * a((i + 0.5) * d) + a((i + 1) * d)) / 6.0;
    x += d * v + 0.5 * d * d * mean;
    v += d * mean;
  }
  double off[2], residual[2];
  for (int i = 0; i < 2; ++i) {
    Options o = options_of(1, 1e-3 / (1 << i));
    residual[i] = 0;
    o.on_frame = [&](const View& view) {
      off[i] = norm(view.X_WB[0].p - Vec3{x.real(), x.imag(), 0});
      residual[i] = std::max(residual[i], std::abs(view.energy.residual));
    };
    (void)run(m, o);
    EXPECT_LT(residual[i], 2e-2 / (1 << (2 * i)));
  }
  EXPECT_LT(off[1], 1e-4);
  EXPECT_NEAR(std::log2(off[0] / off[1]), 2, 0.1);
}

TEST(DamperPhysics, DryFrictionStopsAtAnySpeed) {
  // a table that rises to the friction within 1e-5 m/s: 100 kg at 1 m/s stop after v^2 / (2 a); next to rest its force
  // is known to round-off of the largest only
  for (const double friction : {97.0, 100.0, 103.0, 350.0})
    for (const double step : {1e-3, 7e-4, 1e-4}) {
      Model m;
      m.contact.ground = m.contact.bodies = false;
      m.gravity = {};
      add_body(m, test::make_box("b", 100, {0.1, 0.1, 0.1}, {0, 0, 0}));
      m.bodies[0].v_WB = {1, 0, 0};
      SpringDamper s;
      s.name = "friction";
      s.a = kGround, s.b = {0};
      s.p_A = {-10, 0, 0};
      s.free_length = 10;
      s.damper.kind = Characteristic::Kind::Table;
      s.damper.x = {-1, -1e-5, 0, 1e-5, 1};
      s.damper.f = {-1.01 * friction, -friction, 0, friction, 1.01 * friction};
      m.springs.push_back(s);
      double x = 0, v = 1;
      Options o = options_of(2.5, step);
      o.on_frame = [&](const View& view) { x = view.X_WB[0].p.x, v = view.v_WB[0].x; };
      const Summary end = run(m, o);
      ASSERT_EQ(end.ending, Summary::Ending::TimeLimit) << friction << " N, " << step << " s: " << end.message;
      EXPECT_LT(std::abs(v), 1e-4);
      EXPECT_NEAR(x, 100 / (2 * 1.005 * friction), 0.02 * 100 / (2 * friction)) << friction << " " << step;
    }
}

TEST(DamperPhysics, TheFirstRowHasTheVelocitiesOfTheStart) {
  // a spring, a bushing that turns and the hinge behind it, with dampers that stop their bodies within some steps
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body ball = make_box("ball", 1, {0.1, 0.1, 0.1}, {1, 0, 0});
  ball.v_WB = {1, 0, 0};
  ball.w_WB = {0, 0, 2};
  add_body(m, ball);
  Body door = make_box("door", 2, {0.5, 0.1, 0.1}, {0.5, 3, 0});
  door.w_WB = {0, 0, 3};
  door.v_WB = {0, 1.5, 0};
  add_body(m, door);
  SpringDamper s;
  s.a = kGround, s.b = {0};
  s.free_length = 1;
  s.damper.rate = 5000;
  m.springs.push_back(s);
  Bushing k;
  k.a = kGround, k.b = {0};
  k.X_AF.p = {1, 0, 0};
  k.damper[5].rate = 40;
  m.bushings.push_back(k);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.parent = kGround, j.child = {1};
  j.X_PF.p = {0, 3, 0}, j.X_CM.p = {-0.5, 0, 0};
  add_joint(m, j);
  RotationalSpring r;
  r.joint = {0};
  r.damper.rate = 300;
  m.rotational_springs.push_back(r);
  Options o = options_of(0.01, 1e-3);
  std::vector<View> views;
  o.on_frame = [&](const View& v) { views.push_back(v); };
  (void)run(m, o);
  const View& v = views.front();
  EXPECT_EQ(v.time, 0);
  EXPECT_EQ(v.spring_force[0], 5000);
  EXPECT_NEAR(v.bushing_moment[0].z, -80, 1e-12);
  EXPECT_NEAR(v.torsion_torque[0], 900, 1e-12);
  // Newton of the door: its spin falls by 900 N·m over the inertia about the hinge, half a metre from its centre
  const double turn = -900 / (m.bodies[1].inertia(2, 2) + 2 * 0.25);
  EXPECT_NEAR(v.joint_force[0].x, -2 * 0.5 * 9, 1e-9);
  EXPECT_NEAR(v.joint_force[0].y, 2 * 0.5 * turn, 1e-9);
  EXPECT_NEAR(v.ground_force.x, -5000 + v.joint_force[0].x, 1e-9);
  // looking changes nothing
  Simulation unseen(m, options_of(0.01, 1e-3)), seen(m, options_of(0.01, 1e-3));
  (void)seen.calc_view();
  for (int i = 0; i < 5; ++i) unseen.advance_step(), seen.advance_step();
  EXPECT_EQ(seen.calc_view().v_WB[0], unseen.calc_view().v_WB[0]);
  EXPECT_EQ(seen.calc_view().w_WB[1], unseen.calc_view().w_WB[1]);
  EXPECT_EQ(seen.calc_view().energy.residual, unseen.calc_view().energy.residual);
}

TEST(LoadPhysics, OnTheGroundIsItsReaction) {
  Load l;
  l.force = {0, 0, -70};
  Model m = make_loaded(l);
  m.bodies[0].fixed = true;
  Options o = options_of(0.01, 1e-3);
  o.on_frame = [&](const View& v) { EXPECT_EQ(v.ground_force.z, 70); };
  (void)run(m, o);
}

TEST(LoadPhysics, GoneAndBackWithinAStepHasTheWholeImpulse) {
  // 1 N on 1 kg from 0.1003 s on, gone from 0.2507 to 0.3001 s, from 0.3002 to 0.3003 s and from 0.8 s on; the spring
  // that goes with it makes the step longer
  for (const bool has_table : {false, true})
    for (const double step : {1e-2, 3.3e-3, 1e-3, 0.0}) {
      Model m;
      m.gravity = {};
      m.contact.ground = m.contact.bodies = false;
      add_body(m, test::make_box("a", 1, {0.1, 0.1, 0.1}, {0, 0, 0}));
      add_body(m, test::make_box("b", 1, {0.1, 0.1, 0.1}, {0, 3, 0}));
      SpringDamper s;
      s.a = kGround, s.b = {1};
      s.p_A = {0, 4, 0};
      s.free_length = 1;
      s.spring.rate = 1e4;
      m.springs.push_back(s);
      Load l;
      l.body = {0};
      l.force = {1, 0, 0};
      if (has_table) l.time = {0, 1}, l.factor = {1, 3};
      m.loads.push_back(l);
      const double times[] = {0.1003, 0.2507, 0.3001, 0.3002, 0.3003, 0.8};
      double expected = 0;
      for (int i = 0; i < 6; ++i) {
        Event e;
        e.time = times[i];
        e.actions.resize(1);
        e.actions[0].kind = i % 2 == 0 ? Action::Kind::ApplyLoad : Action::Kind::RemoveLoad;
        e.actions[0].index = 0;
        if (i == 1) {
          Action a;
          a.kind = Action::Kind::RemoveSpring;
          a.index = 0;
          e.actions.push_back(a);
        }
        m.events.push_back(e);
        if (i % 2 == 0) {
          const double lasts = times[i + 1] - times[i];
          expected += has_table ? lasts + lasts * lasts : lasts;
        }
      }
      Options o;
      o.duration = 1, o.step = step, o.equilibrium = false;
      double v = 0;
      o.on_frame = [&](const View& view) { v = view.v_WB[0].x; };
      (void)run(m, o);
      EXPECT_NEAR(v, expected, 1e-12) << has_table << " " << step;
    }
}

TEST(SpringPhysics, KeepsItsLedgerThroughItsAnchor) {
  // the line turns round in the step that goes through: a damper's work of that step was lost (2.3e-3)
  for (const double free_length : {0.0, 0.5}) {
    Model m;
    m.gravity = {};
    m.contact.ground = m.contact.bodies = false;
    add_body(m, make_box("a", 2, {0.1, 0.1, 0.1}, {0.1 + free_length, 0, 0}));
    SpringDamper s;
    s.name = "spring";
    s.a = kGround, s.b = {0};
    s.free_length = free_length;
    s.spring.rate = 800, s.damper.rate = 5;
    m.springs.push_back(s);
    const Summary end = run(m, options_of(1, 2e-4));
    EXPECT_LT(end.energy_error, 1e-5) << free_length;
  }
}

}  // namespace
}  // namespace topple::mbs
