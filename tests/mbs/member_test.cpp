// Whole members: elements with a station at each end, whose forces follow the chord between them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mbs/element_geometry.h"
#include "mbs/model_json.h"
#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr double kLength = 3, kMass = 60e3, kMoment = 50e3, kGravity = 9.81;

/// Hinges of 50 kNm whatever the force.
ZoneLaw make_law() {
  ZoneLaw law;
  law.name = "hinge";
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-8e6, 0, 4e6};
    m->plastic_rotation = {0, 1.4};
    m->positive = m->negative = std::vector<double>(6, kMoment);
  }
  law.damage_share = 0;
  law.rupture_rotation = law.rupture_rotation_pressed = 1.4;
  return law;
}

/// A floor that does not turn on four columns, each a member with a hinge at both ends, pushed off with a speed.
Model make_storey(double speed, double stiffness_share = 1) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {0, 0, -kGravity};
  Body floor;
  floor.name = "floor", floor.mass = kMass;
  floor.inertia = Mat3::diagonal({1e9, 1e9, 1e9});
  floor.X_WB.p = {0, 0, kLength};
  floor.v_WB = {speed, 0, 0};
  const BodyId f = add_body(m, floor);
  const LawId law = add_law(m, make_law());
  const double E = 30e9, A = 0.09, I = 0.3 * 0.3 * 0.3 * 0.3 / 12 * stiffness_share, L = kLength;
  for (int i = 0; i < 4; ++i) {
    const Vec3 foot{i % 2 == 0 ? -2.0 : 2.0, i / 2 == 0 ? -2.0 : 2.0, 0};
    ZoneElement e;
    e.name = "column " + std::to_string(i), e.a = kGround, e.b = f;
    e.X_AF = {foot + Vec3{0, 0, 0.5 * L}, test::upright()};
    e.X_BM = {foot - Vec3{0, 0, 0.5 * L}, test::upright()};
    e.translational_stiffness = {E * A / L, 12 * E * I / (L * L * L), 12 * E * I / (L * L * L)};
    e.rotational_stiffness = {1e7, E * I / L, E * I / L};
    e.damping_ratio = 0;
    e.stations = {{0.5 * L, law}, {-0.5 * L, law}};
    add_element(m, e);
  }
  return m;
}

/// Seconds that rigid-plastic columns take from upright to an angle: m L² θ'' = m g L sin θ - 8 M_p.
double integrate_storey(double speed, double until) {
  const double h = 1e-5;
  double angle = 0, rate = speed / kLength, t = 0;
  while (angle < until && t < 10) {
    const double gain = kGravity / kLength * std::sin(angle) - 8 * kMoment / (kMass * kLength * kLength);
    rate += h * gain, angle += h * rate, t += h;
    if (rate < 0) return INFINITY;
  }
  return t;
}

/// Seconds that the floor takes to where its columns lean by an angle; infinite if it comes to rest before.
double time_to(const Model& m, double until, double& drop, double& off) {
  Options options;
  options.step_share = 0.25;
  System s(m, options);
  s.start();
  const double away = kLength * std::sin(until);
  while (Vec3(s.state.p[0]).x < away) {
    s.advance_step();
    if (s.state.time > 10 || Vec3(s.state.v[0]).x < -0.05) return INFINITY;
  }
  drop = kLength - Vec3(s.state.p[0]).z;
  off = norm(Vec3{0, Vec3(s.state.p[0]).y, 0});
  return s.state.time;
}

TEST(Member, StoreysSwayAsTheirColumnsLean) {
  // the speed that just brings it to where the weight's moment passes that of the hinges
  const double critical = std::asin(8 * kMoment / (kMass * kGravity * kLength));
  const double needed = std::sqrt(2 * (8 * kMoment * critical / kMass - kGravity * kLength * (1 - std::cos(critical))));
  double drop = 0, off = 0;
  EXPECT_EQ(time_to(make_storey(0.9 * needed), 0.9, drop, off), INFINITY);
  const double expected = integrate_storey(1.2 * needed, 0.9);
  EXPECT_NEAR(time_to(make_storey(1.2 * needed), 0.9, drop, off), expected, 0.02 * expected);
  EXPECT_NEAR(drop, kLength * (1 - std::cos(0.9)), 0.005);
  EXPECT_LT(off, 1e-9);
}

TEST(Member, WeightTakesStiffnessFromASwayingStorey) {
  // without hinges' moment reached: 4 · 12 EI/L³ less m g/L, a chord that leans under the weight
  constexpr double share = 0.02, I = 0.3 * 0.3 * 0.3 * 0.3 / 12 * share;
  const double k = 4 * 12 * 30e9 * I / (kLength * kLength * kLength) - kMass * kGravity / kLength;
  ASSERT_GT(kMass * kGravity / kLength, 0.2 * k);
  Model m = make_storey(1e-3, share);
  m.damping_frequency = 1;
  Options options;
  options.step_share = 0.25;
  System s(m, options);
  s.start();
  double first = 0;
  while (s.state.time < 20) {
    const double before = Vec3(s.state.p[0]).x;
    s.advance_step();
    if (before > 0 && Vec3(s.state.p[0]).x <= 0) {
      first = s.state.time;
      break;
    }
  }
  const double half_period = 3.14159265358979 / std::sqrt(k / kMass);
  EXPECT_NEAR(first, half_period, 0.002 * half_period);
}

struct Poses {
  Pose F, M;
};

Poses make_poses(std::mt19937& random, double turn) {
  std::uniform_real_distribution<double> share(-1, 1);
  const auto any = [&] { return Vec3{share(random), share(random), share(random)}; };
  Poses p;
  p.F = {5 * any(), exp_rotation(3 * any())};
  p.M = {p.F.p + turn * any(), exp_rotation(turn * any()) * p.F.q};
  return p;
}

void check_work(const Span& span, std::initializer_list<double> turns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-1, 1);
  const auto any = [&] { return Vec3{share(random), share(random), share(random)}; };
  for (const double turn : turns) {
    for (int i = 0; i < 50; ++i) {
      const Poses p = make_poses(random, turn);
      const Six f{{share(random), share(random), share(random), share(random), share(random), share(random)}};
      const ElementGeometry g = measure_element(p.F, p.M, span);
      const ElementForces on = calc_element_forces(g, f);
      const Vec3 v_a = any(), w_a = any(), v_b = any(), w_b = any();
      constexpr double h = 1e-6;
      double power = 0;
      for (const double side : {-1.0, 1.0}) {
        const auto moved = [&](const Pose& X, const Vec3& v, const Vec3& w) {
          return Pose{X.p + side * h * v, exp_rotation(side * h * w) * X.q};
        };
        const ElementGeometry at = measure_element(moved(p.F, v_a, w_a), moved(p.M, v_b, w_b), span);
        for (int c = 0; c < 6; ++c) power += side * f.c[c] * at.deformation.c[c] / (2 * h);
      }
      const double given = dot(-on.force, v_a + cross(w_a, g.p_a - p.F.p)) - dot(on.torque_a, w_a) +
                           dot(on.force, v_b + cross(w_b, g.p_b - p.M.p)) + dot(on.torque_b, w_b);
      EXPECT_NEAR(given, power, 1e-8) << turn << " " << i;
      // no force and no moment is left over
      const Vec3 left = on.torque_a - on.torque_b + cross(g.p_a - g.p_b, on.force);
      EXPECT_LT(norm(left), 1e-12) << turn << " " << i;
    }
  }
}

TEST(Member, ForcesDoTheWorkOfTheResultants) { check_work({-1.4, 1.7}, {1e-3, 0.3, 0.8}); }

TEST(Zone, ForcesDoTheWorkOfTheResultants) { check_work({}, {1e-3, 0.3, 0.8, 1.7}); }

/// The same in a mirror, of a vector and of a rotation; x, y and z of a marker there are again right-handed.
Pose mirror(const Pose& X) { return {{X.p.x, -X.p.y, X.p.z}, {X.q.w, -X.q.x, X.q.y, -X.q.z}}; }

void check_mirror(const Span& span) {
  std::mt19937 random(5);
  const Six f{{3, -5, 7, 2, -1, 4}};
  const Quat back{0, 0, 0, 1};  // x the other way
  for (const double turn : {1e-3, 0.3, 1.2}) {
    for (int i = 0; i < 20; ++i) {
      const Poses p = make_poses(random, turn);
      const ElementForces on = calc_element_forces(measure_element(p.F, p.M, span), f);
      // shear along y, torsion and the moment about z change their sign in the mirror
      const ElementGeometry seen = measure_element(mirror(p.F), mirror(p.M), span);
      const ElementForces there = calc_element_forces(seen, {{3, 5, 7, -2, -1, -4}});
      EXPECT_LT(norm(there.force - Vec3{on.force.x, -on.force.y, on.force.z}), 1e-12) << i;
      EXPECT_LT(norm(there.torque_a - Vec3{-on.torque_a.x, on.torque_a.y, -on.torque_a.z}), 1e-12) << i;
      // from b to a with x turned about: what is pulled stays pulled
      const ElementGeometry g = measure_element({p.M.p, p.M.q * back}, {p.F.p, p.F.q * back}, {-span.b, -span.a});
      const ElementForces other = calc_element_forces(g, {{3, -5, -7, 2, -1, -4}});
      EXPECT_LT(norm(other.force + on.force), 1e-12) << i;
      EXPECT_LT(norm(other.torque_b + on.torque_a), 1e-12) << i;
      EXPECT_LT(norm(g.p_a - measure_element(p.F, p.M, span).p_b), 1e-12) << i;
    }
  }
}

TEST(Zone, IsTheSameInAMirrorAndFromItsOtherEnd) { check_mirror({}); }

TEST(Member, IsTheSameInAMirrorAndFromItsOtherEnd) { check_mirror({-1.4, 1.7}); }

TEST(Member, SmallDeformationsAreThoseOfTheMarkers) {
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    const Poses p = make_poses(random, 1e-6);
    const ElementGeometry member = measure_element(p.F, p.M, {-1.5, 1.5}), marker = measure_element(p.F, p.M, {});
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(member.deformation.c[c], marker.deformation.c[c], 2e-11) << c;
  }
}

/// Resultants of a member under dead load, from virgin state, and what its stations have done.
struct FromVirgin {
  CompiledLaws laws;
  ZoneParameters p = test::make_member();
  ZoneState z;
  FromVirgin(const double (&d)[4], kernel::Plane plane, const ZoneLaw& law = make_law()) : laws{compile_law(law)} {
    p.plane = plane;
    p.is_at_rest = true;
    Six deformation{};
    deformation.c[1] = d[0], deformation.c[2] = d[1], deformation.c[4] = d[2], deformation.c[5] = d[3];
    advance_zone(p, laws, deformation, 0, 0, z);
  }
  double moment(int station, int axis) const {
    return z.elastic_force[4 + axis] + (axis == 0 ? 1 : -1) * p.x[station] * z.elastic_force[2 - axis];
  }
};

/// Hinges of 50 kNm that harden to 60 kNm and lose all but 20 kNm, more slowly than a member unloads.
ZoneLaw make_hardening_law() {
  ZoneLaw law = make_law();
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->plastic_rotation = {0, 1e-4, 4e-3, 0.02, 1.4};
    m->positive.clear();
    for (int k = 0; k < 3; ++k) m->positive.insert(m->positive.end(), {kMoment, 56e3, 60e3, 20e3, 20e3});
    m->negative = m->positive;
  }
  return law;
}

TEST(Member, StationsThatHaveTurnedStandOnTheirLimitWhichPushesThem) {
  for (const ZoneLaw& law : {make_law(), make_hardening_law()}) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> some(-1, 1);
    int turned[3] = {0, 0, 0};
    for (int i = 0; i < 6000; ++i) {
      const bool is_plane = i % 2 == 0;
      const double size = std::pow(some(random), 2);
      const double d[4] = {0.03 * size * some(random), is_plane ? 0 : 0.03 * size * some(random),
                           is_plane ? 0 : 0.02 * size * some(random), 0.02 * size * some(random)};
      const FromVirgin v(d, is_plane ? kernel::Plane::AboutZ : kernel::Plane::Space, law);
      int count = 0;
      for (int s = 0; s < 2; ++s) {
        const double* phi = v.z.station[s].phi;
        const double m[2] = {v.moment(s, 0), v.moment(s, 1)};
        int k = 0, j = 0;
        const double limit = calc_moment_limit(v.laws[0].moment[0], 0, v.z.station[s].strained, k, j).positive;
        const double used = std::pow(std::abs(m[0]) / limit, 1.5) + std::pow(std::abs(m[1]) / limit, 1.5);
        EXPECT_LE(used, 1 + 1e-9) << i << " " << s;
        if (phi[0] == 0 && phi[1] == 0) continue;
        ++count;
        EXPECT_GE(used, 1 - 1e-9) << i << " " << s;
        EXPECT_GE(phi[0] * m[0] + phi[1] * m[1], 0) << i << " " << s;
      }
      ++turned[count];
    }
    for (const int n : turned) EXPECT_GT(n, 200);
  }
}

TEST(Member, ForcesFollowLargeDeformationsWithoutAJump) {
  // across where both stations flow and one of them begins to give back: 400 steps from one bent shape to another
  std::mt19937 random(12);
  std::uniform_real_distribution<double> some(-1, 1);
  for (int i = 0; i < 200; ++i) {
    double from[4], by[4];
    for (double* x : {from, by}) x[0] = 0.03 * some(random), x[3] = 0.02 * some(random), x[1] = x[2] = 0;
    double before = 0;
    constexpr int steps = 400;
    for (int k = 0; k <= steps; ++k) {
      double d[4];
      for (int c = 0; c < 4; ++c) d[c] = from[c] + k * by[c] / steps;
      const double moment = FromVirgin(d, kernel::Plane::AboutZ).moment(0, 1);
      // no more than the spring would bring: 6 EI/L² of the displacement, 4 EI/L of the rotation, in one step
      const double most = test::kMemberEI / kLength * (6 * std::abs(by[0]) / kLength + 4 * std::abs(by[3])) / steps;
      if (k > 0) { EXPECT_LE(std::abs(moment - before), 2 * most + 1e-6) << i << " " << k; }
      before = moment;
    }
  }
}

/// A member of 3 m, both ends of which yield at 100 kNm and lose a share 0.3 of their stiffness: it sways by 2 cm and
/// is then turned by 0.01 about y, which takes one end's moment about y through nothing while both turn about z.
void sway_and_turn(int steps, double out[2]) {
  const std::string text = R"json({"format": "topple-mbs", "version": 2, "gravity": [0, 0, 0],
 "bodies": [{"name": "b", "mass": 1e12, "inertia": [1e12, 1e12, 1e12], "X_WB": {}, "v_WB": [0, 0, 0.01], "w_WB": [0, 0, 0.02]}],
 "laws": [{"name": "L", "damage_share": 0.3, "biaxial_exponent": 1.5,
   "moment_y": {"normal_force": [-5e6, 5e6], "plastic_rotation": [0, 1], "positive": [1e5, 1e5, 1e5, 1e5], "negative": [1e5, 1e5, 1e5, 1e5]},
   "moment_z": {"normal_force": [-5e6, 5e6], "plastic_rotation": [0, 1], "positive": [1e5, 1e5, 1e5, 1e5], "negative": [1e5, 1e5, 1e5, 1e5]}}],
 "elements": [{"name": "e", "a": "ground", "b": "b", "at": [0, 0, 0], "damping_ratio": 0,
   "translational_stiffness": [2e9, 26666666.67, 26666666.67], "rotational_stiffness": [3e7, 2e7, 2e7],
   "stations": [{"x": -1.5, "law": "L"}, {"x": 1.5, "law": "L"}]}],
 "loads": [{"name": "u", "body": "b", "force": [0, 0, 1e12], "table": {"time": [0.4, 0.401, 0.419, 0.42], "factor": [0, -0.526315789, -0.526315789, 0]}},
           {"name": "r", "body": "b", "torque": [0, 1e12, 0], "table": {"time": [0.4, 0.401, 0.419, 0.42], "factor": [0, 1.052631579, 1.052631579, 0]}}],
 "contact": {"ground": false, "bodies": false}})json";
  const Model m = model_from_json(text, "m.json");
  Options o;
  o.equilibrium = false;
  o.duration = 1;
  o.step = 1.0 / steps;
  Vec3 force, moment;
  o.on_frame = [&](const View& v) { force = v.element_force[0], moment = v.element_moment[0]; };
  run(m, o);
  out[0] = moment.y, out[1] = force.z;
}

TEST(Member, DamageInBiaxialBendingConvergesWithTheStep) {
  // each axis by itself: 5 to 20 kNm apart from one step to the next, at any size
  double coarse[2], fine[2], other[2];
  sway_and_turn(2000, coarse), sway_and_turn(8000, fine), sway_and_turn(8200, other);
  EXPECT_NEAR(coarse[0], fine[0], 100);
  EXPECT_NEAR(other[0], fine[0], 100);
  EXPECT_NEAR(coarse[1], fine[1], 100);
  EXPECT_NEAR(other[1], fine[1], 100);
  EXPECT_GT(std::abs(fine[0]), 1e4);
}

}  // namespace
}  // namespace topple::mbs
