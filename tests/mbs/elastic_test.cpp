// Frames of force elements against structural mechanics.
#include <gtest/gtest.h>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

/// Displacement of a point of a body from its start in the equilibrium under the model's gravity.
Vec3 sag_of(const Model& m, size_t body, const Vec3& p_B) {
  Options o;
  o.duration = 0;
  o.frame_interval = 1;
  Vec3 sag;
  o.on_frame = [&](const View& v) { sag = v.X_WB[body] * p_B - m.bodies[body].X_WB * p_B; };
  const Summary s = run(m, o);
  EXPECT_NE(s.ending, Summary::Ending::NoEquilibrium) << s.message;
  return sag;
}

TEST(Chain, FrequenciesAreThoseOfTheFixedFreeChain) {
  // n = 10, k = 1e6, m = 100: f10 = 31.475462775 Hz is the stiffest mode
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  BodyId before = kGround;
  for (int i = 0; i < 10; ++i) {
    const BodyId b = add_body(m, make_box("m", 100, {0.1, 0.1, 0.1}, {1.0 + i, 0, 0}));
    ZoneElement e;
    e.a = before;
    e.b = b;
    e.X_AF.p = before == kGround ? Vec3{1, 0, 0} : Vec3{1, 0, 0};
    e.translational_stiffness = {1e6, 0, 0};
    e.damping_ratio = 0;
    add_element(m, e);
    before = b;
  }
  Options o;
  o.duration = 0;
  o.equilibrium = false;
  const Summary s = run(m, o);
  const double pi = 3.14159265358979323846;
  EXPECT_NEAR(s.highest_frequency / (2 * pi), 31.475462775 * 1.01, 2e-3);  // the solver adds 1 %

  // lowest mode 2.378732758 Hz: excite its shape, count a period
  for (int i = 0; i < 10; ++i) m.bodies[static_cast<size_t>(i)].v_WB.x = 0.01 * std::sin((i + 1) * pi / 21);
  o.duration = 1;
  o.step = 1e-4;
  o.frame_interval = 1e-4;
  double crossed = 0, before_x = 1, before_t = 0;
  int crossings = 0;
  o.on_frame = [&](const View& v) {
    const double x = v.X_WB[9].p.x - 10;
    if (v.time > 0.01 && before_x > 0 && x <= 0 && crossings++ == 0)
      crossed = before_t + before_x / (before_x - x) * (v.time - before_t);
    before_x = x;
    before_t = v.time;
  };
  (void)run(m, o);
  EXPECT_NEAR(0.5 / crossed, 2.378732758, 1e-4);
}

/// Sag of the tip under 10 kN; the load is the weight of a heavy point welded to the tip.
double tip_of(test::Cantilever c) {
  Body load = make_box("load", 1000, {0.01, 0.01, 0.01}, {10, 0, 0});
  load.shapes.clear();
  const BodyId b = add_body(c.model, load);
  Joint j;
  j.parent = c.tip;
  j.child = b;
  j.X_PF.p = Vec3{10, 0, 0} - c.model.bodies[static_cast<size_t>(c.tip.index)].X_WB.p;
  add_joint(c.model, j);
  c.model.gravity = {0, 0, -10};
  return -sag_of(c.model, static_cast<size_t>(b.index), {}).z;
}

TEST(Cantilever, OfHingesMatchesItsDiscreteValues) {
  // L = 10, 0.4 x 0.4, E = 30e9, P = 10 kN; bushings that only turn, discrete values computed independently
  for (const auto& [n, tip] : {std::pair{8, 0.051879883}, {16, 0.052032471}}) {
    auto c = test::make_cantilever(n, 10, 0.4, 0.4, 30e9, 1e-6);
    for (ZoneElement& e : c.model.elements) e.translational_stiffness = {1e12, 1e12, 1e12};
    EXPECT_NEAR(tip_of(c), tip, 2e-4 * tip) << n;  // a slope of 0.5 % shortens the lever by less than 1e-4
  }
}

TEST(Cantilever, OfWholeCellsIsExact) {
  for (const int n : {1, 4, 16})
    EXPECT_NEAR(tip_of(test::make_cantilever(n, 10, 0.4, 0.4, 30e9, 1e-6)), 0.052083333, 1e-4 * 0.052) << n;
}

TEST(Member, OfOneElementIsExact) {
  // a whole column as one element with its markers at mid-length: tip force and moment of a cantilever
  const double L = 4, EI = 2e8;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const BodyId b = add_body(m, make_box("head", 1000, {0.1, 0.1, 0.1}, {L, 0, 0}));
  ZoneElement e;
  e.a = kGround;
  e.b = b;
  e.X_AF.p = {L / 2, 0, 0};
  e.X_BM.p = {-L / 2, 0, 0};
  e.translational_stiffness = {1e9, 12 * EI / (L * L * L), 12 * EI / (L * L * L)};
  e.rotational_stiffness = {1e8, EI / L, EI / L};
  add_element(m, e);
  const double P = 1000 * 9.81;
  EXPECT_NEAR(-sag_of(m, 0, {}).z, P * L * L * L / (3 * EI), 1e-5 * P * L * L * L / (3 * EI));
}

/// Portal: two columns 0.4 x 0.4 of 3.5 m, beam 0.3 x 0.6 of 6 m, E = 30e9. Loaded sideways at beam level.
Model make_portal(bool axial) {
  const double E = 30e9, h = 3.5, L = 6;
  const double Ic = std::pow(0.4, 4) / 12, Ib = 0.3 * std::pow(0.6, 3) / 12;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {1, 0, 0};  // sideways: 1 m/s² on two nodes of 1 t
  for (int i = 0; i < 2; ++i) add_body(m, make_box("node", 1000, {0.1, 0.1, 0.1}, {i * L, 0, h}));
  const auto member = [&](BodyId a, BodyId b, const Vec3& from, const Vec3& to, double I, double A) {
    const Vec3 p_a = a == kGround ? Vec3{} : m.bodies[static_cast<size_t>(a.index)].X_WB.p;
    const Vec3 p_b = m.bodies[static_cast<size_t>(b.index)].X_WB.p;
    const double len = norm(to - from);
    const Vec3 x = (1 / len) * (to - from), z{0, 1, 0};
    ZoneElement e;
    e.a = a;
    e.b = b;
    const Quat q = to_quat(Mat3::from_columns(x, cross(z, x), z));
    e.X_AF = {0.5 * (from + to) - p_a, q};
    e.X_BM = {0.5 * (from + to) - p_b, q};
    const double stiff = 12 * E * I / (len * len * len);
    e.translational_stiffness = {axial ? E * A / len : 1e4 * E * A / len, stiff, stiff};
    e.rotational_stiffness = {E * I / len, E * I / len, E * I / len};
    add_element(m, e);
  };
  member(kGround, {0}, {0, 0, 0}, {0, 0, h}, Ic, 0.16);
  member(kGround, {1}, {L, 0, 0}, {L, 0, h}, Ic, 0.16);
  member({0}, {1}, {0, 0, h}, {L, 0, h}, Ib, 0.18);
  return m;
}

TEST(Portal, SwayStiffnessIsThatOfTheFrame) {
  EXPECT_NEAR(2000 / sag_of(make_portal(false), 0, {}).x, 27467340, 0.001 * 27467340);
  // with axial flexibility the two nodes move a little differently: 1 %
  EXPECT_NEAR(2000 / sag_of(make_portal(true), 0, {}).x, 27186379, 0.01 * 27186379);
}

TEST(Portal, OfRigidMembersWithEndZonesIsExactInDoubleCurvature) {
  // columns rigid, each end a zone of 6EI/L, under a stiff beam: they bend in double curvature, 2 x 12EI/h³
  const double E = 30e9, h = 3.5, L = 6;
  const double Ic = std::pow(0.4, 4) / 12, Ib = 1e4 * Ic;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {1, 0, 0};
  std::vector<BodyId> node;
  for (int i = 0; i < 2; ++i) node.push_back(add_body(m, make_box("node", 1000, {0.1, 0.1, 0.1}, {i * L, 0, h})));
  const auto member = [&](BodyId a, BodyId b, const Vec3& from, const Vec3& to, double I) {
    const double len = norm(to - from);
    const Vec3 x = (1 / len) * (to - from), z{0, 1, 0};
    const Quat q = to_quat(Mat3::from_columns(x, cross(z, x), z));
    const BodyId rigid = add_body(m, make_box("member", 1e-3, {0.1, 0.1, 0.1}, 0.5 * (from + to)));
    const auto zone = [&](BodyId p, BodyId c, const Vec3& at) {
      ZoneElement e;
      e.a = p;
      e.b = c;
      e.X_AF = {at - (p == kGround ? Vec3{} : m.bodies[static_cast<size_t>(p.index)].X_WB.p), q};
      e.X_BM = {at - m.bodies[static_cast<size_t>(c.index)].X_WB.p, q};
      e.translational_stiffness = {1e12, 1e12, 1e12};
      e.rotational_stiffness = {6 * E * I / len, 6 * E * I / len, 6 * E * I / len};
      add_element(m, e);
    };
    zone(a, rigid, from);
    zone(rigid, b, to);
  };
  member(kGround, node[0], {0, 0, 0}, {0, 0, h}, Ic);
  member(kGround, node[1], {L, 0, 0}, {L, 0, h}, Ic);
  member(node[0], node[1], {0, 0, h}, {L, 0, h}, Ib);
  const double stiffness = 24 * E * Ic / (h * h * h);
  EXPECT_NEAR(2000 / sag_of(m, 0, {}).x, stiffness, 0.002 * stiffness);
}

TEST(Damping, IsThatOfTheRatioAtItsFrequency) {
  // free vibration on a spring tuned to the damping frequency: logarithmic decrement 2πζ
  for (const double ratio : {0.02, 0.05}) {
    Model m;
    m.gravity = {};
    m.contact.ground = m.contact.bodies = false;
    m.damping_frequency = 60;
    Body b = make_box("mass", 1000, {0.1, 0.1, 0.1}, {0, 0, 0});
    b.v_WB = {1, 0, 0};
    add_body(m, b);
    ZoneElement e;
    e.a = kGround;
    e.b = {0};
    e.translational_stiffness = {1000 * 60 * 60, 1e6, 1e6};
    e.rotational_stiffness = {1e6, 1e6, 1e6};
    e.damping_ratio = ratio;
    add_element(m, e);
    Options o;
    o.equilibrium = false;
    o.duration = 1;
    o.step = 1e-4;
    o.frame_interval = 1e-4;
    std::vector<double> peaks;
    double a = 0, c = 0;
    o.on_frame = [&](const View& v) {
      const double x = v.X_WB[0].p.x;
      if (c > a && c > x && c > 0) peaks.push_back(c + (x - a) * (x - a) / (16 * (c - 0.5 * (a + x))));  // parabola
      a = c;
      c = x;
    };
    const Summary s = run(m, o);
    ASSERT_GT(peaks.size(), 6u);
    const double decrement = std::log(peaks[2] / peaks[6]) / 4;  // past the start of the damper
    // root of the solid's equation of motion s³ + s² + (1 + r) s + 1 = 0 at its own frequency
    const double r = 4 * ratio / (1 - 2 * ratio);
    double a0 = 1;
    for (int i = 0; i < 50; ++i) a0 -= (a0 * a0 * a0 - a0 * a0 + (1 + r) * a0 - 1) / (3 * a0 * a0 - 2 * a0 + 1 + r);
    const double decay = 0.5 * (1 - a0), frequency = std::sqrt(1 / a0 - decay * decay);
    EXPECT_NEAR(decrement / (2 * 3.14159265358979323846), decay / frequency, 2e-3 * ratio);  // (ωh)² and the peaks
    EXPECT_NEAR(decay / frequency, ratio, 0.05 * ratio);  // the solid swings a little above the peak of its loss
    EXPECT_LT(std::abs(s.energy_error), 1e-3);
  }
}

/// A mass on a vertical spring whose axial law yields at Rp, loaded at once by its weight P.
double peak_over_yield(double ratio) {
  const double k = 1e6, mass = 1000, P = mass * 9.81, Rp = P / ratio;
  Model m;
  m.contact.ground = m.contact.bodies = false;
  add_body(m, make_box("mass", mass, {0.1, 0.1, 0.1}, {0, 0, 0}));
  ZoneLaw law;
  law.compression = {{0, 10}, {Rp, Rp}};
  law.tension = law.compression;
  ZoneElement e;
  e.a = kGround;
  e.b = {0};
  e.X_AF.q = e.X_BM.q = test::upright();
  e.translational_stiffness = {k, k, k};
  e.rotational_stiffness = {1e6, 1e6, 1e6};
  e.damping_ratio = 0;
  e.stations = {{0, add_law(m, law)}};
  add_element(m, e);
  Options o;
  o.equilibrium = false;
  o.duration = 2;
  o.step = 1e-4;
  o.frame_interval = 1e-4;
  double lowest = 0;
  o.on_frame = [&](const View& v) { lowest = std::min(lowest, v.X_WB[0].p.z); };
  const Summary s = run(m, o);
  EXPECT_LT(s.energy_error, 1e-3);
  return -lowest / (Rp / k);
}

TEST(SuddenLoad, PeaksAtTwiceTheStaticOrAtThePlasticBalance) {
  // u_max / u_y = 0.5 / (1 - P/Rp)
  EXPECT_NEAR(peak_over_yield(0.25), 0.5, 1e-4);  // elastic: 2 P / Rp
  EXPECT_NEAR(peak_over_yield(0.6), 1.25, 1e-3);
  EXPECT_NEAR(peak_over_yield(0.7), 1.666667, 1e-3);
  EXPECT_NEAR(peak_over_yield(0.8), 2.5, 2e-3);
  EXPECT_NEAR(peak_over_yield(0.9), 5, 1e-2);
}

TEST(Equilibrium, OfALoadedFrameStaysStill) {
  Model m = make_portal(true);
  m.gravity = {0, 0, -9.81};
  Options o;
  o.duration = 2;
  o.frame_interval = 0.1;
  Vec3 start;
  double moved = 0;
  o.on_frame = [&](const View& v) {
    if (v.time == 0) start = v.X_WB[0].p;
    moved = std::max(moved, norm(v.X_WB[0].p - start));
    EXPECT_NEAR(v.ground_force.z, 2000 * 9.81, 1e-6 * 2000 * 9.81);
  };
  (void)run(m, o);
  EXPECT_LT(moved, 1e-9);
}

/// Two bodies, one on seven springs of which one stiffens, the other held by the first: the first ways of the search
/// throw them kilometres away.
Model make_thrown() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const auto add = [&](const char* name, double mass, const Vec3& inertia, const Vec3& p) {
    Body b;
    b.name = name, b.mass = mass, b.inertia = Mat3::diagonal(inertia), b.X_WB.p = p;
    return add_body(m, b);
  };
  const BodyId first = add("first", 8.8, {0.9, 1.1, 1.3}, {0, -0.5, 0.1});
  const BodyId second = add("second", 19.5, {2, 2.3, 2.9}, {1, -0.6, -0.6});
  const Vec3 ends[][2] = {
      {{-1.1, -1.8, 2.4}, {-0.1, -0.6, 0.1}}, {{-1, 1.8, 2.6}, {-0.1, -0.4, 0.2}},   {{0, 0, 2.2}, {-0.2, -0.6, 0}},
      {{-0.1, -1.2, 2.3}, {0, -0.2, 0.1}},    {{1.6, -1.1, 1.1}, {-0.1, -0.3, 0.3}}, {{-1.5, 2, 2.4}, {0.2, -0.4, 0}},
      {{0.9, -0.1, 1.4}, {-0.1, -0.3, -0.1}},
  };
  for (const auto& [on_ground, on_body] : ends) {
    SpringDamper s;
    s.name = "s" + std::to_string(m.springs.size());
    s.a = kGround, s.b = first;
    s.p_A = on_ground, s.p_B = on_body - m.bodies[0].X_WB.p;
    s.free_length = norm(on_body - on_ground);
    s.spring.rate = 3000;
    if (m.springs.size() == 2) {
      s.spring.kind = Characteristic::Kind::Polynomial;
      s.spring.coefficients = {5.4, 3000, 0, 3000};
    }
    m.springs.push_back(s);
  }
  ZoneElement e;
  e.name = "arm";
  e.a = first, e.b = second;
  const Vec3 x = (1 / norm(Vec3{-0.1, 0.1, 1})) * Vec3{-0.1, 0.1, 1};
  const Vec3 y = (1 / norm(cross({0, 0, 1}, x))) * cross({0, 0, 1}, x), p{0.8, -0.4, -0.5};
  const Quat q = to_quat(Mat3::from_columns(x, y, cross(x, y)));
  e.X_AF = {p - m.bodies[0].X_WB.p, q}, e.X_BM = {p - m.bodies[1].X_WB.p, q};
  e.translational_stiffness = {1e5, 8e4, 7e4};
  e.rotational_stiffness = {5e3, 6e3, 7e3};
  add_element(m, e);
  return m;
}

TEST(Equilibrium, OfWhatTheFirstWaysThrowFarIsFoundOnShorterOnes) {
  const Model m = make_thrown();
  Options o;
  o.duration = 0.3;
  std::vector<Pose> start;
  double moved = 0;
  o.on_frame = [&](const View& v) {
    if (start.empty()) start = v.X_WB;
    for (size_t b = 0; b < 2; ++b) moved = std::max(moved, norm(v.X_WB[b].p - start[b].p));
  };
  const Summary s = run(m, o);
  ASSERT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_LT(moved, 1e-7);
  for (size_t b = 0; b < 2; ++b) EXPECT_LT(norm(start[b].p - m.bodies[b].X_WB.p), 3);
}

TEST(Equilibrium, TellsAMechanismThatIsOne) {
  // what hangs on two springs of a line turns about it
  Model m = make_thrown();
  m.springs.erase(m.springs.begin() + 2, m.springs.end());
  const Summary s = run(m, {});
  EXPECT_EQ(s.ending, Summary::Ending::NoEquilibrium);
  EXPECT_NE(s.message.find("mechanism"), std::string::npos) << s.message;
}

// A pivot of exactly nothing.
TEST(Equilibrium, NamesABodyOnABushingThatDoesNotTurn) {
  Model m;
  add_body(m, make_box("hanger", 3, {0.1, 0.1, 0.1}, {0, 0, -1}));
  Bushing k;
  k.a = kGround, k.b = {0};
  k.X_BM.p = {0, 0, 1};
  for (int i = 0; i < 3; ++i) k.spring[i].rate = 1e5;
  m.bushings.push_back(k);
  m.contact.ground = false;
  const Summary s = run(m, {});
  EXPECT_EQ(s.ending, Summary::Ending::NoEquilibrium);
  EXPECT_NE(s.message.find("\"hanger\""), std::string::npos) << s.message;
}

TEST(Equilibrium, NamesABodyThatHangsOnNothing) {
  Model m = make_portal(true);
  add_body(m, make_box("orphan", 1, {0.1, 0.1, 0.1}, {9, 9, 9}));
  Options o;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::NoEquilibrium);
  EXPECT_NE(s.message.find("orphan"), std::string::npos) << s.message;
}

}  // namespace
}  // namespace topple::mbs
