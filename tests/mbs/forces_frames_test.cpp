// Structures of rigid bodies on bushings, under loads, against structural mechanics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;
constexpr double kPi = 3.14159265358979323846;

/// The cantilever of models.h with bushings that only turn in place of its zone elements, and a force at its tip.
Model make_cantilever(int n, double force) {
  test::Cantilever c = test::make_cantilever(n, 10, 0.4, 0.4, 30e9, 2500);
  Model m = c.model;
  for (const ZoneElement& e : m.elements) {
    Bushing k;
    k.name = e.name;
    k.a = e.a;
    k.b = e.b;
    k.X_AF = e.X_AF;
    k.X_BM = e.X_BM;
    for (int i = 0; i < 3; ++i) k.spring[i].rate = 1e12;
    for (int i = 0; i < 3; ++i) k.spring[3 + i].rate = e.rotational_stiffness[i];
    m.bushings.push_back(k);
  }
  m.elements.clear();
  Load l;
  l.name = "tip";
  l.body = c.tip;
  l.p_B = Vec3{10, 0, 0} - m.bodies[static_cast<size_t>(c.tip.index)].X_WB.p;
  l.force = {0, 0, -force};
  m.loads.push_back(l);
  return m;
}

Vec3 tip_of(const Model& m, const View& v) { return v.X_WB[m.bodies.size() - 1] * m.loads[0].p_B; }

TEST(BushingFramesReference, CantileverSagsLikeItsHinges) {
  // L = 10, 0.4 x 0.4, E = 30e9; a small load, so that the slope does not shorten the lever
  const double exact = 0.052083333;
  double off[2];
  int i = 0;
  for (const auto& [n, tip] : {std::pair{8, 0.051879883}, {16, 0.052032471}}) {
    Options o;
    o.duration = 0;
    double sag = 0;
    const Model m = make_cantilever(n, 100);
    o.on_frame = [&](const View& v) { sag = -100 * tip_of(m, v).z; };
    const Summary s = run(m, o);
    ASSERT_NE(s.ending, Summary::Ending::NoEquilibrium) << s.message;
    EXPECT_NEAR(sag, tip, 1e-4 * tip) << n;
    off[i++] = exact - sag;
  }
  EXPECT_NEAR(std::log2(off[0] / off[1]), 2, 0.01);
}

TEST(BushingFramesReference, CantileverSwingsWithItsFirstFrequency) {
  // let go from the load: the tip's place holds a little of the higher modes, so the motion is seen through the first
  // mode of the beam, which the others hardly touch
  const double exact = 2.238364840;
  double off[2];
  int i = 0;
  for (const auto& [n, frequency] : {std::pair{8, 2.246414080}, {16, 2.240372358}}) {
    Model m = make_cantilever(n, 100);
    for (Bushing& k : m.bushings)
      for (int c = 0; c < 3; ++c) k.spring[c].rate = 1e11;
    // bars without thickness, as the discrete values have them
    for (Body& b : m.bodies) {
      const double length = 2 * b.shapes[0].half.x;
      b.inertia = Mat3::diagonal({b.mass * 0.16 / 6, b.mass * length * length / 12, b.mass * length * length / 12});
    }
    Event go;
    Action a;
    a.kind = Action::Kind::RemoveLoad;
    a.index = 0;
    go.actions.push_back(a);
    m.events.push_back(go);
    Options o;
    o.duration = 10.2 / frequency;
    o.frame_interval = 2e-4;
    const auto shape = [](double x) {
      const double s = 1.8751040687 * x / 10, r = 0.7340955137;
      return std::cosh(s) - std::cos(s) - r * (std::sinh(s) - std::sin(s));
    };
    double first = -1, last = 0, t0 = 0, q0 = 0, residual = 0, stored = 0;
    int crossings = 0;
    o.on_frame = [&](const View& v) {
      double q = 0;
      for (size_t b = 0; b < m.bodies.size(); ++b) q += m.bodies[b].mass * shape(m.bodies[b].X_WB.p.x) * v.X_WB[b].p.z;
      if (q0 * q < 0) {
        last = t0 + q0 / (q0 - q) * (v.time - t0);
        if (first < 0) first = last;
        ++crossings;
      }
      q0 = q;
      t0 = v.time;
      stored = std::max(stored, v.energy.elastic);
      residual = std::max(residual, std::abs(v.energy.residual));
    };
    (void)run(m, o);
    ASSERT_EQ(crossings, 20) << n;
    const double seen = (crossings - 1) / (2 * (last - first));
    EXPECT_NEAR(seen, frequency, 1e-4 * frequency) << n;
    EXPECT_LT(residual, 1e-3 * stored) << n;
    off[i++] = seen - exact;
  }
  EXPECT_NEAR(std::log2(off[0] / off[1]), 2, 0.05);
}

/// Portal: two columns 0.4 x 0.4 of 3.5 m, beam 0.3 x 0.6 of 6 m, E = 30e9: each member one bushing at its middle, and
/// 2 kN on one node, where the sway is measured.
Model make_portal(bool axial) {
  const double E = 30e9, h = 3.5, L = 6;
  const double Ic = std::pow(0.4, 4) / 12, Ib = 0.3 * std::pow(0.6, 3) / 12;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {};
  for (int i = 0; i < 2; ++i) add_body(m, make_box("node", 1000, {0.1, 0.1, 0.1}, {i * L, 0, h}));
  Load l;
  l.body = {0};
  l.force = {2000, 0, 0};
  m.loads.push_back(l);
  const auto member = [&](BodyId a, BodyId b, const Vec3& from, const Vec3& to, double I, double A) {
    const Vec3 p_a = a == kGround ? Vec3{} : m.bodies[static_cast<size_t>(a.index)].X_WB.p;
    const Vec3 p_b = m.bodies[static_cast<size_t>(b.index)].X_WB.p;
    const double len = norm(to - from);
    const Vec3 x = (1 / len) * (to - from), z{0, 1, 0};
    Bushing k;
    k.a = a;
    k.b = b;
    const Quat q = to_quat(Mat3::from_columns(x, cross(z, x), z));
    k.X_AF = {0.5 * (from + to) - p_a, q};
    k.X_BM = {0.5 * (from + to) - p_b, q};
    k.spring[0].rate = (axial ? 1 : 1e4) * E * A / len;
    k.spring[1].rate = k.spring[2].rate = 12 * E * I / (len * len * len);
    for (int c = 3; c < 6; ++c) k.spring[c].rate = E * I / len;
    m.bushings.push_back(k);
  };
  member(kGround, {0}, {0, 0, 0}, {0, 0, h}, Ic, 0.16);
  member(kGround, {1}, {L, 0, 0}, {L, 0, h}, Ic, 0.16);
  member({0}, {1}, {0, 0, h}, {L, 0, h}, Ib, 0.18);
  return m;
}

TEST(BushingFramesReference, PortalHasTheFramesSwayStiffness) {
  for (const auto& [axial, stiffness] : {std::pair{false, 27467340.0}, {true, 27186379.0}}) {
    Options o;
    o.duration = 0;
    double sway = 0;
    o.on_frame = [&](const View& v) { sway = v.X_WB[0].p.x; };
    (void)run(make_portal(axial), o);
    EXPECT_NEAR(2000 / sway, stiffness, 1e-5 * stiffness);  // 0.07 mm of sway turn the members
  }
}

TEST(LoadReference, AppliedAtOnceDoublesTheElasticWay) {
  // a load that an event brings while the body hangs at rest; static 10 mm
  Model m;
  m.contact.ground = m.contact.bodies = false;
  add_body(m, make_box("mass", 1000, {0.1, 0.1, 0.1}, {0, 0, 0}));
  Bushing k;
  k.a = kGround;
  k.b = {0};
  for (int c = 0; c < 6; ++c) k.spring[c].rate = 1e6;
  m.bushings.push_back(k);
  Load l;
  l.body = {0};
  l.force = {0, 0, -1e4};
  m.loads.push_back(l);
  Event e;
  e.time = 0.123456;
  e.actions.emplace_back();
  e.actions[0].kind = Action::Kind::ApplyLoad;
  e.actions[0].index = 0;
  m.events.push_back(e);
  Options o;
  o.duration = 0.5;
  o.step = 1e-4;
  o.frame_interval = 1e-4;
  double lowest = 0, before = 0, largest_residual = 0, work = 0;
  o.on_frame = [&](const View& v) {
    const double z = v.X_WB[0].p.z + 9.81e-3;
    if (v.time < e.time) before = std::max(before, std::abs(z));
    lowest = std::min(lowest, z);
    largest_residual = std::max(largest_residual, std::abs(v.energy.residual));
    work = std::max(work, v.energy.loads);
  };
  (void)run(m, o);
  EXPECT_LT(before, 1e-12);
  EXPECT_NEAR(lowest, -0.02, 1e-6 * 0.02);  // (ω h)²/8
  EXPECT_NEAR(work, 200, 1e-4);
  EXPECT_LT(largest_residual, 1.001 * 1e-8 * 1e8 / (8 * 1000));  // h² F² / (8 m): the scheme's own energy at the jump
}

TEST(LoadReference, AppliedAtOnceOvershootsAsElasticPlasticBalanceHas) {
  // u_max / u_y = 0.5 / (1 - P/Rp)
  for (const auto& [ratio, over] : {std::pair{0.6, 1.25}, {0.7, 1.666667}, {0.8, 2.5}, {0.9, 5.0}}) {
    const double P = 1e4, Rp = P / ratio;
    Model m;
    m.gravity = {};
    m.contact.ground = m.contact.bodies = false;
    add_body(m, make_box("mass", 1000, {0.1, 0.1, 0.1}, {0, 0, 0}));
    ZoneLaw law;
    law.compression = {{0, 10}, {Rp, Rp}};
    law.tension = law.compression;
    ZoneElement z;
    z.a = kGround;
    z.b = {0};
    z.translational_stiffness = {1e6, 1e6, 1e6};
    z.rotational_stiffness = {1e6, 1e6, 1e6};
    z.damping_ratio = 0;
    z.stations = {{0, add_law(m, law)}};
    add_element(m, z);
    Load l;
    l.body = {0};
    l.force = {P, 0, 0};
    m.loads.push_back(l);
    Options o;
    o.equilibrium = false;
    o.duration = 1;
    o.step = 1e-4;
    o.frame_interval = 1e-4;
    double most = 0;
    Energy end;
    o.on_frame = [&](const View& v) {
      most = std::max(most, v.X_WB[0].p.x);
      end = v.energy;
    };
    (void)run(m, o);
    EXPECT_NEAR(most / (Rp / 1e6), over, 1e-4 * over) << ratio;
    EXPECT_NEAR(end.plastic, end.loads - end.elastic - end.kinetic, 1e-4 * end.loads) << ratio;
  }
}

TEST(TopplingChimneyReference, BendsMostAtAThirdOfItsHeight) {
  // Varieschi & Kamiya, Am. J. Phys. 71 (2003) 1025: a uniform chimney falling about its foot is bent by
  // |M| = m g H sin θ x (1 - x)² / 4, most at x = 1/3: m g H sin θ / 27
  constexpr int n = 12;
  const double H = 20, mass = 1e4, part = H / n, tilt = 0.1;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const Quat q = exp_rotation({0, tilt, 0});
  const Mat3 R = to_matrix(q);
  for (int i = 0; i < n; ++i) {
    Body b;
    b.name = "part " + std::to_string(i);
    b.mass = mass / n;
    b.inertia = Mat3::diagonal({b.mass * part * part / 12, b.mass * part * part / 12, 10});
    b.X_WB = {R * Vec3{0, 0, (i + 0.5) * part}, q};
    add_body(m, b);
    if (i == 0) {
      Joint foot;
      foot.kind = Joint::Kind::Revolute;
      foot.parent = kGround;
      foot.child = {0};
      foot.X_PF.q = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
      foot.X_CM = {{0, 0, -0.5 * part}, foot.X_PF.q};
      add_joint(m, foot);
      continue;
    }
    Bushing k;
    k.a = {i - 1};
    k.b = {i};
    k.X_AF.p = {0, 0, 0.5 * part};
    k.X_BM.p = {0, 0, -0.5 * part};
    for (int c = 0; c < 6; ++c) {
      k.spring[c].rate = 1e9;
      k.damper[c].rate = 2e7;  // half of critical for the slowest bending, so that the start does not ring on
    }
    m.bushings.push_back(k);
  }
  Options o;
  o.equilibrium = false;
  o.duration = 3.2;
  o.frame_interval = 0.1;
  int checked = 0;
  o.on_frame = [&](const View& v) {
    if (v.time < 1.5) return;
    const Vec3 up = to_matrix(v.X_WB[0].q).column(2);
    const double sine = std::hypot(up.x, up.y), most = mass * 9.81 * H * sine / 27;
    double largest = 0;
    int at = 0;
    for (int i = 1; i < n; ++i) {
      const double x = static_cast<double>(i) / n, moment = std::abs(v.bushing_moment[static_cast<size_t>(i) - 1].y);
      EXPECT_NEAR(moment, mass * 9.81 * H * sine * x * (1 - x) * (1 - x) / 4, 2e-3 * most) << v.time << " " << x;
      if (moment > largest) largest = moment, at = i;
    }
    EXPECT_EQ(at, n / 3);
    EXPECT_NEAR(largest, most, 2e-3 * most);
    ++checked;
  };
  const Summary s = run(m, o);
  EXPECT_GT(checked, 10);
  EXPECT_LT(s.energy_error, 1e-4);
}

}  // namespace
}  // namespace topple::mbs
