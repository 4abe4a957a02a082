// A zone at work against the family of curves it was made from: one normal force, changing forces, cycles; as a hinge
// in the multibody system; and a cantilever of rigid bodies against the column of the near field.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/error.h"
#include "base/unit.h"
#include "collapse/law.h"
#include "mbs/solver.h"
#include "mbs/zone.h"
#include "nearfield/column.h"
#include "plans.h"
#include "product/section_file.h"

namespace topple::collapse {
namespace {

using unit::MN;

/// The ground column of the storehouse: 50 x 50 cm, 64 cm², zone of 39 cm.
nearfield::ZoneInput make_zone_I() {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::SectionFile file =
      product::read_section_file(TOPPLE_SOURCE_DIR "/examples/rcc/zone_I.toml", warnings, text);
  nearfield::ZoneInput in;
  in.section = file.section, in.concrete = file.concrete, in.steel = file.steel, in.length = file.length;
  return in;
}

/// A family by itself: linear between its rotations, then between its forces.
struct Reference {
  const nearfield::MomentFamily& f;
  struct Row {
    size_t k = 1;
    double share = 0;
  };
  Row find(double N) const {
    Row r;
    while (r.k + 1 < f.normal_force.size() && f.normal_force[r.k] < N) ++r.k;
    r.share = (N - f.normal_force[r.k - 1]) / (f.normal_force[r.k] - f.normal_force[r.k - 1]);
    return r;
  }
  double calc_row(size_t k, double rotation) const {
    const double* M = &f.moment[k * f.rotation.size()];
    size_t j = 1;
    while (j + 1 < f.rotation.size() && f.rotation[j] < rotation) ++j;
    const double s = std::min(1.0, (rotation - f.rotation[j - 1]) / (f.rotation[j] - f.rotation[j - 1]));
    return (1 - s) * M[j - 1] + s * M[j];
  }
  double calc_moment(double N, double rotation) const {
    const Row r = find(N);
    return (1 - r.share) * calc_row(r.k - 1, rotation) + r.share * calc_row(r.k, rotation);
  }
  double find_peak(double N) const {
    double most = 0;
    for (const double rotation : f.rotation) most = std::max(most, calc_moment(N, rotation));
    return most;
  }
  /// Between two forces the curve has yielded when both of their curves have.
  double calc_yield_rotation(double N) const {
    const Row r = find(N);
    return std::max(f.yield_rotation[r.k - 1], f.yield_rotation[r.k]);
  }
  /// Last rotation of the family's grid at which a twentieth of the peak is left at this force and both its rows.
  double find_end(double N) const {
    const Row r = find(N);
    double end = 0;
    for (const double rotation : f.rotation) {
      if (rotation > calc_yield_rotation(N) &&
          std::min(calc_row(r.k - 1, rotation), calc_row(r.k, rotation)) < 0.05 * find_peak(N))
        break;
      end = rotation;
    }
    return end;
  }
  /// Where the curve leaves the line of a spring for good, or first yield if that is later.
  double find_begin(double N, double stiffness) const {
    double begin = calc_yield_rotation(N);
    for (double rotation = begin; rotation < f.rotation.back(); rotation += 1e-5)
      if (calc_moment(N, rotation) > stiffness * rotation) begin = rotation + 1e-5;
    return begin;
  }
};

/// A zone alone, with the spring of the elements that carry it: N is prescribed, and the rotation.
struct Zone {
  std::vector<mbs::CompiledLaw> laws;
  mbs::ZoneParameters p;
  mbs::ZoneState z;
  int axis;  // 4: about y, 5: about z
  Zone(const nearfield::Rcc& rcc, double EI_y, double EI_z, int about) : axis(about) {
    laws = {mbs::compile_law(make_zone_law(rcc, EI_y, EI_z, "zone", default_knowledge()))};
    const double stiffness[6] = {rcc.EA, rcc.GA, rcc.GA, rcc.GJ, EI_y, EI_z};
    for (int i = 0; i < 6; ++i) p.stiffness[i] = stiffness[i] / rcc.length;
    p.stations = 1, p.law[0] = 0;
  }
  double stiffness() const { return p.stiffness[axis]; }
  double moment() const { return z.resultant.c[axis]; }
  /// False if it does not carry N.
  bool go(double N, double rotation) {
    mbs::Six d;
    d.c[0] = N / p.stiffness[0] + z.axial;
    d.c[axis] = rotation;
    mbs::advance_zone(p, laws, d, 0, 0, z);
    return z.live && std::abs(z.resultant.c[0] - N) < 1e-6 * MN;
  }
};

/// Largest distance between zone and family over the peak, at one normal force.
void expect_curve(const nearfield::Rcc& rcc, double EI_y, double EI_z, double N, int axis, int direction) {
  const nearfield::MomentFamily& family =
      axis == 4 ? (direction > 0 ? rcc.y_pos : rcc.y_neg) : (direction > 0 ? rcc.z_pos : rcc.z_neg);
  const Reference reference{family};
  Zone zone(rcc, EI_y, EI_z, axis);
  const double peak = reference.find_peak(N), begin = reference.find_begin(N, zone.stiffness());
  const double end = std::min(reference.find_end(N), 0.9 * zone.laws[0].rupture_rotation);
  ASSERT_GT(end, begin);
  double worst = 0, at = 0;
  for (double rotation = 0; rotation <= end; rotation += 5e-6) {
    ASSERT_TRUE(zone.go(N, direction * rotation)) << "N " << N / MN << " lost at " << rotation << ", not " << end;
    if (rotation < begin) continue;
    const double off = std::abs(direction * zone.moment() - reference.calc_moment(N, rotation));
    if (off > worst) worst = off, at = rotation;
  }
  EXPECT_LT(worst, 0.02 * peak) << "N " << N / MN << " MN axis " << axis << " direction " << direction << " at " << at
                                << " of " << begin << " to " << end;
}

TEST(ZoneCurve, IsTheFamilysAtEachNormalForce) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  const double dead = -0.86 * MN, EI_y = rcc.calc_EI_effective_y(dead), EI_z = rcc.calc_EI_effective_z(dead);
  // Between crushing at -8.9 MN and rupture at 3.2 MN; up to 0.75 of the former nothing shortens by itself.
  for (const double N : {1.0, 0.5, 0.0, -0.3, -0.86, -1.5, -2.0, -2.9, -3.4, -3.7, -4.2, -5.0, -6.0})
    for (const int axis : {4, 5}) expect_curve(rcc, EI_y, EI_z, N * MN, axis, +1);
  expect_curve(rcc, EI_y, EI_z, dead, 4, -1);
}

TEST(ZoneCurve, IsTheFamilysInBothDirectionsOfABeam) {
  const product::Plan plan = read(portal());
  nearfield::ZoneInput in;
  in.section = plan.sections[1], in.concrete = plan.concretes[0], in.steel = plan.steels[0], in.length = 0.35;
  const nearfield::Rcc rcc = nearfield::make_rcc(in);
  const double EI_y = rcc.calc_EI_effective_y(0), EI_z = rcc.calc_EI_effective_z(0);
  for (const double N : {0.1, 0.0, -0.2, -1.0})
    for (const int direction : {1, -1})
      for (const int axis : {4, 5}) expect_curve(rcc, EI_y, EI_z, N * MN, axis, direction);
}

// What lies before first yield is the element's line, up to the yield moment.
TEST(ZoneCurve, IsTheElementsLineBeforeFirstYield) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  const double EI = rcc.calc_EI_effective_y(-0.86 * MN);
  for (const size_t k : {9u, 12u, 13u, 14u}) {  // forces of the family
    const double N = rcc.y_pos.normal_force[k], yield = rcc.y_pos.yield_moment[k];
    Zone zone(rcc, EI, EI, 4);
    for (double rotation = 0; rotation < rcc.y_pos.yield_rotation[k]; rotation += 1e-5) {
      ASSERT_TRUE(zone.go(N, rotation));
      if (zone.stiffness() * rotation < yield) {
        EXPECT_NEAR(zone.moment(), zone.stiffness() * rotation, 1e-9 * yield);
        EXPECT_FALSE(zone.z.yielded);
      } else {
        EXPECT_GE(zone.moment(), yield * (1 - 1e-9));
      }
    }
  }
}

TEST(ZoneCurve, FollowsTheFamilyWhileTheNormalForceRisesAndFalls) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  const double EI = rcc.calc_EI_effective_y(-0.86 * MN);
  const Reference reference{rcc.y_pos};
  for (const double swing : {0.5, 1.0, 2.0}) {  // swings of the force over the path
    Zone zone(rcc, EI, EI, 4);
    const double last = 0.02;
    int flowing = 0, steps = 0;
    double begin = 0;
    for (const double N : {-0.2, -1.3, -2.4}) begin = std::max(begin, reference.find_begin(N * MN, zone.stiffness()));
    for (double rotation = 0; rotation < last; rotation += 2e-6) {
      const double N = (-1.3 - 1.1 * std::sin(2 * std::acos(-1.0) * swing * rotation / last)) * MN;
      const double before = zone.z.station[0].reached;
      ASSERT_TRUE(zone.go(N, rotation));
      if (rotation < begin) continue;
      ++steps;
      if (!(zone.z.station[0].reached > before)) {
        // The force has risen faster than the element follows: inside the curve.
        EXPECT_LT(zone.moment(), reference.calc_moment(N, rotation) + 0.02 * reference.find_peak(N));
        continue;
      }
      ++flowing;
      ASSERT_NEAR(zone.moment(), reference.calc_moment(N, rotation), 0.02 * reference.find_peak(N))
          << "at " << rotation << " under " << N / MN << " MN";
    }
    EXPECT_GT(flowing, 0.7 * steps);
  }
}

/// The stated rule (docs/theory/zones.md (8)) on the family itself: a share d of new inelastic rotation becomes
/// flexibility, limits at the largest inelastic rotation so far.
struct Rule {
  Reference positive, negative;
  double stiffness, share;
  double plastic = 0, soft = 0, reached = 0, moment = 0;
  double calc_limit(const Reference& r, double N) const {
    // The curve's point with this plastic rotation, from the outside: the last such point.
    double low = r.calc_yield_rotation(N), high = r.f.rotation.back();
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (middle - r.calc_moment(N, middle) / stiffness < reached ? low : high) = middle;
    }
    return r.calc_moment(N, low);
  }
  void go(double N, double rotation) {
    moment = (rotation - plastic) / (1 / stiffness + soft);
    const double limit = calc_limit(moment > 0 ? positive : negative, N);
    if (std::abs(moment) <= limit) return;
    moment = std::copysign(limit, moment);
    const double inelastic = rotation - moment / stiffness, added = inelastic - plastic - soft * moment;
    if (added * moment > 0) {
      const double most = std::min(share * std::abs(inelastic / moment), 19 / stiffness);
      soft = std::max(soft, std::min(most, soft + share * added / moment));
    }
    plastic = inelastic - soft * moment;
    reached = std::max(reached, std::abs(inelastic));
  }
};

TEST(ZoneCurve, UnloadsWithItsDamageAndComesBackToTheCurve) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  EXPECT_NEAR(rcc.damage_share, 0.3, 1e-12);
  const double EI = rcc.calc_EI_effective_y(-0.86 * MN);
  const Reference reference{rcc.y_pos};
  for (const double N : {0.0, -0.86 * MN, -2.0 * MN}) {
    Zone zone(rcc, EI, EI, 4);
    const double peak = reference.find_peak(N), turn = 0.012, k = zone.stiffness();
    for (double rotation = 0; rotation < turn; rotation += 2e-6) ASSERT_TRUE(zone.go(N, rotation));
    ASSERT_TRUE(zone.go(N, turn));
    // The part of the inelastic rotation that comes back with the moment, f M of (8): 0.3 of what is new, and never
    // more than 0.3 of all; it falls with the moment.
    const double top = reference.calc_moment(N, turn), inelastic = turn - top / k;
    double back = 0, before = 0, moment = 0;
    for (double rotation = reference.find_begin(N, k); rotation < turn; rotation += 1e-6) {
      const double now = reference.calc_moment(N, rotation), all = rotation - now / k;
      const double fall = moment > 0 ? back * (now - moment) / moment : 0;
      back = std::min(0.3 * all, back + fall + 0.3 * (all - before - fall));
      before = all, moment = now;
    }
    EXPECT_GT(back, 0.15 * inelastic);
    EXPECT_LE(back, 0.3 * inelastic * (1 + 1e-3));
    const double left = inelastic - back;
    for (double rotation = turn; rotation > left - 1e-3; rotation -= 1e-5) {
      ASSERT_TRUE(zone.go(N, rotation));
      EXPECT_NEAR(zone.moment(), top * (rotation - left) / (turn - left), 0.02 * peak) << rotation;
    }
    for (double rotation = left; rotation < 1.5 * turn; rotation += 2e-6) {
      ASSERT_TRUE(zone.go(N, rotation));
      const double expected =
          rotation < turn ? top * (rotation - left) / (turn - left) : reference.calc_moment(N, rotation);
      ASSERT_NEAR(zone.moment(), expected, 0.02 * peak) << rotation;
    }
  }
}

TEST(ZoneCurve, FollowsTheRuleThroughCyclesUnderAChangingForce) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  const double EI = rcc.calc_EI_effective_y(-0.86 * MN);
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform;
    Zone zone(rcc, EI, EI, 4);
    Rule rule{{rcc.y_pos}, {rcc.y_neg}, zone.stiffness(), rcc.damage_share};
    double rotation = 0, N = -0.86 * MN, worst = 0;
    // Beyond the line of the element at once, then to and fro, wider and wider.
    for (int leg = 0; leg < 8; ++leg) {
      const double goal = (leg % 2 ? -1 : 1) * (0.006 + 0.0012 * leg * uniform(generator));
      const double force = (-0.2 - 1.8 * uniform(generator)) * MN, from = rotation, start = N;
      const int n = static_cast<int>(std::abs(goal - from) / 4e-6);
      for (int i = 1; i <= n; ++i) {
        rotation = from + (goal - from) * i / n;
        N = start + (force - start) * i / n;
        ASSERT_TRUE(zone.go(N, rotation)) << rotation;
        rule.go(N, rotation);
        worst = std::max(worst, std::abs(zone.moment() - rule.moment) / rule.positive.find_peak(N));
      }
    }
    EXPECT_LT(worst, 0.02) << seed;
    EXPECT_GT(zone.z.plastic, 0);
  }
}

/// Rotation in the course of time: to and fro at a speed, and the force that goes with it.
struct Drive {
  std::vector<double> time, turning, force;  // [s], [rad/s], [N]
};

TEST(ZoneCurvePhysics, IsTheSameInTheMultibodySystem) {
  const nearfield::Rcc rcc = nearfield::make_rcc(make_zone_I());
  const double dead = -0.86 * MN, EI = rcc.calc_EI_effective_y(dead);
  // A head that is too heavy to be turned by the zone turns about its centre, where the zone is.
  mbs::Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  const double inertia = 1e9, speed = 0.02;
  mbs::Body head;
  head.name = "head", head.mass = 1e4, head.inertia = Mat3::diagonal({inertia, inertia, inertia});
  const mbs::BodyId b = mbs::add_body(m, head);
  mbs::ZoneElement e;
  e.name = "zone", e.a = mbs::kGround, e.b = b;
  e.translational_stiffness = {rcc.EA / rcc.length, rcc.GA / rcc.length, rcc.GA / rcc.length};
  e.rotational_stiffness = {rcc.GJ / rcc.length, EI / rcc.length, EI / rcc.length};
  e.damping_ratio = 0;  // what dampers add to the moment is not in the curve
  e.stations = {{0, mbs::add_law(m, make_zone_law(rcc, EI, EI, "zone", default_knowledge()))}};
  mbs::add_element(m, e);
  // Forth to 14 mrad, back to -8 mrad, forth to 18 mrad; the force changes slowly on the way.
  const double turn[3] = {0, 0.014 / speed, 0.036 / speed}, change[3] = {0.5, -1, 1}, brake = 0.02;
  const double last = 0.062 / speed;
  mbs::Load torque;
  torque.body = b, torque.torque = {0, 2 * speed * inertia / brake, 0};
  for (const int i : {0, 1, 2})
    for (const double dt : {0.0, 1e-6, brake, brake + 1e-6}) {
      torque.time.push_back(turn[i] + dt);
      torque.factor.push_back(dt > 0 && dt < brake + 5e-7 ? change[i] : 0);
    }
  m.loads.push_back(torque);
  mbs::Load press;
  press.body = b, press.force = {dead, 0, 0};
  const auto factor = [&](double t) { return 1 + 1.2 * std::pow(std::sin(std::acos(-1.0) * t / last * 1.5), 2); };
  for (int i = 0; i <= 400; ++i) press.time.push_back(last * i / 400), press.factor.push_back(factor(last * i / 400));
  m.loads.push_back(press);

  Rule rule{{rcc.y_pos}, {rcc.y_neg}, EI / rcc.length, rcc.damage_share};
  mbs::Options o;
  o.duration = last, o.step = 1e-4, o.frame_interval = 1e-4;
  double worst = 0, furthest = 0, back = 0, force_error = 0;
  int compared = 0;
  o.on_frame = [&](const mbs::View& v) {
    const double N = -v.element_force[0].x, rotation = v.element_rotation[0].y, M = -v.element_moment[0].y;
    force_error = std::max(force_error, std::abs(N - dead * factor(v.time)));
    rule.go(N, rotation);
    worst = std::max(worst, std::abs(M - rule.moment) / rule.positive.find_peak(N));
    furthest = std::max(furthest, rotation), back = std::min(back, rotation);
    ++compared;
  };
  const mbs::Summary s = mbs::run(m, o);
  EXPECT_EQ(s.ending, mbs::Summary::Ending::TimeLimit) << s.message;
  EXPECT_NEAR(furthest, 0.018, 0.001);
  EXPECT_NEAR(back, -0.008, 0.001);
  EXPECT_LT(force_error, 0.01 * MN);
  EXPECT_GT(compared, 20000);
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(s.energy_error, 1e-3);
}

}  // namespace
}  // namespace topple::collapse
