// Bodies, joints and contact.
#include "engines/verification_cases.h"

#include <algorithm>

namespace topple::engines {

using mbs::BodyId;
using mbs::kGround;
using mbs::Model;
using mbs::View;
using Kind = mbs::Joint::Kind;

void Trace::add(double time, double value, double rate) {
  for (size_t i = 0; i + 1 < 4; ++i) last_[i] = last_[i + 1];
  last_[3] = {time, value, rate};
  if (++count_ < 4) return;
  // cubics through four equidistant values; looked at between the second and the third
  const auto weight = [](size_t i, double s) {
    double w = 1;
    for (size_t j = 0; j < 4; ++j)
      if (j != i) w *= (s - (static_cast<double>(j) - 1)) / (static_cast<double>(i) - static_cast<double>(j));
    return w;
  };
  const auto value_at = [&](double s) {
    double sum = 0;
    for (size_t i = 0; i < 4; ++i) sum += weight(i, s) * last_[i].value;
    return sum;
  };
  const auto rate_at = [&](double s) {
    double sum = 0;
    for (size_t i = 0; i < 4; ++i) sum += weight(i, s) * last_[i].rate;
    return sum;
  };
  const auto root = [](const auto& f, bool rises) {
    double a = 0, b = 1;
    for (int i = 0; i < 60; ++i) {
      const double m = 0.5 * (a + b);
      ((f(m) < 0) == rises ? a : b) = m;
    }
    return 0.5 * (a + b);
  };
  const double begin = last_[1].time, h = last_[2].time - begin;
  if ((last_[1].value > 0) != (last_[2].value > 0)) {
    const bool rises = last_[2].value > 0;
    const double s = root(value_at, rises);
    (rises ? rising : falling).push_back({begin + s * h, rate_at(s)});
  }
  if ((last_[1].rate > 0) != (last_[2].rate > 0)) {
    const double s = root(rate_at, last_[2].rate > 0);
    peaks.push_back({begin + s * h, value_at(s)});
  }
}

namespace {

constexpr const char* kStep = "step [s]";

VerificationCase make_case(const std::string& name, const std::string& model, const std::string& source, double step) {
  VerificationCase c;
  c.name = name;
  c.model = model;
  c.source = source;
  c.parameter = kStep;
  c.steps = halve(step);
  return c;
}

Vec3 direction(double angle) { return {std::sin(angle), 0, std::cos(angle)}; }

/// Adds a uniform rod of 1 m and 1 kg whose lower end is at `from`, at an angle from the upright towards +x.
BodyId add_rod(Model& m, const Vec3& from, double angle) {
  return add_mass(m, "rod" + std::to_string(m.bodies.size()), 1, {1.0 / 12, 1.0 / 12, 1e-3},
                  from + 0.5 * direction(angle), exp_rotation({0, angle, 0}));
}

Pose hinge_at(const Vec3& p) { return {p, axis_along_y()}; }

// ------------------------------------------------------------------------------------------------------------ pendulum

/// A body whose mass centre is 0.9 m from the hinge and whose inertia makes its reduced length 1 m: the point at 1 m
/// moves as the point mass does.
Model make_pendulum() {
  Model m = make_empty_model();
  const BodyId b = add_mass(m, "bob", 1, {0.09, 0.09, 0.09}, {-0.9, 0, 0});
  add_joint_at(m, Kind::Revolute, kGround, b, hinge_at({}));
  return m;
}

VerificationCase pendulum(bool is_rod) {
  VerificationCase c = make_case(
      is_rod ? "Pendulum on a distance joint" : "Pendulum on a revolute joint",
      is_rod
          ? "A point mass of 1 kg at (-1, 0), from rest, held by a distance of 1 m to the origin."
          : "A body of 1 kg on a hinge at the origin, horizontal, from rest. Its mass centre at 0.9 m and 0.09 kg m² "
            "about it "
            "give the reduced length 1 m; measured is its point at 1 m, which moves as a point mass at (-1, 0) does.",
      "IFToMM, \"simple pendulum\"; places at 1 s and 10 s and the period computed apart", 1e-3);
  c.quantities = {{"place at 1 s", "m", {0.986291751, -0.165010853}, 1e-6, 2},
                  {"place at 10 s", "m", {-0.275087463, -0.961419205}, 2e-5, 2},
                  {"period", "s", {2.367841947576}, 1e-6, 2}};
  c.measure = [is_rod](Bench& bench, double step) {
    Model m;
    Vec3 p{-0.1, 0, 0};
    if (is_rod) {
      m = make_empty_model();
      p = {};
      const BodyId b = add_mass(m, "bob", 1, {0.01, 0.01, 0.01}, {-1, 0, 0});
      mbs::Joint j;
      j.kind = Kind::Distance;
      j.name = "rod";
      j.parent = kGround;
      j.child = b;
      mbs::add_joint(m, j);
    } else {
      m = make_pendulum();
    }
    Values out{{NAN, NAN}, {NAN, NAN}, {NAN}};
    Trace x;
    mbs::Options o = make_options(10, step);
    o.on_frame = [&](const View& v) {
      const Vec3 at = v.X_WB[0] * p;
      const Vec3 speed = v.v_WB[0] + cross(v.w_WB[0], at - v.X_WB[0].p);
      x.add(v.time, at.x, speed.x);
      if (std::abs(v.time - 1) < 0.5 * step) out[0] = {at.x, at.z};
      if (std::abs(v.time - 10) < 0.5 * step) out[1] = {at.x, at.z};
    };
    if (bench.run(m, o) && x.rising.size() > 1) out[2] = {x.rising[1].time - x.rising[0].time};
    return out;
  };
  return c;
}

// ---------------------------------------------------------------------------------------------------------------- rods

VerificationCase two_rods() {
  VerificationCase c = make_case("Two rods in a row",
                                 "Two uniform rods of 1 m and 1 kg, hinged to the ground and to each other, from rest, "
                                 "both horizontal. Angles are "
                                 "from the downward vertical. The motion is chaotic: compared only to 2 s.",
                                 "Lagrange's equations of the double rod, computed apart", 5e-4);
  c.quantities = {{"angles at 1 s", "rad", {-1.207716238, -0.814391023}, 1e-6, 2},
                  {"angular velocities at 1 s", "rad/s", {-3.406517533, -0.516045472}, 1e-5, 2},
                  {"angles at 2 s", "rad", {-0.082758307, 0.407362075}, 5e-6, 2},
                  {"largest residual of the energy balance in 2 s", "J", {0}, 3e-5, 2}};
  c.measure = [](Bench& bench, double step) {
    Model m = make_empty_model();
    // along +x from the ground: the angle from the downward vertical is 90°
    const BodyId a = add_rod(m, {}, kPi / 2), b = add_rod(m, {1, 0, 0}, kPi / 2);
    add_joint_at(m, Kind::Revolute, kGround, a, hinge_at({}));
    add_joint_at(m, Kind::Revolute, a, b, hinge_at({1, 0, 0}));
    Values out{{NAN, NAN}, {NAN, NAN}, {NAN, NAN}, {0}};
    mbs::Options o = make_options(2, step);
    o.on_frame = [&](const View& v) {
      const auto angle = [&](size_t i) {
        const Vec3 along = to_matrix(v.X_WB[i].q) * Vec3{0, 0, 1};
        return std::atan2(along.x, -along.z);
      };
      if (std::abs(v.time - 1) < 0.5 * step) {
        out[0] = {angle(0), angle(1)};
        out[1] = {-v.w_WB[0].y, -v.w_WB[1].y};
      }
      if (std::abs(v.time - 2) < 0.5 * step) out[2] = {angle(0), angle(1)};
      out[3][0] = std::max(out[3][0], std::abs(v.energy.residual));
    };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

VerificationCase toppling_rod() {
  VerificationCase c = make_case("Rod toppling about a hinge",
                                 "A uniform rod of 1 m, hinged at its foot, from rest 5° from the upright.",
                                 "ω² = (3 g / L) (cos θ0 - cos θ); the time by Simpson's rule over √(θ - θ0)", 4e-3);
  const double start = kPi / 36;
  const auto speed = [=](double angle) { return std::sqrt(3 * kGravity * (std::cos(start) - std::cos(angle))); };
  const double t90 = integrate(
      [&](double u) { return u > 0 ? 2 * u / speed(start + u * u) : 2 / std::sqrt(3 * kGravity * std::sin(start)); }, 0,
      std::sqrt(kPi / 2 - start));
  c.quantities = {{"time at 90°", "s", {t90}, 2e-7, 2}, {"angular velocity there", "rad/s", {speed(kPi / 2)}, 2e-5, 2}};
  c.measure = [](Bench& bench, double step) {
    Model m = make_empty_model();
    add_joint_at(m, Kind::Revolute, kGround, add_rod(m, {}, kPi / 36), hinge_at({}));
    Trace z;
    mbs::Options o = make_options(1, step);
    o.on_frame = [&](const View& v) { z.add(v.time, v.X_WB[0].p.z, v.v_WB[0].z); };
    if (!bench.run(m, o) || z.falling.empty()) return Values{{NAN}, {NAN}};
    return Values{{z.falling[0].time}, {-z.falling[0].rate / 0.5}};
  };
  return c;
}

VerificationCase four_bar() {
  VerificationCase c =
      make_case("Four-bar linkage with two windows",
                "Three vertical and two horizontal rods of 1 m and 1 kg with hinges about parallel axes (six of them, "
                "two loops); the top "
                "of the first moves with 1 m/s at the start. When all rods lie in one line the linkage could branch.",
                "IFToMM, \"N four-bar mechanism\", N = 2; the first time in one line from the energy, "
                "∫ dθ / √(1 + 7 g (1 - cos θ) / 3)",
                1e-3);
  const double singular =
      integrate([](double a) { return 1 / std::sqrt(1 + 7 * kGravity * (1 - std::cos(a)) / 3); }, 0, kPi / 2);
  const auto speed = [](double a) { return std::sqrt(1 + 7 * kGravity * (1 - std::cos(a)) / 3); };
  c.quantities = {{"first time in one line", "s", {singular}, 1e-7, 2},
                  {"speed of the top there", "m/s", {speed(kPi / 2)}, 1e-5, 0},
                  {"place of the top at 10 s", "m", {0.328458112, 0.944518538}, 1e-5, 2},
                  {"velocity of the top at 10 s", "m/s", {1.423051470, -0.494868845}, 1e-5, 2},
                  {"largest residual of the energy balance in 10 s", "J", {0}, 1e-4, 2}};
  c.remark =
      "In one line the reactions become ambiguous, and with them the acceleration by which the speed of a half step is "
      "carried to the "
      "frame: in the two or three frames next to that position the error of the speed scatters by up to its own size, "
      "10 to 30 "
      "h² instead of 14 h². Before and after it is of second order, and so is the motion, so no order is claimed "
      "there.";
  c.measure = [](Bench& bench, double step) {
    Model m = make_empty_model();
    BodyId link[3], coupler[2];
    for (int i = 0; i < 3; ++i) {
      link[i] = add_rod(m, {1.0 * i, 0, 0}, 0);
      mbs::Body& b = m.bodies.back();
      b.w_WB = {0, 1, 0};
      b.v_WB = {0.5, 0, 0};
      add_joint_at(m, Kind::Revolute, kGround, link[i], hinge_at({1.0 * i, 0, 0}));
    }
    for (int i = 0; i < 2; ++i) {
      coupler[i] = add_rod(m, {1.0 * i, 0, 1}, kPi / 2);
      m.bodies.back().v_WB = {1, 0, 0};
    }
    add_joint_at(m, Kind::Revolute, link[0], coupler[0], hinge_at({0, 0, 1}));
    add_joint_at(m, Kind::Revolute, coupler[0], link[1], hinge_at({1, 0, 1}));
    add_joint_at(m, Kind::Revolute, link[1], coupler[1], hinge_at({1, 0, 1}));
    add_joint_at(m, Kind::Revolute, coupler[1], link[2], hinge_at({2, 0, 1}));
    Values out{{NAN}, {NAN}, {NAN, NAN}, {NAN, NAN}, {0}};
    Trace z;
    mbs::Options o = make_options(10, step);
    o.on_frame = [&](const View& v) {
      const Vec3 top = v.X_WB[0] * Vec3{0, 0, 0.5};
      const Vec3 u = v.v_WB[0] + cross(v.w_WB[0], top - v.X_WB[0].p);
      z.add(v.time, top.z, u.z);
      out[4][0] = std::max(out[4][0], std::abs(v.energy.residual));
      if (std::abs(v.time - 10) < 0.5 * step) {
        out[2] = {top.x, top.z};
        out[3] = {u.x, u.z};
      }
    };
    if (bench.run(m, o) && !z.falling.empty()) {
      out[0] = {z.falling[0].time};
      out[1] = {-z.falling[0].rate};
    }
    return out;
  };
  return c;
}

// ---------------------------------------------------------------------------------------------------------------- tops

VerificationCase free_top() {
  VerificationCase c = make_case("Top without torque",
                                 "A free body with principal moments 1, 2, 3 kg m², turning with (0.1, 1, 0.1) rad/s.",
                                 "Euler's equations (Jacobi's elliptic functions), computed apart", 2e-3);
  c.quantities = {
      {"angular velocity at 10 s, in its axes", "rad/s", {-0.304543317, -0.957733454, 0.193861318}, 3e-7, 2}};
  c.measure = [](Bench& bench, double step) {
    Model m = make_empty_model({});
    add_mass(m, "top", 1, {1, 2, 3}, {});
    m.bodies[0].w_WB = {0.1, 1, 0.1};
    Values out{{NAN, NAN, NAN}};
    mbs::Options o = make_options(10, step, 10);
    o.on_frame = [&](const View& v) {
      const Vec3 w = transpose_times(to_matrix(v.X_WB[0].q), v.w_WB[0]);
      out[0] = {w.x, w.y, w.z};
    };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

VerificationCase steady_top(bool is_fast) {
  const double rate = is_fast ? 8.513747516 : 1.108756970, theta = kPi / 6, spin = 20;
  VerificationCase c = make_case(is_fast ? "Steady precession, fast" : "Steady precession, slow",
                                 "A top of 1 kg on a spherical joint, its mass centre 1 m away, 0.2, 0.2 and 0.5 kg m² "
                                 "about it, leaning by 30°, turning "
                                 "with 20 rad/s about its axis.",
                                 "(Jt + m l²) cos θ Ω² - Ja ω3 Ω + m g l = 0", 1e-3);
  c.quantities = {{"mean rate of precession in 1 s", "rad/s", {rate}, is_fast ? 1e-4 : 2e-6, 2},
                  {"largest error of the height of the mass centre in 1 s", "m", {0}, 1e-6, 2}};
  c.measure = [=](Bench& bench, double step) {
    Model m = make_empty_model();
    const Quat q = exp_rotation({0, theta, 0});
    const Vec3 axis = direction(theta);
    const BodyId b = add_mass(m, "top", 1, {0.2, 0.2, 0.5}, axis, q);
    mbs::Body& top = m.bodies.back();
    const Vec3 up{0, 0, 1};
    top.w_WB = rate * up + (spin - rate * std::cos(theta)) * axis;
    top.v_WB = cross(top.w_WB, axis);
    add_joint_at(m, Kind::Spherical, kGround, b, {});
    Values out{{NAN}, {0}};
    double turned = 0, before = 0;
    mbs::Options o = make_options(1, step);
    o.on_frame = [&](const View& v) {
      const Vec3& p = v.X_WB[0].p;
      const double azimuth = std::atan2(p.y, p.x);
      turned += std::remainder(azimuth - before, 2 * kPi);
      before = azimuth;
      out = {{v.time > 0 ? turned / v.time : NAN}, {std::max(out[1][0], std::abs(p.z - std::cos(theta)))}};
    };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

VerificationCase chimney() {
  VerificationCase c =
      make_case("Bending moment in a toppling chimney",
                "A uniform prismatic chimney of 30 m and 90 t in four pieces welded at a quarter, a third and half of "
                "its height H, "
                "hinged at its foot, from rest 5° from the upright, at 1.6 s. Measured are the moments of the welds.",
                "Varieschi & Kamiya, American Journal of Physics 71 (2003) 1025: M = m g H sin θ x (1 - x)² / 4, "
                "largest at x = 1/3 "
                "with m g H sin θ / 27",
                4e-3);
  const auto moment = [](double x) { return x * (1 - x) * (1 - x) / 4; };
  c.quantities = {{"M / (m g H sin θ) at x = 1/4, 1/3, 1/2", "", {moment(0.25), 1.0 / 27, moment(0.5)}, 1e-9, 0}};
  c.remark =
      "The moments follow from the angle alone, and reactions belong to the places of the same instant, so that no "
      "error of the "
      "step is left.";
  c.measure = [](Bench& bench, double step) {
    const double H = 30, mass = 90e3, start = kPi / 36;
    const double cut[5] = {0, 0.25, 1.0 / 3, 0.5, 1};
    Model m = make_empty_model();
    const Quat q = exp_rotation({0, start, 0});
    BodyId before = kGround;
    for (int i = 0; i < 4; ++i) {
      const double length = H * (cut[i + 1] - cut[i]), part = mass * (cut[i + 1] - cut[i]);
      const double J = part * length * length / 12;
      const Vec3 foot = H * cut[i] * direction(start);
      const BodyId b =
          add_mass(m, "piece" + std::to_string(i), part, {J, J, 0.01 * J}, foot + 0.5 * length * direction(start), q);
      add_joint_at(m, i == 0 ? Kind::Revolute : Kind::Fixed, before, b, hinge_at(foot));
      before = b;
    }
    Values out{{NAN, NAN, NAN}};
    mbs::Options o = make_options(1.6, step, 1.6);
    o.on_frame = [&](const View& v) {
      if (v.joint_moment.size() < 4) return;
      const double sine = (to_matrix(v.X_WB[0].q) * Vec3{0, 0, 1}).x;
      for (size_t i = 0; i < 3; ++i) out[0][i] = norm(v.joint_moment[i + 1]) / (mass * kGravity * H * sine);
    };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

// ------------------------------------------------------------------------------------------------------------- contact

VerificationCase bounce() {
  VerificationCase c = make_case("Bouncing ball",
                                 "A ball of 10 kg dropped from 10 m on rigid ground, restitution 0.5 (Poisson). The "
                                 "frequency of the contact is 0.02 / "
                                 "step, so that it hardens as the step falls.",
                                 "√(2 h / g) times 1, 2, 2.5", 1e-5);
  const double fall = std::sqrt(2 * 10 / kGravity);
  c.quantities = {{"first impact", "s", {fall}, 1e-9, 0},
                  {"second impact", "s", {2 * fall}, 4e-4, 1},
                  {"third impact", "s", {2.5 * fall}, 4e-4, 1}};
  c.remark =
      "A contact lasts about π (1 + 1/e) / (2 ω), which delays the impacts after it, and the weight acts meanwhile, "
      "which "
      "lowers the rebound. Both fall with 1/ω, and ω grows with 1/step here: first order. Free fall to the first "
      "impact has no "
      "error of the step.";
  c.measure = [](Bench& bench, double step) {
    Model m;
    m.contact.bodies = false;
    m.contact.restitution = 0.5;
    m.contact.contact_frequency = 0.02 / step;
    add_mass(m, "ball", 10, {0.04, 0.04, 0.04}, {0, 0, 10.1});
    mbs::Shape s;
    s.kind = mbs::Shape::Kind::Sphere;
    s.radius = 0.1;
    m.bodies[0].shapes = {s};
    Trace gap;
    mbs::Options o = make_options(3.6, step);
    o.on_frame = [&](const View& v) { gap.add(v.time, v.X_WB[0].p.z - 0.1, v.v_WB[0].z); };
    if (!bench.run(m, o) || gap.falling.size() < 3) return Values{{NAN}, {NAN}, {NAN}};
    return Values{{gap.falling[0].time}, {gap.falling[1].time}, {gap.falling[2].time}};
  };
  return c;
}

VerificationCase slope() {
  VerificationCase c =
      make_case("Box on a slope",
                "A flat box of 100 kg on a plane of 30°, friction 0.3: from rest, and thrown uphill with 5 m/s. "
                "The frequency of the contact is 0.2 / step.",
                "a = g (sin α - μ cos α); uphill v / a' and v² / (2 a') with a' = g (sin α + μ cos α)", 4e-4);
  const double uphill = kGravity * (0.5 + 0.15 * std::sqrt(3.0));
  c.quantities = {{"acceleration from 0.5 s to 1 s", "m/s²", {kGravity * (0.5 - 0.15 * std::sqrt(3.0))}, 1e-6, 0},
                  {"thrown uphill, stops after", "s", {5 / uphill}, 1e-4, 1},
                  {"thrown uphill, stops at", "m", {12.5 / uphill}, 1e-6, 2}};
  c.remark =
      "The box starts without penetration and sinks in by δ = g cos α / (2 (1 + r) ω²), r = e² = 0.01 (equation 1 of "
      "[contact](theory/contact.md)). Friction lacks until then, so the way grows by μ δ, 3.2e-7 m at the finest step: "
      "second "
      "order, as ω grows with 1/step. Friction stops what slides within a step or two: first order in the time of the "
      "stop, and "
      "its tolerance is one step. Steady sliding has no error.";
  c.measure = [](Bench& bench, double step) {
    const double a = kPi / 6;
    const Vec3 normal{std::sin(a), 0, std::cos(a)}, down{std::cos(a), 0, -std::sin(a)};
    Model m;
    m.contact.bodies = false;
    m.contact.normal = normal;
    m.contact.friction = 0.3;
    m.contact.contact_frequency = 0.2 / step;
    const Vec3 half{1, 1, 0.05};
    add_mass(m, "box", 100, {100.0 / 3 * (1 + 0.0025), 100.0 / 3 * (1 + 0.0025), 200.0 / 3}, 0.05 * normal,
             exp_rotation({0, a, 0}));
    mbs::Shape s;
    s.half = half;
    m.bodies[0].shapes = {s};
    Values out{{NAN}, {NAN}, {NAN}};
    double at_half = NAN;
    mbs::Options o = make_options(1, step);
    o.on_frame = [&](const View& v) {
      const double speed = dot(v.v_WB[0], down);
      if (std::abs(v.time - 0.5) < 0.5 * step) at_half = speed;
      if (std::abs(v.time - 1) < 0.5 * step) out[0] = {(speed - at_half) / 0.5};
    };
    if (!bench.run(m, o)) return out;
    m.bodies[0].v_WB = -5 * down;
    Trace way;
    o.on_frame = [&](const View& v) {
      way.add(v.time, -dot(v.X_WB[0].p - m.bodies[0].X_WB.p, down), -dot(v.v_WB[0], down));
    };
    if (bench.run(m, o) && !way.peaks.empty()) out[1] = {way.peaks[0].time}, out[2] = {way.peaks[0].value};
    return out;
  };
  return c;
}

}  // namespace

void add_motion_cases(std::vector<VerificationCase>& list) {
  list.push_back(pendulum(false));
  list.push_back(pendulum(true));
  list.push_back(two_rods());
  list.push_back(toppling_rod());
  list.push_back(four_bar());
  list.push_back(free_top());
  list.push_back(steady_top(false));
  list.push_back(steady_top(true));
  list.push_back(chimney());
}

void add_contact_cases(std::vector<VerificationCase>& list) {
  list.push_back(bounce());
  list.push_back(slope());
}

std::vector<VerificationCase> make_verification_cases() {
  std::vector<VerificationCase> list;
  add_motion_cases(list);
  add_force_cases(list);
  add_structure_cases(list);
  add_contact_cases(list);
  return list;
}

}  // namespace topple::engines
