// Force elements, loads and structures of them.
#include <algorithm>
#include <array>

#include "engines/verification_cases.h"

namespace topple::engines {

using mbs::BodyId;
using mbs::kGround;
using mbs::Model;
using mbs::View;
using Kind = mbs::Joint::Kind;

namespace {

VerificationCase make_case(const std::string& name, const std::string& model, const std::string& source, double step) {
  VerificationCase c;
  c.name = name;
  c.model = model;
  c.source = source;
  c.parameter = "step [s]";
  c.steps = step > 0 ? halve(step) : std::vector<double>{0};
  return c;
}

/// A mass on a spring-damper along x that is slack at x = 0.
Model make_oscillator(double mass, double stiffness, double damping) {
  Model m = make_empty_model({});
  add_mass(m, "mass", mass, {1, 1, 1}, {});
  mbs::SpringDamper s;
  s.name = "spring";
  s.a = kGround;
  s.b = {0};
  s.p_A = {-10, 0, 0};
  s.free_length = 10;
  s.spring.rate = stiffness;
  s.damper.rate = damping;
  m.springs.push_back(s);
  return m;
}

VerificationCase oscillator(const std::string& name, double ratio) {
  const double omega = 10, v0 = 1, t = 1;
  // x(0) = 0, v(0) = 1 m/s
  const double decay = std::exp(-ratio * omega * t);
  const double wd = omega * std::sqrt(std::abs(1 - ratio * ratio));
  const double sine = ratio < 1 ? std::sin(wd * t) : std::sinh(wd * t),
               cosine = ratio < 1 ? std::cos(wd * t) : std::cosh(wd * t);
  const double x = v0 * decay * sine / wd, v = v0 * decay * (cosine - ratio * omega / wd * sine);
  VerificationCase c =
      make_case(name,
                "2 kg on a spring of 200 N/m (ω = 10 rad/s) with " +
                    std::string(ratio < 1 ? "a tenth of" : "twice the") + " critical damping, thrown with 1 m/s.",
                ratio < 1 ? "x = v0 exp(-ζωt) sin(ωd t) / ωd" : "x = v0 exp(-ζωt) sinh(ω' t) / ω'", 2e-3);
  c.quantities = {{"place at 1 s", "m", {x}, ratio < 1 ? 1e-6 : 1e-9, 2},
                  {"velocity at 1 s", "m/s", {v}, ratio < 1 ? 5e-6 : 3e-9, 2}};
  c.measure = [=](Bench& bench, double step) {
    Model m = make_oscillator(2, 200, 2 * ratio * omega * 2);
    m.bodies[0].v_WB = {v0, 0, 0};
    Values out{{NAN}, {NAN}};
    mbs::Options o = make_options(t, step, t);
    o.on_frame = [&](const View& view) { out = {{view.X_WB[0].p.x}, {view.v_WB[0].x}}; };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

VerificationCase duffing() {
  const double mass = 2, k = 200, k3 = 5000, A = 0.4;
  // x = A sin φ: T = 4 ∫ dφ / √(k/m + k3/m A² (1 + sin² φ) / 2)
  const double period = 4 * integrate(
                                [&](double a) {
                                  const double s = std::sin(a);
                                  return 1 / std::sqrt(k / mass + k3 / mass * A * A * 0.5 * (1 + s * s));
                                },
                                0, kPi / 2);
  VerificationCase c = make_case(
      "Duffing's oscillator",
      "2 kg on a spring with the force 200 x + 5000 x³ N, let go at 0.4 m: the cubic part is four times the other.",
      "T = 4 ∫ dφ / √(k/m + k3 A² (1 + sin² φ) / (2 m)) from 0 to π/2, evaluated by Simpson's rule", 1e-3);
  c.quantities = {{"period, mean of five", "s", {period}, 1e-6, 2}};
  c.measure = [=](Bench& bench, double step) {
    Model m = make_oscillator(mass, 0, 0);
    m.springs[0].spring.kind = mbs::Characteristic::Kind::Polynomial;
    m.springs[0].spring.coefficients = {0, k, 0, k3};
    m.bodies[0].X_WB.p = {A, 0, 0};
    Trace x;
    mbs::Options o = make_options(3, step);
    o.on_frame = [&](const View& v) { x.add(v.time, v.X_WB[0].p.x, v.v_WB[0].x); };
    if (!bench.run(m, o) || x.falling.size() < 6) return Values{{NAN}};
    return Values{{(x.falling[5].time - x.falling[0].time) / 5}};
  };
  return c;
}

VerificationCase ramp() {
  const double k = 200, omega = 10, F = 40, rise = 0.4, t = 1;
  const double x = F / k * (1 + (std::sin(omega * (t - rise)) - std::sin(omega * t)) / (omega * rise));
  const double v = F / k * (std::cos(omega * (t - rise)) - std::cos(omega * t)) / rise;
  VerificationCase c =
      make_case("Load by a table", "2 kg on a spring of 200 N/m; a load grows to 40 N within 0.4 s and stays.",
                "x = F/k (1 + (sin ω(t - tr) - sin ωt) / (ω tr)), the response to a ramp", 2e-3);
  c.quantities = {{"place at 1 s", "m", {x}, 2e-6, 2}, {"velocity at 1 s", "m/s", {v}, 1e-5, 2}};
  c.measure = [=](Bench& bench, double step) {
    Model m = make_oscillator(2, k, 0);
    mbs::Load l;
    l.name = "load";
    l.body = {0};
    l.force = {F, 0, 0};
    l.time = {0, rise};
    l.factor = {0, 1};
    m.loads.push_back(l);
    Values out{{NAN}, {NAN}};
    mbs::Options o = make_options(t, step, t);
    o.on_frame = [&](const View& view) { out = {{view.X_WB[0].p.x}, {view.v_WB[0].x}}; };
    (void)bench.run(m, o);
    return out;
  };
  return c;
}

/// First peak over P / k of a mass whose weight P comes at once on a spring that yields at P / ratio; 0: elastic.
double find_peak(Bench& bench, double ratio, double step) {
  const double k = 1e6, mass = 1000, P = mass * kGravity;
  Model m = make_empty_model();
  add_mass(m, "mass", mass, {10, 10, 10}, {});
  mbs::ZoneElement e;
  e.name = "spring";
  e.a = kGround;
  e.b = {0};
  e.X_AF.q = e.X_BM.q = axis_along_y();  // x upwards
  e.translational_stiffness = {k, k, k};
  e.rotational_stiffness = {1e6, 1e6, 1e6};
  e.damping_ratio = 0;
  if (ratio > 0) {
    mbs::ZoneLaw law;
    law.name = "plastic";
    law.compression = {{0, 10}, {P / ratio, P / ratio}};
    law.tension = law.compression;
    e.stations = {{0, mbs::add_law(m, law)}};
  }
  mbs::add_element(m, e);
  Trace z;
  mbs::Options o = make_options(0.5, step);
  o.on_frame = [&](const View& v) { z.add(v.time, v.X_WB[0].p.z, v.v_WB[0].z); };
  if (!bench.run(m, o) || z.peaks.empty()) return NAN;
  return -z.peaks[0].value / (P / k);
}

VerificationCase sudden_load() {
  VerificationCase c = make_case("Suddenly applied load",
                                 "A mass of 1 t whose weight P comes at once on a zone of 1 MN/m that yields at Rp: "
                                 "largest over static displacement if it "
                                 "stays elastic, else largest displacement over that at yield.",
                                 "elastic 2; elastic-plastic 0.5 / (1 - P/Rp) (balance of energy)", 4e-4);
  c.quantities = {{"elastic", "", {2}, 1e-9, 0}};
  const std::vector<double> ratios{0.6, 0.7, 0.8, 0.9};
  for (const double r : ratios)
    c.quantities.push_back(
        {"P/Rp = 0." + std::to_string(std::lround(10 * r)), "", {0.5 / (1 - r)}, r < 0.85 ? 1e-5 : 3e-5, 0});
  c.remark =
      "The elastic peak is twice the static displacement whatever the step: the method keeps the energy of a linear "
      "oscillator "
      "that is seen at its turning points; what is left is interpolation. With yielding the errors fall about with the "
      "square of the step "
      "but not evenly, since the zone begins to yield somewhere within a step: no order is claimed.";
  c.measure = [ratios](Bench& bench, double step) {
    Values out{{find_peak(bench, 0, step)}};
    for (const double r : ratios) out.push_back({find_peak(bench, r, step) * r});
    return out;
  };
  return c;
}

// --------------------------------------------------------------------------------------------------------------- chain

VerificationCase chain(int mode) {
  const int swings = mode == 1 ? 10 : 100;
  const double exact = mode == 1 ? 2.378732758 : 31.475462775;
  VerificationCase c = make_case(
      mode == 1 ? "Chain of springs, lowest mode" : "Chain of springs, highest mode",
      "Ten masses of 100 kg in a row on ten springs of 1 MN/m, fixed at one end, thrown in the shape of the mode.",
      "f_i = √(k/m) sin((2 i - 1) π / 42) / π", mode == 1 ? 4e-4 : 4e-5);
  c.quantities = {{mode == 1 ? "f1 by ten swings" : "f10 by a hundred swings", "Hz", {exact}, 1e-6 * exact, 2}};
  c.measure = [=](Bench& bench, double step) {
    Model m = make_empty_model({});
    for (int i = 0; i < 10; ++i) {
      add_mass(m, "m" + std::to_string(i), 100, {1, 1, 1}, {1.0 + i, 0, 0});
      m.bodies.back().v_WB.x = 0.01 * std::sin((i + 1) * (2 * mode - 1) * kPi / 21);
      mbs::SpringDamper s;
      s.name = "k" + std::to_string(i);
      s.a = i == 0 ? kGround : BodyId{i - 1};
      s.b = {i};
      s.free_length = 1;
      s.spring.rate = 1e6;
      m.springs.push_back(s);
    }
    Trace x;
    mbs::Options o = make_options(mode == 1 ? 4.8 : 3.6, step);
    o.on_frame = [&](const View& v) { x.add(v.time, v.X_WB[9].p.x - 10, v.v_WB[9].x); };
    const size_t n = static_cast<size_t>(swings);
    if (!bench.run(m, o) || x.falling.size() <= n) return Values{{NAN}};
    return Values{{swings / (x.falling[n].time - x.falling[0].time)}};
  };
  return c;
}

// ---------------------------------------------------------------------------------------------------------- cantilever

constexpr double kLength = 10, kSide = 0.4, kModulus = 30e9, kDensity = 2500;
const double kBending = kModulus * std::pow(kSide, 4) / 12;  // EI [N·m²]

/// Places of the n hinges, at the centres of cells, and the tip's.
std::vector<double> find_cuts(int n) {
  std::vector<double> cuts;
  for (int i = 0; i < n; ++i) cuts.push_back((i + 0.5) * kLength / n);
  cuts.push_back(kLength);
  return cuts;
}

/// Sag of the tip under 10 kN, from that under 0.1 kN: rigid segments on bushings that only turn.
double find_sag(Bench& bench, int n) {
  const double share = 0.01;
  const std::vector<double> cuts = find_cuts(n);
  Model m = make_empty_model({});
  BodyId before = kGround;
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    const double a = cuts[i], b = cuts[i + 1], mass = kDensity * kSide * kSide * (b - a),
                 J = mass * (b - a) * (b - a) / 12;
    const BodyId body = add_mass(m, "s" + std::to_string(i), mass, {J, J, J}, {0.5 * (a + b), 0, 0});
    mbs::Bushing k;
    k.name = "k" + std::to_string(i);
    k.a = before;
    k.b = body;
    k.X_AF.p = Vec3{a, 0, 0} - (before == kGround ? Vec3{} : m.bodies[i - 1].X_WB.p);
    k.X_BM.p = Vec3{a, 0, 0} - m.bodies[i].X_WB.p;
    for (int j = 0; j < 3; ++j) k.spring[j].rate = 1e14;
    for (int j = 3; j < 6; ++j) k.spring[j].rate = kBending * n / kLength;
    m.bushings.push_back(k);
    before = body;
  }
  mbs::Load l;
  l.name = "load";
  l.body = before;
  const Vec3 tip{kLength, 0, 0};
  l.p_B = tip - m.bodies.back().X_WB.p;
  l.force = {0, 0, -10e3 * share};
  m.loads.push_back(l);
  mbs::Options o = make_options(0, 0, 1);
  o.equilibrium = true;
  double sag = NAN;
  o.on_frame = [&](const View& v) { sag = -(v.X_WB.back() * l.p_B).z / share; };
  return bench.run(m, o) ? sag : NAN;
}

/// Rigid segments on hinges with torsion springs, swinging in their lowest mode: its frequency [Hz].
double find_frequency(Bench& bench, int n, double step) {
  const std::vector<double> cuts = find_cuts(n);
  const size_t N = static_cast<size_t>(n);
  Model m = make_empty_model({});
  BodyId before = kGround;
  for (size_t i = 0; i < N; ++i) {
    const double a = cuts[i], b = cuts[i + 1], mass = kDensity * kSide * kSide * (b - a),
                 J = mass * (b - a) * (b - a) / 12;
    const BodyId body = add_mass(m, "s" + std::to_string(i), mass, {0.01 * J, J, J}, {0.5 * (a + b), 0, 0});
    mbs::RotationalSpring k;
    k.name = "k" + std::to_string(i);
    k.joint = add_joint_at(m, Kind::Revolute, before, body, {{a, 0, 0}, axis_along_y()});
    k.spring.rate = kBending * n / kLength;
    m.rotational_springs.push_back(k);
    before = body;
  }
  // shape of the lowest mode in the angles of the hinges, by iteration with K⁻¹ M (K is a multiple of 1)
  std::vector<double> shape(N, 1.0), lift(N), turn(N);
  for (int round = 0; round < 200; ++round) {
    for (size_t i = 0; i < N; ++i) {
      lift[i] = turn[i] = 0;
      for (size_t j = 0; j <= i; ++j) {
        lift[i] += shape[j] * (0.5 * (cuts[i] + cuts[i + 1]) - cuts[j]);
        turn[i] += shape[j];
      }
    }
    double length = 0;
    for (size_t j = 0; j < N; ++j) {
      double sum = 0;
      for (size_t i = j; i < N; ++i)
        sum += m.bodies[i].mass * lift[i] * (0.5 * (cuts[i] + cuts[i + 1]) - cuts[j]) +
               m.bodies[i].inertia(1, 1) * turn[i];
      shape[j] = sum;
      length += sum * sum;
    }
    for (double& s : shape) s /= std::sqrt(length);
  }
  for (size_t i = 0; i < N; ++i) {
    // turning about +y by φ moves what lies along +x downwards
    m.bodies[i].v_WB = {0, 0, -1e-3 * lift[i]};
    m.bodies[i].w_WB = {0, 1e-3 * turn[i], 0};
  }
  Trace z;
  mbs::Options o = make_options(0.56, step);
  o.on_frame = [&](const View& v) { z.add(v.time, v.X_WB.back().p.z, v.v_WB.back().z); };
  if (!bench.run(m, o) || z.rising.empty() || z.falling.empty()) return NAN;
  return 0.5 / std::abs(z.rising[0].time - z.falling[0].time);
}

VerificationCase cantilever_cells() {
  VerificationCase c = make_case(
      "Cantilever, sag against the length of its cells",
      "10 m, 0.4 m x 0.4 m, E = 30 GPa, 10 kN at the tip (measured under 0.1 kN, so that it stays straight): rigid "
      "segments on bushings at the centres of n cells, in equilibrium.",
      "P L³ / (3 EI); discrete P L³ / (3 EI) (1 - 1 / (4 n²))", 0);
  c.parameter = "length of a cell [m], n = 4, 8, 16";
  c.steps = halve(2.5);
  c.quantities = {{"sag of the tip", "m", {0.052083333333}, 6e-5, 2}};
  c.measure = [](Bench& bench, double cell) {
    return Values{{find_sag(bench, static_cast<int>(std::lround(kLength / cell)))}};
  };
  return c;
}

VerificationCase cantilever_discrete() {
  VerificationCase c =
      make_case("Cantilever, sag against the discrete values", "The same with 8 and 16 cells; nothing is stepped.",
                "P L³ / (3 EI) (1 - 1 / (4 n²)), computed apart", 0);
  c.quantities = {{"sag of the tip, n = 8", "m", {0.051879883}, 1e-8, 0}, {"n = 16", "m", {0.052032471}, 1e-8, 0}};
  c.measure = [](Bench& bench, double) { return Values{{find_sag(bench, 8)}, {find_sag(bench, 16)}}; };
  return c;
}

VerificationCase cantilever_frequency(int n) {
  VerificationCase c =
      make_case(n == 8 ? "Cantilever, lowest frequency, 8 cells" : "Cantilever, lowest frequency, 16 cells",
                "The same cantilever, 2500 kg/m³, of rigid segments on hinges with torsion springs, thrown in its "
                "lowest mode; f1 by half a "
                "swing. The continuous beam has 2.238364840 Hz.",
                "eigenvalues of the discrete beam, computed apart", n == 8 ? 4e-4 : 2e-4);
  c.quantities = {{"f1", "Hz", {n == 8 ? 2.246414080 : 2.240372358}, 1e-6, 2}};
  c.measure = [n](Bench& bench, double step) { return Values{{find_frequency(bench, n, step)}}; };
  return c;
}

// -------------------------------------------------------------------------------------------------------------- portal

/// Sway stiffness of a portal pushed at one corner, there [N/m].
double find_sway(Bench& bench, bool is_extensible) {
  const double h = 3.5, L = 6;
  const double column = std::pow(0.4, 4) / 12, beam = 0.3 * std::pow(0.6, 3) / 12;
  Model m = make_empty_model({});
  for (int i = 0; i < 2; ++i) add_mass(m, "corner" + std::to_string(i), 1000, {10, 10, 10}, {i * L, 0, h});
  const auto member = [&](BodyId a, BodyId b, const Vec3& from, const Vec3& to, double I, double A) {
    const double length = norm(to - from);
    const Vec3 x = (1 / length) * (to - from), z{0, 1, 0};
    const Pose middle{0.5 * (from + to), to_quat(Mat3::from_columns(x, cross(z, x), z))};
    mbs::ZoneElement e;
    e.name = "member" + std::to_string(m.elements.size());
    e.a = a;
    e.b = b;
    e.X_AF = a == kGround ? middle : inverse(m.bodies[static_cast<size_t>(a.index)].X_WB) * middle;
    e.X_BM = inverse(m.bodies[static_cast<size_t>(b.index)].X_WB) * middle;
    const double shear = 12 * kModulus * I / (length * length * length), bending = kModulus * I / length;
    e.translational_stiffness = {(is_extensible ? 1 : 1e4) * kModulus * A / length, shear, shear};
    e.rotational_stiffness = {bending, bending, bending};
    mbs::add_element(m, e);
  };
  member(kGround, {0}, {0, 0, 0}, {0, 0, h}, column, 0.16);
  member(kGround, {1}, {L, 0, 0}, {L, 0, h}, column, 0.16);
  member({0}, {1}, {0, 0, h}, {L, 0, h}, beam, 0.18);
  mbs::Load l;
  l.name = "push";
  l.body = {0};
  l.force = {20, 0, 0};
  m.loads.push_back(l);
  mbs::Options o = make_options(0, 0, 1);
  o.equilibrium = true;
  double sway = NAN;
  o.on_frame = [&](const View& v) { sway = v.X_WB[0].p.x; };
  return bench.run(m, o) ? 20 / sway : NAN;
}

VerificationCase portal() {
  VerificationCase c =
      make_case("Portal frame",
                "Columns 0.4 m x 0.4 m of 3.5 m, beam 0.3 m x 0.6 m of 6 m, E = 30 GPa, one zone element for each "
                "member, pushed sideways at one corner by 20 N, in equilibrium; the sway is that of this corner.",
                "slope-deflection method; with axial flexibility by the stiffness method, computed apart", 0);
  c.quantities = {{"sway stiffness, inextensible", "N/m", {27467340}, 27467340 * 2e-6, 0},
                  {"sway stiffness, with axial flexibility", "N/m", {27186379}, 27186379 * 1e-6, 0}};
  c.remark =
      "Inextensible means 10,000 times the axial stiffness, which leaves 1e-6. The push is small because the frame is "
      "solved in its "
      "deformed state: 2 kN would add the normal force of the beam over its length, 167 N/m.";
  c.measure = [](Bench& bench, double) { return Values{{find_sway(bench, false)}, {find_sway(bench, true)}}; };
  return c;
}

VerificationCase endings() {
  const double m = 2, k = 200, omega = 10, v0 = 1, cut = 0.0707, strength = 12, t = 1;
  // an elongation x at the time t1, with the speed v there, and free flight
  const auto fly = [=](double x, double t1, double v) { return x + v * (t - t1); };
  const double broken = strength / k, t_broken = std::asin(omega * broken / v0) / omega;
  VerificationCase c = make_case(
      "What ends within a step",
      "2 kg on a spring of 200 N/m, thrown with 1 m/s: an event cuts the spring after 0.0707 s, or it "
      "breaks at 12 N; and a pendulum of reduced length 1.1 m, let go from the horizontal, whose hinge is "
      "released after 0.5003 s.",
      "the oscillator until then, free flight from then on; angle and speed of the pendulum computed apart", 2e-3);
  const double angle = 1.072451754, speed = 3.958158176, late = 0.5003, flown = t - late;
  c.quantities = {
      {"place at 1 s, spring cut",
       "m",
       {fly(v0 / omega * std::sin(omega * cut), cut, v0 * std::cos(omega * cut))},
       3e-6,
       0},
      {"place at 1 s, spring broken", "m", {fly(broken, t_broken, v0 * std::cos(omega * t_broken))}, 3e-6, 0},
      {"place at 1 s, hinge released",
       "m",
       {std::cos(angle) - speed * std::sin(angle) * flown,
        -std::sin(angle) - speed * std::cos(angle) * flown - 0.5 * kGravity * flown * flown},
       1e-5,
       0}};
  c.remark = "Of second order; no order is claimed, as errors hang on where in a step it is, too.";
  c.measure = [=](Bench& bench, double step) {
    const auto place_of = [&](const Model& model) {
      Vec3 place{NAN, NAN, NAN};
      mbs::Options o = make_options(t, step, t);
      o.on_frame = [&](const View& view) { place = view.X_WB[0].p; };
      return bench.run(model, o) ? place : Vec3{NAN, NAN, NAN};
    };
    const auto end = [](Model& model, double time, mbs::Action::Kind kind) {
      mbs::Event e;
      e.name = "end";
      e.time = time;
      e.actions.resize(1);
      e.actions[0].kind = kind;
      e.actions[0].index = 0;
      e.actions[0].joint = {0};
      model.events.push_back(e);
    };
    Model sprung = make_oscillator(m, k, 0);
    sprung.bodies[0].v_WB = {v0, 0, 0};
    Model weak = sprung;
    end(sprung, cut, mbs::Action::Kind::RemoveSpring);
    weak.springs[0].tension_strength = strength;
    Model pendulum = make_empty_model();
    add_mass(pendulum, "bar", 2, {0.1, 0.2, 0.2}, {1, 0, 0});
    add_joint_at(pendulum, Kind::Revolute, kGround, {0}, {{}, axis_along_y()});
    end(pendulum, late, mbs::Action::Kind::ReleaseJoint);
    const Vec3 fallen = place_of(pendulum);
    return Values{{place_of(sprung).x}, {place_of(weak).x}, {fallen.x, fallen.z}};
  };
  return c;
}

}  // namespace

void add_force_cases(std::vector<VerificationCase>& list) {
  list.push_back(oscillator("Oscillator, underdamped", 0.1));
  list.push_back(oscillator("Oscillator, overdamped", 2));
  list.push_back(duffing());
  list.push_back(ramp());
  list.push_back(sudden_load());
  list.push_back(endings());
  list.push_back(chain(1));
  list.push_back(chain(10));
}

void add_structure_cases(std::vector<VerificationCase>& list) {
  list.push_back(cantilever_cells());
  list.push_back(cantilever_discrete());
  list.push_back(cantilever_frequency(8));
  list.push_back(cantilever_frequency(16));
  list.push_back(portal());
}

}  // namespace topple::engines
