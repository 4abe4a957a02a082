// Springs and dampers against closed forms.
#include "mbs/forces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;
constexpr double kPi = 3.14159265358979323846;

Options options_of(double duration, double step) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = step;
  return o;
}

/// A mass on the x axis at x0 with speed v0, on a spring-damper of 2 m free length from the origin.
Model make_oscillator(double mass, double x0, double v0, const Characteristic& spring,
                      const Characteristic& damper = {}) {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b = make_box("mass", mass, {0.1, 0.1, 0.1}, {2 + x0, 0, 0});
  b.v_WB.x = v0;
  add_body(m, b);
  SpringDamper s;
  s.name = "spring";
  s.a = kGround;
  s.b = {0};
  s.free_length = 2;
  s.spring = spring;
  s.damper = damper;
  m.springs.push_back(s);
  return m;
}

Characteristic linear(double rate) { return {Characteristic::Kind::Linear, rate, {}, {}, {}}; }
Characteristic polynomial(std::vector<double> c) { return {Characteristic::Kind::Polynomial, 0, std::move(c), {}, {}}; }
Characteristic table(std::vector<double> x, std::vector<double> f) {
  return {Characteristic::Kind::Table, 0, {}, std::move(x), std::move(f)};
}

/// Largest distance of the mass from x(t), and the summary.
struct Course {
  double off = 0, residual = 0;
  Summary summary;
};
Course follow(const Model& m, const Options& o, const std::function<double(double)>& x) {
  Course c;
  Options watched = o;
  watched.on_frame = [&](const View& v) {
    c.off = std::max(c.off, std::abs(v.X_WB[0].p.x - 2 - x(v.time)));
    c.residual = std::max(c.residual, std::abs(v.energy.residual));
  };
  c.summary = run(m, watched);
  return c;
}

/// Free motion of m x'' + c x' + k x = 0 from x0, v0.
std::function<double(double)> damped(double mass, double c, double k, double x0, double v0) {
  const double decay = c / (2 * mass), d2 = k / mass - decay * decay;
  if (d2 > 0) {
    const double w = std::sqrt(d2);
    return [=](double t) {
      return std::exp(-decay * t) * (x0 * std::cos(w * t) + (v0 + decay * x0) / w * std::sin(w * t));
    };
  }
  const double s = std::sqrt(-d2), r1 = -decay + s, r2 = -decay - s;
  return [=](double t) { return ((v0 - r2 * x0) * std::exp(r1 * t) + (r1 * x0 - v0) * std::exp(r2 * t)) / (r1 - r2); };
}

TEST(DampedOscillatorPhysics, FollowsTheClosedFormWithOrderTwo) {
  // 2 kg on 800 N/m: ω = 20 rad/s, critical damping 80 N·s/m
  for (const double c : {4.0, 40.0, 200.0, 2000.0}) {
    const Model m = make_oscillator(2, 0.05, 1, linear(800), linear(c));
    const auto exact = damped(2, c, 800, 0.05, 1);
    double off[3], residual[3];
    // the fastest rate is c/m or ω
    const double rate = std::max(c / 2, 20.0);
    for (int i = 0; i < 3; ++i) {
      const Course course = follow(m, options_of(0.3, 0.008 / rate / (1 << i)), exact);
      off[i] = course.off;
      residual[i] = course.residual;
    }
    EXPECT_NEAR(std::log2(off[0] / off[1]), 2, 0.1) << c;
    EXPECT_NEAR(std::log2(off[1] / off[2]), 2, 0.1) << c;
    EXPECT_NEAR(std::log2(residual[1] / residual[2]), 2, 0.1) << c;
    EXPECT_LT(off[2], 1e-6 * 0.1) << c;  // (rate h)² / 4 of the way of 0.1 m
  }
}

TEST(DampedOscillatorPhysics, NonlinearDamperHasOrderTwo) {
  // a cubic damper against the decay of v alone: v' = -c v³/m, v = v0 / sqrt(1 + 2 c v0² t / m)
  Model m = make_oscillator(2, 0, 3, linear(0), polynomial({0, 0, 0, 5}));
  const auto exact = [](double t) {
    const double a = 2 * 5 * 9 / 2.0;
    return 3 * 2 / a * (std::sqrt(1 + a * t) - 1);
  };
  double off[2];
  for (int i = 0; i < 2; ++i) off[i] = follow(m, options_of(1, 4e-4 / (1 << i)), exact).off;
  EXPECT_NEAR(std::log2(off[0] / off[1]), 2, 0.15);
  EXPECT_LT(off[1], 1e-5);
}

TEST(DampedOscillatorPhysics, DampingCostsNoStep) {
  // ten free bodies in a row on bushings with damping in proportion to stiffness: from none to a coefficient over mass
  // two hundred times the frequency, at the step of the springs alone
  double undamped_step = 0;
  for (const double share : {0.0, 1e-3, 1e-1, 10.0}) {
    Model m;
    m.contact.ground = m.contact.bodies = false;
    BodyId before = kGround;
    for (int i = 0; i < 10; ++i) {
      const BodyId b = add_body(m, make_box("b" + std::to_string(i), 100, {0.5, 0.1, 0.1}, {0.5 + i, 0, 0}));
      Bushing k;
      k.a = before;
      k.b = b;
      if (i > 0) k.X_AF.p = {0.5, 0, 0};
      k.X_BM.p = {-0.5, 0, 0};
      for (int c = 0; c < 6; ++c) {
        k.spring[c] = linear(c < 3 ? 1e6 : 1e5);
        k.damper[c] = linear(share * (c < 3 ? 1e6 : 1e5));
      }
      m.bushings.push_back(k);
      before = b;
    }
    Options o = options_of(1, 0);
    double residual = 0;
    Energy last;
    o.on_frame = [&](const View& v) {
      residual = std::max(residual, std::abs(v.energy.residual));
      EXPECT_GE(v.energy.damping, last.damping - 1e-9 * v.energy.released);
      last = v.energy;
    };
    const Summary s = run(m, o);
    if (share == 0) undamped_step = s.step;
    EXPECT_EQ(s.step, undamped_step);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(s.energy_error, 1e-5) << share;  // measured 4e-6 at 0.85 of the limit
    EXPECT_EQ(last.damping > 0, share > 0);
  }
}

TEST(DampedOscillatorPhysics, DampersOnJointsCostNoStep) {
  // a row of hinged bars with springs and dampers at the hinges
  double undamped_step = 0;
  for (const double share : {0.0, 1e-2, 1.0, 100.0}) {
    Model m;
    m.contact.ground = m.contact.bodies = false;
    BodyId parent = kGround;
    for (int i = 0; i < 5; ++i) {
      const BodyId b = add_body(m, make_box("b" + std::to_string(i), 100, {0.5, 0.1, 0.1}, {0.5 + i, 0, 0}));
      Joint j;
      j.kind = Joint::Kind::Revolute;
      j.parent = parent;
      j.child = b;
      if (i > 0) j.X_PF.p = {0.5, 0, 0};
      j.X_CM.p = {-0.5, 0, 0};
      j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
      RotationalSpring r;
      r.joint = add_joint(m, j);
      r.spring = linear(1e5);
      r.damper = linear(share * 1e5);
      m.rotational_springs.push_back(r);
      parent = b;
    }
    const Summary s = run(m, options_of(1, 0));
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(s.energy_error, 3e-4) << share;  // measured 5e-5 without dampers, 1.5e-4 with, at 0.85 of the limit
    if (share == 0) undamped_step = s.step;
    EXPECT_EQ(s.step, undamped_step);
    EXPECT_EQ(s.notes.size(), share < 1 ? 0U : 1U) << share;
  }
}

/// A bar on a hinge at its end, horizontal at first and turning.
Model make_hinged_bar(double spring, double damper) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body bar = make_box("bar", 1, {1, 0.05, 0.05}, {1, 0, 0});
  bar.w_WB = {0, -0.5, 0};
  bar.v_WB = {0, 0, 0.5};
  add_body(m, bar);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.parent = kGround;
  j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
  j.X_CM.p = {-1, 0, 0};
  RotationalSpring r;
  r.joint = add_joint(m, j);
  r.spring = linear(spring);
  r.damper = linear(damper);
  m.rotational_springs.push_back(r);
  return m;
}

TEST(DampedOscillatorPhysics, DampersOnJointsHaveOrderTwo) {
  // a bar let go from the horizontal with a damper that nearly stops it
  const Model m = make_hinged_bar(10, 20);
  double angle[3], residual[3];
  for (int i = 0; i < 3; ++i) {
    Options o = options_of(1, 2e-3 / (1 << i));
    residual[i] = 0;
    o.on_frame = [&](const View& v) {
      angle[i] = v.torsion_angle[0];
      residual[i] = std::max(residual[i], std::abs(v.energy.residual));
    };
    (void)run(m, o);
  }
  EXPECT_NEAR(std::log2((angle[0] - angle[1]) / (angle[1] - angle[2])), 2, 0.15);
  EXPECT_NEAR(std::log2(residual[1] / residual[2]), 2, 0.15);
}

TEST(DampedOscillatorPhysics, WhatADamperStopsAtOnceIsBooked) {
  // far faster than the step: all energy goes in the first half of it
  const Model free = make_oscillator(1, 0, 1, linear(100), linear(1e5));
  Model jointed = make_hinged_bar(10, 1e5);
  jointed.gravity = {};
  for (const Model& m : {free, jointed})
    for (const double step : {1e-3, 2e-4}) {
      Options o = options_of(0.2, step);
      double at_start = 0, damped = 0, left = 0;
      o.on_frame = [&](const View& v) {
        if (v.time == 0) at_start = v.energy.kinetic;
        damped = v.energy.damping, left = v.energy.residual;
      };
      const Summary s = run(m, o);
      EXPECT_GT(at_start, 0.1);
      EXPECT_NEAR(damped, at_start, 1e-2 * at_start) << step;
      EXPECT_NEAR(left, 0, 1e-2 * at_start) << step;
      // on joints a pull settles within some steps, as more than the true inverse mass keeps it stable (F4)
      EXPECT_LT(s.energy_error, m.joints.empty() ? 1e-2 : 0.2) << step;
    }
}

TEST(SpringChainReference, FrequenciesAreThoseOfTheFixedFreeChain) {
  // n = 10, k = 1e6, m = 100: each mode started in its own shape swings at its frequency. The scheme's own frequency is
  // (2/h) asin(ω h/2), which is taken off; what is left is the crossings' interpolation and round-off.
  for (const auto& [mode, frequency, h] : {std::tuple{1, 2.378732758, 1e-4}, {10, 31.475462775, 1e-5}}) {
    Model m;
    m.gravity = {};
    m.contact.ground = m.contact.bodies = false;
    for (int i = 0; i < 10; ++i) {
      Body b = make_box("m", 100, {0.1, 0.1, 0.1}, {1.0 + i, 0, 0});
      b.v_WB.x = 1e-3 * std::sin((2 * mode - 1) * (i + 1) * kPi / 21);
      add_body(m, b);
      SpringDamper s;
      s.a = {i - 1};
      s.b = {i};
      s.free_length = 1;
      s.spring = linear(1e6);
      m.springs.push_back(s);
    }
    Options o = options_of(10.2 / frequency, h);
    double first = -1, last = 0, t0 = 0, x0 = 0;
    int crossings = 0;
    o.on_frame = [&, mode = mode](const View& v) {
      const double x = v.X_WB[9].p.x - 10;
      if (v.time > 0 && x0 * x < 0) {
        last = t0 + x0 / (x0 - x) * (v.time - t0);
        if (first < 0) first = last;
        ++crossings;
      }
      x0 = x;
      t0 = v.time;
    };
    const Summary s = run(m, o);
    ASSERT_EQ(crossings, 20) << mode;
    const double seen = (crossings - 1) / (2 * (last - first));
    const double freed = std::sin(kPi * seen * h) / (kPi * h);
    EXPECT_NEAR(freed, frequency, 1e-6 * frequency) << mode;
    EXPECT_NEAR(s.highest_frequency / (2 * kPi), 1.01 * 31.475462775, 1e-5 * 31.475462775);  // the solver adds 1 %
  }
}

/// Quarter period of m x'' = -f(x) from rest at x0 > 0 to the origin: ∫ dx / sqrt(2 (U(x0) - U(x)) / m) with
/// x = x0 sin s, by the midpoint rule.
double quarter_period(double mass, const Characteristic& law, double x0) {
  const CompiledCharacteristic c = compile_characteristic(law);
  constexpr int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) * kPi / 2 / n, x = x0 * std::sin(s);
    const double u = calc_integral(c, x0) - calc_integral(c, x);
    sum += x0 * std::cos(s) / std::sqrt(2 * u / mass) * (kPi / 2 / n);
  }
  return sum;
}

TEST(NonlinearSpringPhysics, SwingsWithThePeriodOfItsEnergyIntegral) {
  // a hardening Duffing spring, a cubic one and one with a corner
  for (const Characteristic& law :
       {polynomial({0, 100, 0, 5000}), polynomial({0, 0, 0, 8000}), table({-1, -0.1, 0.1, 1}, {-460, -10, 10, 460})}) {
    const Model m = make_oscillator(2, 0.3, 0, law);
    Options o = options_of(0, 1e-4);
    const double quarter = quarter_period(2, law, 0.3);
    o.duration = 1.1 * quarter;
    double crossed = 0, t0 = 0, x0 = 1, residual = 0, stored = 0;
    o.on_frame = [&](const View& v) {
      const double x = v.X_WB[0].p.x - 2;
      if (x0 > 0 && x <= 0) crossed = t0 + x0 / (x0 - x) * (v.time - t0);
      x0 = x;
      t0 = v.time;
      stored = std::max(stored, v.energy.elastic);
      residual = std::max(residual, std::abs(v.energy.residual));
    };
    (void)run(m, o);
    EXPECT_NEAR(crossed, quarter, 1e-6 * quarter);  // (ω h)²/24 at ω up to 40 rad/s: 7e-7
    EXPECT_LT(residual, 1e-4 * stored);
  }
}

TEST(NonlinearSpringPhysics, FindsItsStepFromTheMotionItHas) {
  // at rest in the middle the tangent is 100 N/m, at the amplitude that the speed leads to about 2e5 N/m
  const Model m = make_oscillator(2, 0, 30, polynomial({0, 100, 0, 5000}));
  const Course c = follow(m, options_of(1, 0), [](double) { return 0; });
  EXPECT_EQ(c.summary.ending, Summary::Ending::TimeLimit) << c.summary.message;
  EXPECT_LT(c.residual, 0.2 * 900);
}

TEST(NonlinearSpringPhysics, SaysWhenItStiffensBeyondTheStep) {
  Model m = make_oscillator(2, 0, 30, polynomial({0, 100, 0, 5000}));
  const Summary s = run(m, options_of(1, 0.05));
  EXPECT_EQ(s.ending, Summary::Ending::Diverged);
  EXPECT_NE(s.message.find("spring \"spring\" has stiffened"), std::string::npos) << s.message;
}

TEST(SpringPhysics, BreaksAtItsStrengthAndBooksItsEnergy) {
  // pulled apart at 2 m/s by 2 kg: 800 N/m reach 40 N at 50 mm, 1 J of the 4 J
  Model m = make_oscillator(2, 0, 2, linear(800), linear(3));
  m.springs[0].tension_strength = 40;
  double residual[2];
  for (int i = 0; i < 2; ++i) {
    Options o = options_of(0.1, 1e-4 / (1 << i));
    double broke = -1, x = 0, at = 0;
    std::string reason;
    Energy e;
    o.on_happening = [&](const Happening& h) {
      if (h.kind != Happening::Kind::SpringBroken) return;
      broke = h.time;
      reason = h.reason;
      EXPECT_EQ(h.index, 0);
    };
    o.on_frame = [&](const View& v) {
      if (broke < 0) x = v.spring_length[0] - 2;
      if (broke >= 0 && at == 0) {
        at = v.X_WB[0].p.x - 2;
        EXPECT_EQ(v.spring_force[0], 0);
      }
      e = v.energy;
    };
    (void)run(m, o);
    EXPECT_EQ(reason, "tension");
    EXPECT_LE(x, 0.05);
    EXPECT_GT(at, 0.05);
    EXPECT_EQ(e.elastic, 0);
    EXPECT_NEAR(e.plastic, 1, 2e-2 / (1 << i));  // 40 N over a step's way of 0.2 mm
    EXPECT_GT(e.damping, 0);
    residual[i] = std::abs(e.residual);
    EXPECT_LT(residual[i], 1e-5);
  }
  EXPECT_LT(residual[1], 0.5 * residual[0]);
}

TEST(SpringPhysics, BreaksInCompressionToo) {
  Model m = make_oscillator(2, 0, -2, linear(800));
  m.springs[0].tension_strength = 1;
  m.springs[0].compression_strength = 40;
  int broken = 0;
  Options o = options_of(0.1, 1e-4);
  o.on_happening = [&](const Happening& h) {
    if (h.kind != Happening::Kind::SpringBroken) return;
    EXPECT_EQ(h.reason, "compression");
    ++broken;
  };
  (void)run(m, o);
  EXPECT_EQ(broken, 1);
}

TEST(SpringPhysics, CarriesADeadLoadAtRest) {
  // 10 kg on a cubic spring, which is flat where the search begins: 98.1 N = 8000 x³
  Model m = make_oscillator(10, 0, 0, polynomial({0, 0, 0, 8000}));
  m.gravity = {9.81, 0, 0};
  Bushing guide;  // holds what the spring leaves free
  guide.a = kGround;
  guide.b = {0};
  guide.X_AF.p = {2, 0, 0};
  for (int c = 1; c < 6; ++c) guide.spring[c] = linear(1e6);
  m.bushings.push_back(guide);
  Options o = options_of(0.1, 5e-4);
  o.equilibrium = true;
  const double sag = std::cbrt(98.1 / 8000);
  o.on_frame = [&](const View& v) {
    EXPECT_NEAR(v.X_WB[0].p.x - 2, sag, 1e-8);
    EXPECT_NEAR(v.spring_force[0], 98.1, 1e-6);
    EXPECT_NEAR(v.ground_force.x, -98.1, 1e-6);
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  m.springs[0].tension_strength = 90;
  const Summary weak = run(m, o);
  EXPECT_EQ(weak.ending, Summary::Ending::NoEquilibrium);
  EXPECT_NE(weak.message.find("spring \"spring\" would carry"), std::string::npos) << weak.message;
}

/// A box held by cables alone, one from each of its corners outwards.
Model make_hung_box(double pretension) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const BodyId box = add_body(m, make_box("box", 10, {0.5, 0.5, 0.5}, {}));
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner{i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5};
    Cable c;
    c.name = "cable " + std::to_string(i);
    c.a = kGround, c.b = box;
    c.p_A = 3.0 * corner, c.p_B = corner;
    c.stiffness = 1e4;
    c.pretension = pretension;
    m.cables.push_back(c);
  }
  return m;
}

TEST(CablePhysics, HoldABodyAtRestByTheirPull) {
  const Model m = make_hung_box(500);
  Options o = options_of(0.05, 1e-3);
  o.equilibrium = true;
  int frames = 0;
  o.on_frame = [&](const View& v) {
    ++frames;
    EXPECT_NEAR(v.ground_force.z, 98.1, 1e-6);
    // along the diagonals 4 (k / 3) (1 + 2 N / (k l)) on either side, up to the square of the sag
    const double length = std::sqrt(3.0), across = 500 / length, stiff = 8 * (1e4 / 3 + 2.0 / 3 * across);
    EXPECT_NEAR(v.X_WB[0].p.z, -98.1 / stiff, 1e-5);
    EXPECT_LT(norm(v.w_WB[0]), 1e-9);
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_GT(frames, 1);
}

TEST(CablePhysics, AStrengthPassedAtRestIsNoEquilibrium) {
  Model m = make_hung_box(500);
  m.cables[6].strength = 400;
  Options o = options_of(0.05, 1e-3);
  o.equilibrium = true;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::NoEquilibrium);
  EXPECT_NE(s.message.find("cable \"cable 6\" would carry"), std::string::npos) << s.message;
  o.equilibrium = false;
  int broken = 0;
  o.on_happening = [&](const Happening& h) { broken += h.kind == Happening::Kind::CableBroken ? 1 : 0; };
  EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  EXPECT_EQ(broken, 1);
}

}  // namespace
}  // namespace topple::mbs
