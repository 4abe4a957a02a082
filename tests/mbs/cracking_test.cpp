// Cracks of members before first yield: their line, unloading, both stations at once, dead load, energy, the step.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "base/error.h"
#include "mbs/model_check.h"
#include "mbs/solver.h"
#include "mbs/system.h"
#include "mbs/zone_limits.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr double kStiff = 5e7, kBegin = 40e3, kYield = 100e3, kFlexibility = 3e-8;

/// Yields at 100 kNm, whatever the force, and then bears 100 kNm on.
ZoneLaw make_law() {
  ZoneLaw law;
  law.name = "hinge";
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-8e6, 0, 4e6};
    m->plastic_rotation = {0, 0.3};
    m->positive = m->negative = std::vector<double>(6, kYield);
  }
  law.damage_share = 0.3;
  return law;
}

Cracking make_cracking() { return {{kBegin, 0.5 * kBegin}, {kYield, kYield}, kFlexibility}; }

ZoneParameters make_zone(int stations) {
  ZoneParameters p;
  for (double& k : p.stiffness) k = kStiff;
  p.stations = stations;
  p.law[0] = p.law[1] = 0;
  p.x[0] = stations == 2 ? -1.5 : 0, p.x[1] = 1.5;
  p.cracking[0] = p.cracking[1] = make_cracking();
  return p;
}

/// Rotation of cracks at a moment that is the largest so far; at rest they are known from one that is 1 % larger.
double calc_line(double moment, double ahead = kCracksAhead) {
  const double begin = (moment > 0 ? kBegin : 0.5 * kBegin) / ahead, end = kYield / ahead, size = std::abs(moment);
  if (size > end) return kFlexibility * moment;
  return size < begin ? 0 : std::copysign(kFlexibility * end * (size - begin) / (end - begin), moment);
}

/// One station turned about z in steps of `h`.
struct Turned {
  CompiledLaws laws{compile_law(make_law())};
  ZoneParameters p = make_zone(1);
  ZoneState z;
  double work = 0, rotation = 0;
  void turn(double to, double h, int n = 1000) {
    const double from = rotation;
    for (int i = 1; i <= n; ++i) {
      Six d{};
      d.c[5] = from + (to - from) * i / n;
      const double before = z.elastic_force[5];
      advance_zone(p, laws, d, 0, h, z);
      work += 0.5 * (before + z.elastic_force[5]) * (d.c[5] - rotation);
      rotation = d.c[5];
    }
  }
  double moment() const { return z.elastic_force[5]; }
};

/// The line from where a moment has come to at rest, or cracks begin, on one side to the same on the other: rotation
/// without a moment, and its rise with the moment.
struct Between {
  double bow = 0, flexibility = 0;
  Between(double positive, double negative) {
    const double m[2] = {std::max(positive, kBegin / kCracksAhead), std::min(negative, -0.5 * kBegin / kCracksAhead)};
    const double turn[2] = {calc_line(m[0]), calc_line(m[1])};
    flexibility = (turn[0] - turn[1]) / (m[0] - m[1]);
    bow = turn[0] - flexibility * m[0];
  }
  double rotation_at(double moment) const { return moment / kStiff + bow + flexibility * moment; }
};

TEST(Cracking, FollowsItsLineAndUnloadsTowardsTheOtherSide) {
  constexpr double near = 1e-3;
  Turned t;
  for (const double moment : {30e3, 60e3, 80e3, 98e3}) {
    t.turn(moment / kStiff + calc_line(moment), 0);
    EXPECT_NEAR(t.moment(), moment, near);
  }
  EXPECT_FALSE(t.z.yielded);
  EXPECT_EQ(t.z.station[0].reached, 0);
  // back towards the moment at which the other side cracks; some of it stays without a moment
  const Between down(98e3, 0);
  const double far = t.rotation;
  EXPECT_GT(down.bow, 0.1 * calc_line(98e3));
  EXPECT_LT(down.bow, 0.2 * calc_line(98e3));
  for (const double moment : {49e3, 0.0, -0.99 * 0.5 * kBegin / kCracksAhead, 0.0}) {
    t.turn(down.rotation_at(moment), 0);
    EXPECT_NEAR(t.moment(), moment, near) << moment;
  }
  EXPECT_NEAR(t.z.energy, 0, 1e-9);
  // what is lost is the area between the way there and the way back
  const double up = 0.5 * calc_line(98e3) * (kBegin / kCracksAhead + 98e3) + 0.5 * 98e3 * 98e3 / kStiff;
  const double back = 0.5 * 98e3 * (far - down.bow);
  EXPECT_NEAR(t.z.plastic, up - back, 1e-4 * (up - back));
  EXPECT_NEAR(t.work, t.z.plastic + t.z.energy, 1e-9 * up);
  // there other cracks open, and then the line goes from the one side to the other
  for (const double moment : {-0.5 * kBegin, -60e3, -98e3}) {
    t.turn(moment / kStiff + calc_line(moment), 0);
    EXPECT_NEAR(t.moment(), moment, near);
  }
  const Between both(98e3, -98e3);
  const double lost = t.z.plastic;
  for (const double moment : {0.0, 98e3, -98e3}) {
    t.turn(both.rotation_at(moment), 0);
    EXPECT_NEAR(t.moment(), moment, near) << moment;
  }
  EXPECT_NEAR(t.z.plastic, lost, 1e-9 * lost);
  EXPECT_NEAR(t.work, t.z.plastic + t.z.energy, 1e-9 * t.work);
}

TEST(Cracking, EndsWhereTheStationYields) {
  Turned t;
  // from first yield to where the other side begins to crack
  const Between line(kYield / kCracksAhead, 0);
  t.turn(line.rotation_at(kYield) + 0.01, 0);
  EXPECT_NEAR(t.moment(), kYield, 1);
  EXPECT_NEAR(t.z.station[0].crack[1], line.flexibility, 1e-9 * line.flexibility);
  EXPECT_NEAR(t.z.station[0].bow[1], line.bow, 1e-9 * line.bow);
  EXPECT_NEAR(t.z.station[0].reached, 0.01, 1e-6);  // what cracks turn is no plastic rotation
  // three tenths of that are damage and come back, cracks but for their bow
  t.turn(line.bow + 0.007, 0);
  EXPECT_NEAR(t.moment(), 0, 0.01 * kYield);
}

TEST(Cracking, InsideItsBoundsIsThatOfTheWholeLaw) {
  for (const int stations : {1, 2}) {
    const ZoneParameters p = make_zone(stations);
    const CompiledLaws laws{compile_law(make_law())};
    ZoneState bounded, whole;
    int growths = 0;
    for (int i = 1; i <= 3000; ++i) {
      const double t = 1e-3 * i;
      const Six d{
          {-1e-3 * t, 2e-4 * t * std::sin(3 * t), 1e-4 * t, 0, 4e-4 * t * std::sin(9 * t), 6e-4 * t * std::cos(7 * t)}};
      const double before = bounded.station[0].crack[1];
      const bool had_bounds = is_bounded(bounded, false);
      advance_zone(p, laws, d, t, 1e-3, bounded);
      whole.safe_force[0] = 1, whole.safe_force[1] = -1;
      advance_zone(p, laws, d, t, 1e-3, whole);
      growths += had_bounds && bounded.station[0].crack[1] != before ? 1 : 0;
      for (int c = 0; c < 6; ++c)
        ASSERT_NEAR(bounded.resultant.c[c], whole.resultant.c[c], 1e-9 * kYield) << i << " " << c;
      for (int s = 0; s < stations; ++s)
        for (int q = 0; q < 2; ++q) {
          ASSERT_NEAR(bounded.station[s].crack[q], whole.station[s].crack[q], 1e-12 * kFlexibility) << i;
          ASSERT_NEAR(bounded.station[s].phi[q], whole.station[s].phi[q], 1e-15) << i;
        }
      ASSERT_NEAR(bounded.plastic, whole.plastic, 1e-9 * (bounded.plastic + bounded.energy)) << i;
    }
    EXPECT_GT(growths, 50);
    EXPECT_FALSE(bounded.yielded);
  }
}

TEST(Cracking, InMotionIsALittleBesideItsLine) {
  Turned t;
  int growths = 0;
  double largest = 0;
  for (int i = 1; i <= 4000; ++i) {
    const double to = 4.9e-3 * i / 4000, before = t.z.station[0].crack[1];
    t.turn(to, 1e-4, 1);
    growths += t.z.station[0].crack[1] != before ? 1 : 0;
    // m/k + φ(m) on the line itself
    const double slope = kFlexibility * kYield / (kYield - kBegin);
    const double on_line = std::min(to * kStiff, (to + slope * kBegin) / (1 / kStiff + slope));
    EXPECT_LE(t.moment(), on_line * (1 + 2e-3)) << to;
    largest = std::max(largest, 1 - t.moment() / on_line);
  }
  // what a hundredth of the moment cracks is 2.5 hundredths of what the spring alone turns
  EXPECT_LT(largest, 0.025);
  EXPECT_GT(largest, 0.01);
  EXPECT_GT(growths, 80);
  EXPECT_LT(growths, 110);  // ln(100/40) / ln 1.01 = 92
  EXPECT_NEAR(t.work, t.z.plastic + t.z.energy, 1e-9 * t.work);
}

TEST(Cracking, BothStationsOfAMemberStandOnTheirLines) {
  const CompiledLaws laws{compile_law(make_law())};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> some(-1, 1);
  int cracked[3] = {0, 0, 0};
  for (int i = 0; i < 4000; ++i) {
    ZoneParameters p = make_zone(2);
    p.stiffness[1] = p.stiffness[2] = 12 * kStiff / 9;  // a prismatic member of 3 m
    ZoneState z;
    Six d{};
    d.c[1] = 6e-3 * some(random), d.c[2] = 6e-3 * some(random), d.c[4] = 4e-3 * some(random),
    d.c[5] = 4e-3 * some(random);
    advance_zone(p, laws, d, 0, 0, z);
    for (int q = 0; q < 2; ++q) {
      const double sign = q == 0 ? 1 : -1, shear = z.elastic_force[2 - q];
      int count = 0;
      for (int s = 0; s < 2; ++s) {
        const double m = z.elastic_force[4 + q] + sign * p.x[s] * shear;
        const StationState& st = z.station[s];
        if (z.station[0].reached > 0 || z.station[1].reached > 0) continue;  // yield changes the moments
        EXPECT_NEAR(st.bow[q] + st.crack[q] * m, calc_line(m), 1e-9) << i << " " << q << " " << s << " " << m;
        EXPECT_EQ(st.crack[q] > 0, calc_line(m) != 0);
        count += st.crack[q] > 0 ? 1 : 0;
      }
      ++cracked[count];
    }
  }
  for (const int n : cracked) EXPECT_GT(n, 200);
}

/// A beam of four members in a row, built in at one end, with a weight at the other: moments are known beforehand.
Model make_cantilever(double weight) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const LawId law = add_law(m, make_law());
  BodyId before = kGround;
  for (int i = 0; i < 4; ++i) {
    Body b;
    b.name = "part " + std::to_string(i);
    b.mass = i == 3 ? weight / 9.81 : 1e-3;
    b.inertia = Mat3::diagonal({100, 100, 100});
    b.X_WB.p = {1.0 * (i + 1), 0, 0};
    const BodyId body = add_body(m, b);
    ZoneElement e;
    e.name = "joint " + std::to_string(i), e.a = before, e.b = body;
    if (i == 0) e.X_AF.p = {0, 0, 0};
    e.X_BM.p = {-1, 0, 0};
    e.translational_stiffness = {1e10, 1e10, 1e10};
    e.rotational_stiffness = {kStiff, kStiff, kStiff};
    e.stations = {{0, law}};
    e.cracking[0] = e.cracking[1] = make_cracking();
    add_element(m, e);
    before = body;
  }
  return m;
}

TEST(Cracking, IsFoundUnderDeadLoad) {
  // 24 kN at 4 m: 96, 72, 48 and 24 kNm about y at the joints
  System s(make_cantilever(24e3), {}, 0);
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  double sag = 0;
  for (int i = 0; i < 4; ++i) {
    const double moment = 24e3 * (4 - i);
    sag += (4 - i) * (moment / kStiff + calc_line(moment));
    const StationState& st = s.state.element[static_cast<size_t>(i)].station[0];
    EXPECT_NEAR(st.bow[0] + st.crack[0] * moment, calc_line(moment), 1e-3 * calc_line(moment) + 1e-9) << i;
    EXPECT_FALSE(s.state.element[static_cast<size_t>(i)].yielded);
  }
  EXPECT_NEAR(-Vec3(s.state.p[3]).z, sag, 1e-3 * sag);
  EXPECT_LT(s.summary.equilibrium_iterations, 30);
}

TEST(Cracking, SoftensTheModeThatSetsTheStep) {
  // a part that turns about y on its joint, with a torque of 80 kNm
  Model m = make_cantilever(24e3);
  m.gravity = {};
  m.bodies.resize(1), m.elements.resize(1);
  m.bodies[0].mass = 1e4;
  m.elements[0].X_BM.p = {}, m.elements[0].X_AF.p = m.bodies[0].X_WB.p;
  m.elements[0].translational_stiffness = {1e6, 1e6, 1e6};
  m.elements[0].rotational_stiffness = {1e6, kStiff, 1e6};
  m.elements[0].cracking[1] = {};
  Load load;
  load.name = "torque", load.body = {0}, load.torque = {0, 80e3, 0};
  m.loads.push_back(load);
  System before(m, {}, 0), after(m, {}, 0);
  std::string message;
  ASSERT_TRUE(after.find_equilibrium(message)) << message;
  const double softer = 1 / (1 + kStiff * Between(80e3, 0).flexibility);
  EXPECT_NEAR(after.find_highest_frequency() / before.find_highest_frequency(), std::sqrt(softer), 1e-3);
}

TEST(Cracking, RestsWhereTheDeadLoadHasCrackedIt) {
  Options options;
  options.duration = 0.5;
  options.equilibrium = true;
  options.frame_interval = 0.01;
  std::vector<double> height;
  options.on_frame = [&](const View& v) { height.push_back(v.X_WB[3].p.z); };
  const Summary sum = run(make_cantilever(24e3), options);
  ASSERT_GT(height.size(), 40UL);
  EXPECT_LT(height.front(), -0.01);
  for (const double z : height) EXPECT_NEAR(z, height.front(), 1e-7);
  EXPECT_LT(sum.energy_error, 1e-3);
}

TEST(Cracking, NeedsALineThatRises) {
  for (const auto& change : std::vector<std::function<void(Cracking&)>>{[](Cracking& c) { c.begin[1] = 0; },
                                                                        [](Cracking& c) { c.end[0] = c.begin[0]; },
                                                                        [](Cracking& c) { c.flexibility = -1e-9; }}) {
    Model m = make_cantilever(24e3);
    change(m.elements[2].cracking[1]);
    try {
      check_model(m);
      ADD_FAILURE() << "no error";
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("elements[2].cracking_z"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("joint 2"), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace topple::mbs
