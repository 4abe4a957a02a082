// Zones that yield under dead load: they stand on their laws, hand-made answers beside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr double kStiff = 5e7, kBeside = 1e7;  // of the zone and of the spring beside it [N·m/rad]

/// Limit moments [N·m] over the plastic rotation [rad], whatever the force.
ZoneLaw make_law(const std::vector<double>& rotation, const std::vector<double>& moment) {
  ZoneLaw law;
  law.name = "hinge";
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-1e9, 1e9};
    m->plastic_rotation = rotation;
    m->positive = moment;
    m->positive.insert(m->positive.end(), moment.begin(), moment.end());
    m->negative = m->positive;
  }
  return law;
}

/// A body that turns about y and z on a zone, and on a spring beside it if that is stiff, under a torque [N·m].
Model make_turned(const ZoneLaw& law, const Vec3& torque, double beside = kBeside) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {};
  const LawId hinge = add_law(m, law);
  Body part;
  part.name = "part", part.mass = 1e3, part.inertia = Mat3::diagonal({1e3, 1e3, 1e3});
  const BodyId body = add_body(m, part);
  for (const bool is_hinge : {true, false}) {
    if (!is_hinge && beside == 0) continue;
    const double k = is_hinge ? kStiff : beside;
    ZoneElement e;
    e.name = is_hinge ? "hinge" : "spring", e.a = kGround, e.b = body;
    e.translational_stiffness = {1e9, 1e9, 1e9};
    e.rotational_stiffness = {k, k, k};
    if (is_hinge) e.stations = {{0, hinge}};
    add_element(m, e);
  }
  Load load;
  load.name = "torque", load.body = body, load.torque = torque;
  m.loads.push_back(load);
  return m;
}

struct Rest {
  bool is_found = false;
  std::string message;
  double moment = 0, rotation = 0, used = 0;  // of the first element about y [N·m, rad], of its resistance
  int iterations = 0;
};

Rest find_rest(const Model& m) {
  System s(m, {}, 0);
  Rest out;
  out.is_found = s.find_equilibrium(out.message);
  const ZoneState& z = s.state.element[0];
  out.moment = z.elastic_force[4], out.rotation = z.station[0].strained;
  out.used = calc_utilisation(s.elements[0].zone, s.laws, 0, z);
  out.iterations = s.summary.equilibrium_iterations;
  return out;
}

/// Plastic rotation and moment of the zone: m + kBeside (φ + m/kStiff) = torque on the line m = from + slope φ.
void expect_on_line(const Rest& r, double torque, double from, double slope) {
  ASSERT_TRUE(r.is_found) << r.message;
  const double share = 1 + kBeside / kStiff, turned = (torque - share * from) / (share * slope + kBeside);
  EXPECT_NEAR(r.rotation, turned, 1e-7 * turned);
  EXPECT_NEAR(r.moment, from + slope * turned, 1e-7 * from);
  EXPECT_NEAR(r.used, 1, 1e-9);
}

TEST(YieldAtRest, StandsOnTheBranchThatItHasComeTo) {
  // from 100 to 120 kNm over 2 mrad, down to 80 kNm over 8 mrad more, then level
  const ZoneLaw law = make_law({0, 2e-3, 10e-3, 30e-3}, {100e3, 120e3, 80e3, 80e3});
  expect_on_line(find_rest(make_turned(law, {0, 140e3, 0})), 140e3, 100e3, 1e7);
  expect_on_line(find_rest(make_turned(law, {0, 180e3, 0})), 180e3, 130e3, -5e6);
  expect_on_line(find_rest(make_turned(law, {0, 250e3, 0})), 250e3, 80e3, 0);
}

TEST(YieldAtRest, StandsWhereTheLawRisesFasterThanTheZone) {
  const ZoneLaw law = make_law({0, 1e-4, 1e-2}, {100e3, 130e3, 140e3});
  expect_on_line(find_rest(make_turned(law, {0, 140e3, 0})), 140e3, 100e3, 3e8);
}

TEST(YieldAtRest, HoldsUpToThePeakOfItsLawByItself) {
  const ZoneLaw law = make_law({0, 1e-3, 20e-3, 60e-3}, {100e3, 115e3, 120e3, 60e3});
  const Rest near = find_rest(make_turned(law, {0, 119.9e3, 0}, 0));
  ASSERT_TRUE(near.is_found) << near.message;
  EXPECT_NEAR(near.rotation, 1e-3 + 19e-3 * 4.9 / 5, 1e-7);
  EXPECT_NEAR(near.used, 1, 1e-9);
  const Rest beyond = find_rest(make_turned(law, {0, 120.5e3, 0}, 0));
  EXPECT_FALSE(beyond.is_found);
  EXPECT_NE(beyond.message.find("no dead-load equilibrium"), std::string::npos) << beyond.message;
}

TEST(YieldAtRest, HasNoneWhereWhatIsBesideItDoesNotBearWhatItLoses) {
  // down by 20 MNm/rad beside a spring of 10
  const ZoneLaw law = make_law({0, 5e-3, 1}, {100e3, 0, 0});
  const Rest none = find_rest(make_turned(law, {0, 121e3, 0}, 0));
  EXPECT_FALSE(none.is_found);
  // what is beside it bears all of it where the zone has nothing left
  const Rest bare = find_rest(make_turned(law, {0, 121e3, 0}));
  ASSERT_TRUE(bare.is_found) << bare.message;
  EXPECT_NEAR(bare.moment, 0, 1);
  EXPECT_NEAR(bare.rotation, 12.1e-3, 1e-7);
}

TEST(YieldAtRest, StandsOnItsLawAboutSkewAxes) {
  const ZoneLaw law = make_law({0, 1e-3, 20e-3}, {100e3, 115e3, 120e3});
  System s(make_turned(law, {0, 110e3, 70e3}), {}, 0);
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const ZoneState& z = s.state.element[0];
  ASSERT_GT(z.station[0].strained, 1e-4);
  const double limit =
      std::min(100e3 + 15e6 * z.station[0].strained, 115e3 + 5e3 / 19e-3 * (z.station[0].strained - 1e-3));
  EXPECT_NEAR(std::pow(z.elastic_force[4] / limit, 1.5) + std::pow(z.elastic_force[5] / limit, 1.5), 1, 1e-9);
  EXPECT_NEAR(std::hypot(z.station[0].phi[0], z.station[0].phi[1]), z.station[0].strained, 1e-12);
}

TEST(YieldAtRest, DoesNotCreepOnceTheRunBegins) {
  const ZoneLaw law = make_law({0, 2e-3, 10e-3, 30e-3}, {100e3, 120e3, 80e3, 80e3});
  for (const double torque : {140e3, 180e3}) {
    Options o;
    o.duration = 0.2, o.frame_interval = 0.01;
    std::vector<double> turned;
    o.on_frame = [&](const View& v) { turned.push_back(2 * v.X_WB[0].q.y); };
    const Summary sum = run(make_turned(law, {0, torque, 0}), o);
    ASSERT_EQ(turned.size(), 21u) << sum.message;
    EXPECT_GT(turned[0], 2.5e-3);
    for (const double t : turned) EXPECT_NEAR(t, turned[0], 1e-9) << torque;
  }
}

/// What is pushed by 150 kN along an axis on a zone of 1 GN/m and a spring of 10 MN/m beside it [N].
ZoneState find_pushed(const ZoneLaw& law, const Vec3& axis, double& used) {
  Model m = make_turned(law, {});
  m.loads[0].force = 150e3 * axis;
  m.elements[1].translational_stiffness = {1e7, 1e7, 1e7};
  System s(m, {}, 0);
  std::string message;
  EXPECT_TRUE(s.find_equilibrium(message)) << message;
  used = calc_utilisation(s.elements[0].zone, s.laws, 0, s.state.element[0]);
  return s.state.element[0];
}

TEST(YieldAtRest, SlipsUntilWhatIsLeftOfTheShearHolds) {
  // V = 100 kN (1 - s/20 mm), and 10 MN/m (s + V/1 GN/m) beside it: 150 = 1.01 V + 10 s
  ZoneLaw law;
  law.shear_y = law.shear_z = 100e3;
  law.slip_softening = 0.02, law.slip_rupture = 0.1;
  double used = 0;
  const ZoneState z = find_pushed(law, {0, 0.6, 0.8}, used);
  const double slip = (150e3 - 1.01 * 100e3) / (1e7 - 1.01 * 5e6);
  EXPECT_NEAR(z.slipped, slip, 1e-7 * slip);
  EXPECT_NEAR(std::hypot(z.elastic_force[1], z.elastic_force[2]), 100e3 - 5e6 * slip, 1);
  EXPECT_NEAR(used, 1, 1e-9);
}

TEST(YieldAtRest, IsCrushedAndTornToWhereItsCurvesAre) {
  // C rises from 100 to 110 kN over 1 mm and falls to 50 kN over 20 mm more; the same pulled
  for (const bool is_pushed : {true, false}) {
    ZoneLaw law;
    (is_pushed ? law.compression : law.tension) = {{0, 1e-3, 21e-3}, {100e3, 110e3, 50e3}};
    double used = 0;
    const ZoneState z = find_pushed(law, {is_pushed ? -1.0 : 1.0, 0, 0}, used);
    const double gone = (150e3 - 1.01 * 113e3) / (1e7 - 1.01 * 3e6);
    ASSERT_GT(gone, 1e-3);
    EXPECT_NEAR(is_pushed ? z.shortened : z.elongated, gone, 1e-7 * gone);
    EXPECT_NEAR(std::abs(z.elastic_force[0]), 113e3 - 3e6 * gone, 1);
    EXPECT_NEAR(used, 1, 1e-9);
  }
}

/// Two rigid halves of a beam of 10 m between held ends, a hinge at each end and one at its middle; weight at the
/// middle.
Model make_beam(double weight) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const LawId end = add_law(m, make_law({0, 8e-3, 86e-3}, {260e3, 300e3, 170e3}));
  const LawId middle = add_law(m, make_law({0, 8e-3, 86e-3}, {250e3, 270e3, 285e3}));
  BodyId before = kGround;
  for (int i = 0; i < 2; ++i) {
    Body half;
    half.name = "half " + std::to_string(i), half.mass = weight / 9.81 / 2;
    half.inertia = Mat3::diagonal({1e3, 1e3, 1e3});
    half.X_WB.p = {2.5 + 5.0 * i, 0, 0};
    const BodyId body = add_body(m, half);
    const auto join = [&m](const char* name, BodyId a, BodyId b, const Vec3& at_a, const Vec3& at_b, LawId law) {
      ZoneElement e;
      e.name = name, e.a = a, e.b = b, e.X_AF.p = at_a, e.X_BM.p = at_b;
      e.translational_stiffness = {b == kGround ? 1e3 : 1e9, 1e9, 1e9};  // one end slides, so that nothing is a rope
      e.rotational_stiffness = {1e8, 1e8, 1e8};
      e.stations = {{0, law}};
      add_element(m, e);
    };
    join(i == 0 ? "left end" : "middle", before, body, i == 0 ? Vec3{} : Vec3{2.5, 0, 0}, {-2.5, 0, 0},
         i == 0 ? end : middle);
    if (i == 1) join("right end", body, kGround, {2.5, 0, 0}, {10, 0, 0}, end);
    before = body;
  }
  return m;
}

TEST(YieldAtRest, ABeamBearsWhatLimitAnalysisGives) {
  // halves turn by θ, the middle by 2 θ; each half's weight has a lever of 2.5 m: M_end + M_middle = 1.25 m of the
  // weight. At first yield that is 408 kN; the sum is largest where the ends are, at 8 mrad: 300 + 271.5 kNm, 457 kN
  double rotation = 0;
  for (const double weight : {400e3, 420e3, 440e3, 455e3}) {
    System s(make_beam(weight), {}, 0);
    std::string message;
    ASSERT_TRUE(s.find_equilibrium(message)) << weight << message;
    const double left = std::abs(s.state.element[0].elastic_force[4]),
                 mid = std::abs(s.state.element[1].elastic_force[4]);
    EXPECT_NEAR((left + mid) / (1.25 * weight), 1, 1e-3) << weight;
    const bool has_yielded = weight > 408e3;
    for (size_t e = 0; e < 3; ++e) {
      const double used = calc_utilisation(s.elements[e].zone, s.laws, 0, s.state.element[e]);
      if (has_yielded) {
        EXPECT_NEAR(used, 1, 1e-9) << weight << " " << e;
      } else {
        EXPECT_LE(used, 1 + 1e-9) << weight << " " << e;
      }
    }
    EXPECT_GE(s.state.element[0].station[0].strained, rotation);
    rotation = s.state.element[0].station[0].strained;
  }
  EXPECT_GT(rotation, 5e-3);
  System none(make_beam(465e3), {}, 0);
  std::string message;
  EXPECT_FALSE(none.find_equilibrium(message));
}

TEST(YieldAtRest, AStationThatTurnsLoadsTheCracksOfTheOther) {
  // stations bear 100 and 60 N·m; one yields from 80 on, the other one cracks, and nothing moves when time begins
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {};
  const LawId hinge = add_law(m, make_law({0, 0.01}, {80, 130}));
  Body part;
  part.name = "part", part.mass = 1e3, part.inertia = Mat3::diagonal({100, 100, 100});
  ZoneElement e;
  e.name = "member", e.a = kGround, e.b = add_body(m, part);
  e.translational_stiffness = {2e5, 1e5, 1e5};
  e.rotational_stiffness = {8e3, 1e4, 1.2e4};
  e.stations = {{-0.5, hinge}, {0.5, hinge}};
  e.cracking[0] = {{20, 20}, {120, 120}, 4e-5};
  add_element(m, e);
  Load load;
  load.name = "load", load.body = {0}, load.force = {0, 0, 40}, load.torque = {0, 80, 0};
  m.loads.push_back(load);
  Options o;
  o.duration = 0.3;
  double fastest = 0, off = 0;
  o.on_frame = [&](const View& v) {
    fastest = std::max({fastest, norm(v.v_WB[0]), norm(v.w_WB[0])});
    off = std::max({off, std::abs(v.element_moment[0].y + 80), std::abs(v.element_force[0].z + 40)});
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_LT(fastest, 1e-9);
  EXPECT_LT(off, 0.1);  // it has turned by a hundredth of a radian, and its axes with it
}

}  // namespace
}  // namespace topple::mbs
