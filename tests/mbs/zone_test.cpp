// The law of a zone on prescribed deformations.
#include "mbs/zone.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "mbs/zone_limits.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr double kStiff = 1e8;  // [N·m/rad] and [N/m]

/// Hinge that hardens from 100 to 120 kNm over 0.01 rad, softens to 20 kNm at 0.05 rad; twice that at N = -1 MN,
/// nothing left at -2 MN and at +0.5 MN; crushing curve with a peak of 2 MN.
ZoneLaw make_law() {
  ZoneLaw law;
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-2e6, -1e6, 0, 0.5e6};
    m->plastic_rotation = {0, 0.01, 0.05, 0.2};
    m->positive = {0, 0, 0, 0, 200e3, 240e3, 40e3, 40e3, 100e3, 120e3, 20e3, 20e3, 0, 0, 0, 0};
    m->negative = m->positive;
  }
  law.compression = {{0, 0.002, 0.02, 0.1}, {1.5e6, 2e6, 0.4e6, 0.4e6}};
  law.tension = {{0, 0.05}, {0.5e6, 0.6e6}};
  law.crush_length = 0.3;
  law.rupture_elongation = 0.06;
  law.rupture_rotation = 0.15;
  law.shear_y = law.shear_z = 150e3;
  law.shear_friction = 0.5;
  law.slip_softening = 0.02;
  law.slip_rupture = 0.1;
  law.torsion = 50e3;
  law.twist_rupture = 0.2;
  return law;
}

ZoneParameters make_parameters(int stations = 1, double x = 0) {
  ZoneParameters p;
  for (int i = 0; i < 6; ++i) p.stiffness[i] = kStiff;
  p.stations = stations;
  p.law[0] = p.law[1] = 0;
  p.x[0] = -x;
  p.x[1] = x;
  return p;
}

struct Walk {
  CompiledLaws laws;
  ZoneParameters p;
  ZoneState z;
  double work = 0;
  Six before;
  explicit Walk(ZoneLaw law = make_law(), ZoneParameters parameters = make_parameters())
      : laws{compile_law(law)}, p(parameters) {}
  /// Goes straight to a deformation in n steps, adding up the work by the trapezium.
  void go(const Six& to, int n = 2000) {
    const Six from = before;
    for (int i = 1; i <= n && z.live; ++i) {
      Six d;
      for (int k = 0; k < 6; ++k) d.c[k] = from.c[k] + (to.c[k] - from.c[k]) * i / n;
      const Six r0 = z.resultant;
      advance_zone(p, laws, d, 0, 0, z);
      for (int k = 0; k < 6; ++k) work += 0.5 * (r0.c[k] + z.resultant.c[k]) * (d.c[k] - before.c[k]);
      before = d;
    }
  }
  double moment_z() const { return z.resultant.c[5]; }
};

Six deform(double u, double phi_y, double phi_z) { return {{u, 0, 0, 0, phi_y, phi_z}}; }

TEST(Zone, FollowsItsCurveWithoutNormalForce) {
  Walk w;
  w.go(deform(0, 0, 0.5e-3));
  EXPECT_NEAR(w.moment_z(), 0.5e-3 * kStiff, 1);  // elastic below 100 kNm
  EXPECT_FALSE(w.z.yielded);
  // total rotation = plastic + elastic: at the peak 0.01 + 120e3/1e8
  w.go(deform(0, 0, 0.01 + 120e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 120e3, 120);
  w.go(deform(0, 0, 0.03 + 70e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 70e3, 300);  // halfway down the softening branch; 2000 steps resolve 0.4 %
  EXPECT_NEAR(w.z.station[0].reached, 0.03, 1e-5);
}

TEST(Zone, NormalForceRaisesTheMoment) {
  Walk w;
  w.go(deform(-0.5e6 / kStiff, 0, 0), 10);
  w.go(deform(-0.5e6 / kStiff, 0, 0.01 + 180e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 180e3, 200);  // between 120 at 0 and 240 at -1 MN
  EXPECT_NEAR(w.z.resultant.c[0], -0.5e6, 1e-3);
}

TEST(Zone, FollowsTheFamilyWhenTheForceChanges) {
  Walk w;
  w.go(deform(0, 0, 0.01 + 120e3 / kStiff));
  // the force comes later, at a held rotation: the limit rises and the moment stays
  const double held = w.moment_z();
  w.go(deform(-1e6 / kStiff, 0, 0.01 + 120e3 / kStiff), 50);
  EXPECT_NEAR(w.moment_z(), held, 1);
  // and the moment rises elastically to the curve of the new force
  w.go(deform(-1e6 / kStiff, 0, 0.01 + 240e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 240e3, 300);
}

TEST(Zone, BothAxesShareTheSection) {
  Walk w;
  w.go(deform(0, 0.004, 0.004));
  const double my = w.z.resultant.c[4], mz = w.z.resultant.c[5];
  EXPECT_NEAR(my, mz, 1e-6 * my);
  EXPECT_TRUE(w.z.yielded);
  double L = 0;
  {
    int k = 0, j = 0;
    L = calc_moment_limit(w.laws[0].moment[0], 0, w.z.station[0].reached, k, j).positive;
  }
  EXPECT_NEAR(std::pow(my / L, 1.5) + std::pow(mz / L, 1.5), 1, 1e-3);
}

TEST(Zone, TurnsAboutTheWeakAxisSpareTheStrongOne) {
  // a panel: about z its edges are four times as far away
  ZoneLaw law = make_law();
  law.rotation_ratio = 4;
  for (double& rotation : law.moment_z.plastic_rotation) rotation /= 4;
  {
    Walk w(law);
    w.go(deform(0, 0.05 + 20e3 / kStiff, 0));  // about y down to 20 kNm
    EXPECT_NEAR(w.z.station[0].reached, 0.05, 1e-4);
    EXPECT_NEAR(w.z.station[0].strained, 0.05, 1e-4);
    w.go(deform(0, 0.05, 0.01));  // let go, then about z at 0.05 / 4: on the same column of the family
    EXPECT_NEAR(w.moment_z(), 20e3, 300);
  }
  {
    Walk w(law);
    w.go(deform(0, 0.01 + 120e3 / kStiff, 0));
    w.go(deform(0, 0.01, 0));
    w.go(deform(0, 0.01, 0.0005));
    EXPECT_NEAR(w.moment_z(), 50e3, 1);  // springs back: about y it is at its peak, and so it is about z
    w.go(deform(0, 0.01, 0.0005 + 120e3 / kStiff));
    EXPECT_GT(w.moment_z(), 115e3);
  }
  {
    Walk w(law);
    w.go(deform(0, 0, 0.01 + 80e3 / kStiff));  // 10 mrad about z do as 40 mrad about y
    // M = 120e3 - 100e3 (s - 0.01) / 0.04 with s = 4 (0.0108 - M / 1e8)
    EXPECT_NEAR(w.moment_z(), 37e3 / 0.9, 200);
    EXPECT_NEAR(w.z.station[0].reached, w.z.station[0].strained / 4, 1e-9);
    EXPECT_NEAR(w.z.station[0].strained, 0.0432 - 4 * 37e3 / 0.9 / kStiff, 2e-5);
  }
}

TEST(Zone, IsCrushedAsFarAsItsEdgesAreStrained) {
  ZoneLaw law = make_law();
  law.compression = {}, law.rotation_ratio = 4;
  // 2 MN until 10 mrad about y, 1 MN from 20 mrad on
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->plastic_rotation = {0, 0.01, 0.02, 0.2};
    m->normal_force = {-2e6, -1e6, 0, 0.5e6};
    m->positive = {1, 1, 0, 0, 100e3, 100e3, 0, 0, 100e3, 100e3, 100e3, 100e3, 0, 0, 0, 0};
    m->negative = m->positive;
  }
  for (double& rotation : law.moment_z.plastic_rotation) rotation /= 4;
  const auto bears = [&](double about_y, double about_z) {
    Walk w(law);
    w.go(deform(0, about_y, about_z));
    w.go(deform(-3e6 / kStiff, about_y, about_z));
    return -w.z.resultant.c[0];
  };
  const double springs = 100e3 / kStiff;
  const double about_y = bears(0.013 + springs, 0), about_z = bears(0, 0.013 / 4 + springs / 4);
  EXPECT_LT(about_y, 0.95 * bears(0.002, 0));
  EXPECT_NEAR(about_y, about_z, 0.05 * about_y);
  EXPECT_LT(bears(0, 0.013 + springs), 0.9 * about_y);
}

TEST(Zone, AnotherLawCountsRotationsItsOwnWay) {
  ZoneLaw law = make_law(), panel = make_law();
  panel.rotation_ratio = 4;
  Walk w(law);
  w.laws.push_back(compile_law(panel));
  w.go(deform(0, 0.006, 0.008));
  StationState& st = w.z.station[0];
  ASSERT_GT(st.reached, 0.005);
  EXPECT_EQ(st.strained, st.reached);
  begin_switch(w.p, w.laws, {.law = 1, .time = 0, .ramp = 0, .stiffness_share = 1}, w.z);
  const double length = std::hypot(st.phi[0], st.phi[1]);
  EXPECT_NEAR(st.strained, st.reached * std::hypot(st.phi[0], 4 * st.phi[1]) / length, 1e-12);
  begin_switch(w.p, w.laws, {.law = 0, .time = 0, .ramp = 0, .stiffness_share = 1}, w.z);
  EXPECT_NEAR(st.strained, st.reached, 1e-12);
}

TEST(Zone, AnotherMeasureChangesNothingAtTheFirstInstant) {
  // turned about z alone, which both laws bear alike; the share of the law that comes is still nothing
  ZoneLaw panel = make_law();
  panel.rotation_ratio = 0.25;
  Walk w, as_before;
  w.laws.push_back(compile_law(panel));
  for (Walk* one : {&w, &as_before}) one->go(deform(0, 0, 0.03));
  begin_switch(w.p, w.laws, {.law = 1, .time = 0, .ramp = 1, .stiffness_share = 1}, w.z);
  for (Walk* one : {&w, &as_before}) one->go(deform(0, 0, 0.031));
  EXPECT_NEAR(w.moment_z(), as_before.moment_z(), 1e-6 * as_before.moment_z());
  EXPECT_NEAR(w.z.station[0].strained, 0.25 * as_before.z.station[0].strained, 1e-9);
}

TEST(Zone, AnotherLawsLimitsHoldAtOnce) {
  ZoneLaw half = make_law();
  for (double& m : half.moment_z.positive) m *= 0.5;
  Walk w;
  w.laws.push_back(compile_law(half));
  const auto turn = [&](double moment) { advance_zone(w.p, w.laws, deform(0, 0, moment / kStiff), 0, 1e-4, w.z); };
  for (const double moment : {30e3, 31e3, 32e3}) turn(moment);  // far enough inside its limits to get bounds
  ASSERT_TRUE(is_bounded(w.z, false));
  begin_switch(w.p, w.laws, {.law = 1, .time = 0, .ramp = 0, .stiffness_share = 1}, w.z);
  for (const double moment : {33e3, 34e3, 58e3}) turn(moment);
  EXPECT_NEAR(w.z.elastic_force[5], 50e3, 100);  // and 1 kNm more for each 0.01 rad
}

TEST(Zone, UnloadsElasticallyAndKeepsItsPlasticRotation) {
  Walk w;
  w.go(deform(0, 0, 0.01 + 120e3 / kStiff));
  w.go(deform(0, 0, 0.01));
  EXPECT_NEAR(w.moment_z(), 0, 200);
  EXPECT_NEAR(w.z.station[0].phi[1], 0.01, 1e-5);
  w.go(deform(0, 0, 0.01 - 119e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), -119e3, 300);  // the other direction has the limit of the rotation reached
}

TEST(Zone, DamageRecoversItsShareOnUnloading) {
  ZoneLaw law = make_law();
  law.damage_share = 0.4;
  Walk w(law);
  w.go(deform(0, 0, 0.01 + 120e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 120e3, 200);
  const double phi = w.z.station[0].phi[1];
  EXPECT_NEAR(phi, 0.6 * 0.01, 2e-4);  // the rest returns when the moment is gone
  w.go(deform(0, 0, phi));
  EXPECT_NEAR(w.moment_z(), 0, 200);
  w.go(deform(0, 0, 0.01 + 120e3 / kStiff));
  EXPECT_NEAR(w.moment_z(), 120e3, 500);  // and the way back ends where it began
}

TEST(Zone, StandsNoHigherThanTheRotationOfItsDamageAllows) {
  // a force that grows raises the limit, and the rotation grows on the flexibility of damage before anything flows;
  // at 0 kN 70 kN·m are left at 0.03 rad, at -1 MN twice as much
  const auto limit_at = [](double rotation, double N) {
    const double low = rotation < 0.05 ? 120e3 - (rotation - 0.01) / 0.04 * 100e3 : 20e3;
    return low * (1 - N / 1e6);
  };
  for (const double damage : {0.3, 0.8}) {
    double fall[2] = {0, 0};
    for (const int finer : {1, 10}) {
      ZoneLaw law = make_law();
      law.damage_share = damage;
      law.rupture_rotation = law.rupture_rotation_pressed = 0.06;
      Walk w(law);
      w.go(deform(0, 0, 0.03 + 70e3 / kStiff));
      ASSERT_GT(w.z.station[0].reached, 0.029);
      double above = 0, most = 0, before = w.moment_z(), largest = 0;
      const double u = -0.8e6 / kStiff, turn = w.before.c[5];
      for (int i = 1; i <= 2000 * finer && w.z.live; ++i) {
        const double part = i / (2000.0 * finer);
        w.go(deform(u * std::min(1.0, 20 * part), 0, turn + 0.05 * part), 1);
        if (!w.z.live) break;
        const double m = w.moment_z(), rotation = w.z.station[0].phi[1] + w.z.station[0].soft[1] * m;
        most = std::max(most, rotation);
        above = std::max(above, m - limit_at(rotation, w.z.resultant.c[0]));
        largest = std::max(largest, before - m);
        before = m;
        EXPECT_LT(rotation - w.z.station[0].reached, 1e-12);
      }
      EXPECT_LT(above, 300.0 / finer) << damage;  // the limit is that of the step before
      fall[finer == 1 ? 0 : 1] = largest;
      EXPECT_FALSE(w.z.live) << damage;
      EXPECT_NEAR(most, 0.06, 1e-4 / finer) << damage;
    }
    EXPECT_LT(fall[1], 0.2 * fall[0]) << damage;
    EXPECT_LT(fall[0], 400) << damage;
  }
}

TEST(Zone, OfDamageStandsWhereItStoodWhileItIsASpring) {
  // random walks under forces that come and go, evaluated with and without safe bounds
  std::mt19937 random(3);
  std::uniform_real_distribution<double> even(-1, 1);
  for (const double damage : {0.3, 0.8})
    for (int walk = 0; walk < 10; ++walk) {
      ZoneLaw law = make_law();
      law.damage_share = damage;
      Walk bounded(law), free(law);
      for (int leg = 0; leg < 30; ++leg) {
        const Six from = bounded.before, to = deform(0.005 * even(random) - 0.005, 0, 0.03 * even(random));
        for (int i = 1; i <= 100; ++i) {
          Six at = from;
          for (int c : {0, 5}) at.c[c] += (to.c[c] - from.c[c]) * i / 100;
          free.z.safe_force[0] = 1, free.z.safe_force[1] = -1;
          bounded.go(at, 1), free.go(at, 1);
          ASSERT_NEAR(bounded.z.resultant.c[5], free.z.resultant.c[5], 1e-9 * 200e3)
              << damage << " " << walk << " " << leg;
        }
      }
    }
}

TEST(Zone, ASofterStiffnessIsNoRotation) {
  // what a softer spring stretches further under the moment that it bears turns no station
  for (const double damage : {0.0, 0.3}) {
    ZoneLaw law = make_law();
    law.damage_share = damage;
    law.rupture_rotation = law.rupture_rotation_pressed = 0.03;
    Walk w(law);
    w.go(deform(-0.005, 0, 0.006));
    const double reached = w.z.station[0].reached;
    ASSERT_GT(reached, 0.004);
    begin_switch(w.p, w.laws, {0, 0, 0, 0.02}, w.z);
    for (int i = 0; i < 5; ++i) w.go(w.before, 1);
    w.go(deform(-0.005, 0, 0.0061));
    EXPECT_TRUE(w.z.live) << damage;
    EXPECT_NEAR(w.z.station[0].reached, reached, 2e-4) << damage;
  }
}

TEST(Zone, WorkIsStoredOrDissipated) {
  for (const double share : {0.0, 0.4}) {
    ZoneLaw law = make_law();
    law.damage_share = share;
    Walk w(law);
    w.go(deform(-0.3e6 / kStiff, 0, 0));
    w.go(deform(-0.3e6 / kStiff, 0.003, 0.02), 20000);
    w.go(deform(-0.1e6 / kStiff, -0.004, -0.02), 20000);
    w.go(deform(0.2e6 / kStiff, 0.001, 0.03), 20000);
    ASSERT_TRUE(w.z.live);
    EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 2e-3 * w.work);  // trapezium on 20000 steps through corners
    EXPECT_GT(w.z.plastic, 0);
  }
}

/// make_law() that lengthens by 0.1 m/rad without force and shortens by 0.2 m/rad at -1 MN, half as much with negative
/// rotations.
ZoneLaw make_lifting_law(double times = 1) {
  ZoneLaw law = make_law();
  const double lift[4] = {-0.5 * times, -0.2 * times, 0.1 * times, 0.1 * times};
  for (MomentFamily* m : {&law.moment_y, &law.moment_z})
    for (size_t k = 0; k < 4; ++k)
      for (const double phi : m->plastic_rotation) {
        m->elongation_positive.push_back(lift[k] * phi);
        m->elongation_negative.push_back(0.5 * lift[k] * phi);
      }
  return law;
}

/// Goes to a rotation about z under a given force.
void turn_at(Walk& w, double N, double to, int n = 2000) {
  const double from = w.before.c[5];
  for (int i = 1; i <= n; ++i) w.go(deform(N / kStiff + w.z.axial, 0, from + (to - from) * i / n), 1);
}

TEST(Zone, ShortensOrLengthensAsItsRotationGrows) {
  for (const double N : {0.0, -0.5e6, -1e6}) {
    const double lift = 0.1 + 0.3 * N / 1e6;  // linear in the force between rows
    Walk w(make_lifting_law());
    turn_at(w, N, 0.02);
    double reached = w.z.station[0].reached;
    EXPECT_GT(reached, 0.017);
    EXPECT_NEAR(w.z.axial, lift * reached, 1e-9);
    EXPECT_EQ(w.z.shortened + w.z.elongated, 0);  // nothing of it is crushed or torn
    // back and to as much on the other side it stays
    const double kept = w.z.axial;
    turn_at(w, N, -0.015);
    EXPECT_EQ(w.z.axial, kept);
    EXPECT_EQ(w.z.station[0].reached, reached);
    // and goes on from there with the table of that side
    turn_at(w, N, -0.03);
    EXPECT_NEAR(w.z.axial, kept + 0.5 * lift * (w.z.station[0].reached - reached), 1e-9);
    EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 1e-3 * w.work);
  }
}

TEST(Zone, PullsUntilAStationHasTurnedAsFarAsItsOwnLawAllows) {
  // the strong station does not turn, the other one by 0.1 rad
  ZoneLaw strong = make_law(), weak = make_law();
  for (MomentFamily* f : {&strong.moment_y, &strong.moment_z})
    for (auto* list : {&f->positive, &f->negative})
      for (double& m : *list) m *= 100;
  for (const bool is_weak_first : {false, true})
    for (const bool is_weak_brittle : {false, true}) {
      strong.rupture_rotation = is_weak_brittle ? 1 : 0.05;
      weak.rupture_rotation = is_weak_brittle ? 0.05 : 1;
      strong.rupture_rotation_pressed = weak.rupture_rotation_pressed = 1;
      Walk w(is_weak_first ? weak : strong, make_parameters(2, 0));
      w.laws.push_back(compile_law(is_weak_first ? strong : weak));
      w.p.law[1] = 1;
      w.go(deform(-0.1e6 / kStiff, 0, 0.1));
      ASSERT_TRUE(w.z.live);
      ASSERT_GT(w.z.station[is_weak_first ? 0 : 1].reached, 0.09);
      ASSERT_EQ(w.z.station[is_weak_first ? 1 : 0].reached, 0);
      w.go(deform(w.before.c[0] + 0.15e6 / kStiff, 0, 0.1), 100);
      if (is_weak_brittle)
        EXPECT_EQ(w.z.resultant.c[0], 0) << is_weak_first;
      else
        EXPECT_GT(w.z.resultant.c[0], 0.02e6) << is_weak_first;
    }
}

TEST(Zone, HoldsWhilePressedBeyondItsRupture) {
  ZoneLaw law = make_law();
  law.rupture_rotation_pressed = 0.18;
  Walk pressed(law);
  turn_at(pressed, -0.5e6, 0.17);
  ASSERT_TRUE(pressed.z.live);
  EXPECT_GT(pressed.z.station[0].reached, 0.16);
  EXPECT_NEAR(pressed.z.resultant.c[0], -0.5e6, 1);
  EXPECT_NEAR(pressed.moment_z(), 30e3, 1);  // what the family leaves from 0.05 rad on, between its rows
  EXPECT_NEAR(pressed.z.energy + pressed.z.plastic, pressed.work, 2e-3 * pressed.work);
  // it does not pull, and bears again when it is pressed again
  Walk lifted = pressed;
  const auto lift = [&lifted](double by) {
    for (int i = 1; i <= 100; ++i) lifted.go(deform(lifted.before.c[0] + by / 100, 0, 0.17), 1);
  };
  lift(0.5e6 / kStiff + 2e-3);
  ASSERT_TRUE(lifted.z.live);
  EXPECT_EQ(lifted.z.resultant.c[0], 0);
  EXPECT_NEAR(lifted.z.elongated, 2e-3, 1e-9);
  lift(-1e-4);
  EXPECT_NEAR(lifted.z.resultant.c[0], -1e-4 * kStiff, 1);
  EXPECT_NEAR(lifted.z.energy + lifted.z.plastic, lifted.work, 2e-3 * lifted.work);
  // apart when it is drawn as far as its bars bear
  lift(law.rupture_elongation);
  EXPECT_FALSE(lifted.z.live);
  EXPECT_EQ(lifted.z.reason, BreakReason::Tension);
  EXPECT_NEAR(lifted.z.plastic, lifted.work, 2e-3 * lifted.work);
  // or turned to the end
  turn_at(pressed, -0.5e6, 0.19);
  EXPECT_FALSE(pressed.z.live);
  EXPECT_EQ(pressed.z.reason, BreakReason::Rotation);
  EXPECT_NEAR(pressed.z.station[0].reached, 0.18, 1e-4);
  // without pressure, and without the second rotation, at the first
  for (const double N : {0.0, -0.5e6}) {
    law.rupture_rotation_pressed = N < 0 ? 0.1 : 0.18;  // less than the first: not used
    Walk w(law);
    turn_at(w, N, 0.17);
    EXPECT_FALSE(w.z.live);
    EXPECT_NEAR(w.z.station[0].reached, 0.15, 1e-4);
  }
}

TEST(Zone, StaysOnItsCurveWhileItIsCrushedAndTurned) {
  // crushed at 2 MN whatever its length, and shortened by its rotation: in few steps as in many
  ZoneLaw law = make_lifting_law();
  law.compression = {{0, 0.1}, {2e6, 2e6}};
  double shortened[2];
  for (const int n : {100, 1600}) {
    Walk w(law);
    w.go(deform(-0.002 - 2e6 / kStiff, 0, 0));
    for (int i = 1; i <= n; ++i) {
      w.go(deform(-0.002 - 2e6 / kStiff - 0.02 * i / n, 0, 0.02 * i / n), 1);
      ASSERT_NEAR(w.z.resultant.c[0], -2e6, 1) << n << " " << i;
    }
    EXPECT_GT(w.z.station[0].reached, 0.01);
    EXPECT_LT(w.z.lifted, -1e-3);
    EXPECT_NEAR(-w.z.axial, w.z.shortened - w.z.lifted, 1e-12);
    shortened[n > 100] = w.z.shortened;
  }
  EXPECT_NEAR(shortened[0], shortened[1], 0.01 * shortened[1]);
}

TEST(Zone, LengthensByBothStations) {
  ZoneLaw law = make_lifting_law();
  law.shear_y = law.shear_z = kUnlimited;
  Walk w(law, test::make_member());
  for (int i = 1; i <= 4000; ++i) w.go({{w.z.axial, 0.03 * i / 4000, 0, 0, 0, 0}}, 1);
  // one turns forwards, one backwards
  EXPECT_LT(w.z.station[0].phi[1] * w.z.station[1].phi[1], 0);
  EXPECT_NEAR(w.z.axial, 0.1 * 1.5 * w.z.station[0].reached, 1e-3 * w.z.axial);
}

TEST(Zone, GivesNoEnergyThroughItsLength) {
  // 2.5 m/rad would lift 0.9 MN with more work than the bending brings
  for (const double share : {0.0, 0.4}) {
    ZoneLaw law = make_lifting_law(-15);
    law.damage_share = share;
    Walk w(law);
    w.go(deform(-0.9e6 / kStiff, 0, 0), 10);
    double before = w.z.plastic, by = 0;
    for (int i = 1; i <= 4000; ++i) {
      const double axial = w.z.axial;
      w.go(deform(-0.9e6 / kStiff + axial, 0.003 * i / 4000, 0.02 * i / 4000), 1);
      // the force, changed by the elongation, is put back in the next step: its work is that of the elongation before
      const double now = w.z.axial - axial;
      const double lag = 0.9e6 * std::abs(now - by) + kStiff * (now * now + by * by);
      EXPECT_GE(w.z.plastic, before - lag - 1e-9) << i;
      before = w.z.plastic, by = w.z.axial - axial;
    }
    EXPECT_GT(w.z.axial, 1e-3);
    EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 1e-3 * std::abs(w.work));
  }
}

TEST(Zone, IsLengthenedFromOutsideWithoutLosingEnergy) {
  Walk w;
  const Six d{{-4e-3, 0.4e-3, -0.3e-3, 1e-4, 2e-4, -3e-4}};
  w.go(d, 50);
  const double force = w.z.resultant.c[0], stored = w.z.energy;
  elongate_zone(w.p, -1e-3, w.z);
  w.go(d, 1);
  EXPECT_NEAR(w.z.resultant.c[0], force + 1e-3 * kStiff, 1e-6);
  // the force fell from 0.4 to 0.3 MN on the way
  EXPECT_NEAR(stored - w.z.energy, 0.35e6 * 1e-3, 1e-6 * stored);
  EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 1e-12 * w.work);
}

TEST(Zone, OfBarsThatHaveBuckledPullsOnlyWhenTheyAreStraight) {
  ZoneLaw law = make_law();
  law.moment_y = law.moment_z = {};
  law.compression = {{0, 0.002, 0.02}, {1e5, 1e5, 2e4}};
  law.tension = {{0, 0.05}, {3e5, 3e5}};
  law.buckles = true;
  Walk w(law);
  const auto force = [&] { return w.z.resultant.c[0]; };
  const auto buckling = [&] { return 1e5 - 8e4 * (w.z.shortened - 0.002) / 0.018; };
  w.go(deform(-0.02, 0, 0));
  EXPECT_NEAR(w.z.shortened, 0.02 - buckling() / kStiff, 1e-7);
  EXPECT_NEAR(force(), -buckling(), 10);
  const double spent = w.z.plastic;
  EXPECT_NEAR(spent, 1e5 * 0.002 + 0.5 * (1e5 + buckling()) * (w.z.shortened - 0.002), 10);
  // back: nothing pulls, nothing is spent
  w.go(deform(-0.01, 0, 0));
  EXPECT_NEAR(force(), 0, 1e-6);
  EXPECT_NEAR(w.z.shortened, 0.01, 1e-9);
  EXPECT_NEAR(w.z.plastic, spent, 1e-3);
  // pushed together again they bear what they do when shortened by so much
  w.go(deform(-0.012, 0, 0));
  EXPECT_NEAR(w.z.shortened, 0.012 - buckling() / kStiff, 1e-7);
  EXPECT_NEAR(force(), -buckling(), 10);
  // straight: the spring from where it began, up to its limit
  w.go(deform(2e-3, 0, 0));
  EXPECT_NEAR(force(), 2e-3 * kStiff, 1);
  EXPECT_EQ(w.z.shortened, 0);
  w.go(deform(0.01, 0, 0));
  EXPECT_NEAR(force(), 3e5, 1);
  EXPECT_NEAR(w.z.elongated, 0.01 - 3e5 / kStiff, 1e-9);
  // and it buckles anew at its first force, from its new length on
  w.go(deform(0.01 - 3e5 / kStiff - 0.0015, 0, 0));
  EXPECT_NEAR(force(), -1e5, 1);
  EXPECT_NEAR(w.work, w.z.energy + w.z.plastic, 1e-3 * w.work);
}

TEST(Zone, CrushesDownItsCurveAndBreaksAtItsLength) {
  Walk w;
  w.go(deform(-0.002 - 2e6 / kStiff, 0, 0));
  EXPECT_NEAR(-w.z.resultant.c[0], 2e6, 5e3);
  w.go(deform(-0.011 - 1.2e6 / kStiff, 0, 0));
  EXPECT_NEAR(-w.z.resultant.c[0], 1.2e6, 1e4);
  w.go(deform(-0.1, 0, 0));
  EXPECT_NEAR(-w.z.resultant.c[0], 0.4e6, 1e3);
  EXPECT_TRUE(w.z.live);
  w.go(deform(-0.32, 0, 0));
  EXPECT_FALSE(w.z.live);
  EXPECT_EQ(w.z.reason, BreakReason::Crushing);
}

// A spring and a curve in series, however steep that is.
TEST(Zone, FollowsCurvesThatRiseMoreSteeplyThanItsSpring) {
  for (const double share : {0.2, 1.0, 4.0, 100.0})
    for (const double sign : {1.0, -1.0}) {
      const double slope = share * kStiff, most = 1e6;
      ZoneLaw law;
      (sign > 0 ? law.tension : law.compression) = {{0, most / slope, 1}, {0, most, most}};
      Walk w(law);
      const double whole = most * (1 / kStiff + 1 / slope);
      for (const double part : {0.3, 0.9}) {
        w.go(deform(sign * part * whole, 0, 0), 50);
        EXPECT_NEAR(sign * w.z.resultant.c[0], part * most, 1e-9 * most) << share << " " << sign;
        EXPECT_NEAR(sign > 0 ? w.z.elongated : w.z.shortened, part * most / slope, 1e-9 * whole);
      }
      // straight back, then on where it was
      w.go(deform(sign * (0.9 * whole - 0.5 * most / kStiff), 0, 0), 50);
      EXPECT_NEAR(sign * w.z.resultant.c[0], 0.4 * most, 1e-9 * most);
      w.go(deform(sign * 1.5 * whole, 0, 0), 50);
      EXPECT_NEAR(sign * w.z.resultant.c[0], most, 1e-9 * most);
      EXPECT_NEAR(w.work, w.z.energy + w.z.plastic, 1e-3 * w.work);
    }
}

TEST(Zone, RotationTakesCompressionCapacityAway) {
  // beyond 0.05 rad this family carries no moment under 1 MN and more: that is then all the zone can carry
  ZoneLaw law = make_law();
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->positive = {0, 0, 0, 0, 200e3, 240e3, 0, 0, 100e3, 120e3, 20e3, 20e3, 0, 0, 0, 0};
    m->negative = m->positive;
  }
  Walk w(law);
  w.go(deform(-1.4e6 / kStiff, 0, 0), 10);
  EXPECT_NEAR(w.z.resultant.c[0], -1.4e6, 1);
  w.go(deform(-1.4e6 / kStiff, 0, 0.06), 4000);
  EXPECT_GE(w.z.resultant.c[0], -1e6 - 1);  // it has given way
  EXPECT_GT(w.z.shortened, 0);
}

TEST(Zone, BreaksInTensionShearTorsionAndRotation) {
  const struct {
    Six to;
    BreakReason reason;
  } cases[] = {{{{0.08, 0, 0, 0, 0, 0}}, BreakReason::Tension},
               {{{0, 0.12, 0, 0, 0, 0}}, BreakReason::Shear},
               {{{0, 0, -0.12, 0, 0, 0}}, BreakReason::Shear},
               {{{0, 0, 0, 0.25, 0, 0}}, BreakReason::Torsion},
               {{{0, 0, 0, 0, 0, 0.18}}, BreakReason::Rotation}};
  for (const auto& c : cases) {
    Walk w;
    w.go(c.to);
    EXPECT_FALSE(w.z.live);
    EXPECT_EQ(w.z.reason, c.reason);
    EXPECT_EQ(w.z.energy, 0);
    EXPECT_NEAR(w.z.plastic, w.work, 5e-3 * w.work);
    for (const double f : w.z.resultant.c) EXPECT_EQ(f, 0);
  }
}

TEST(Zone, TwoStationsOfAMemberYieldAtItsEnds) {
  // a member of length 3 in double curvature: shear 2M/L when both ends have yielded
  ZoneLaw law = make_law();
  law.shear_y = law.shear_z = kUnlimited;
  const double L = test::kMemberLength, EI = test::kMemberEI;
  Walk w(law, test::make_member());
  const double u = L * (0.004 + 100e3 / (6 * EI / L));
  w.go({{0, u, 0, 0, 0, 0}}, 4000);
  // both ends turned by 0.004: the limit there is 108 kNm
  EXPECT_NEAR(w.z.resultant.c[1], 2 * 108e3 / L, 0.005 * 2 * 108e3 / L);
  EXPECT_NEAR(w.z.station[0].phi[1], -w.z.station[1].phi[1], 1e-5);  // one step is 2e-6
  EXPECT_NEAR(w.z.resultant.c[5], 0, 1e-3 * 108e3);                  // no moment at mid-length
  EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 2e-3 * w.work);
}

TEST(Zone, AStationThatDoesNotTurnSpringsBack) {
  // one station is damaged and unloaded, then the other one turns alone: what is left of the first one's rotation stays
  ZoneLaw weak = make_law(), strong = make_law();
  weak.damage_share = strong.damage_share = 0.4;
  for (ZoneLaw* law : {&weak, &strong}) law->shear_y = law->shear_z = kUnlimited;
  for (MomentFamily* f : {&strong.moment_y, &strong.moment_z})
    for (std::vector<double>* row : {&f->positive, &f->negative})
      for (double& v : *row) v *= 3;
  Walk w(strong, test::make_member(1));
  w.laws.push_back(compile_law(weak));
  const double k = w.p.stiffness[5], shear = w.p.stiffness[1], half = 0.5 * test::kMemberLength;
  w.go({{0, -half * 0.01, 0, 0, 0, 110e3 / k + 0.01}});
  ASSERT_GT(w.z.station[1].soft[1], 0);
  ASSERT_EQ(w.z.station[0].phi[1], 0);
  const double left = w.z.station[1].phi[1];
  w.go({{0, -half * left, 0, 0, 0, left}});
  EXPECT_NEAR(w.z.resultant.c[5], 0, 1);
  const StationState damaged = w.z.station[1];
  // from 300 kN·m on at the first station, with 20 to 80 at the other one
  double most = 0;
  for (const double plastic : {0.0, 0.001, 0.002, 0.003}) {
    w.go({{0, 110e3 / half / shear + half * (plastic - left), 0, 0, 0, left + 190e3 / k + plastic}});
    most = std::max(most, std::abs(w.z.resultant.c[5] - half * w.z.resultant.c[1]));
  }
  EXPECT_GT(most, 20e3);
  EXPECT_LT(most, 90e3);
  EXPECT_GT(w.z.station[0].phi[1], 1e-4);
  EXPECT_EQ(w.z.station[1].soft[1], damaged.soft[1]);
  EXPECT_NEAR(w.z.station[1].phi[1], damaged.phi[1], 1e-12);
}

/// Walks at random about both axes at once, with the stations listed one way and the other; how far both have turned.
///   near  share of the limit by which moments and shears may differ
double walk_both_ways(std::mt19937& random, const ZoneParameters& member, double damage, int legs, double near) {
  std::uniform_real_distribution<double> even(-1, 1);
  constexpr int bending[] = {1, 2, 4, 5};
  constexpr double limit = 100e3;
  ZoneLaw law = test::plastic_hinge(limit);
  law.moment_y = law.moment_z, law.damage_share = damage;
  Walk one(law, member), other(law, member);
  std::swap(other.p.x[0], other.p.x[1]);
  for (int leg = 0; leg < legs; ++leg) {
    const Six from = one.before;
    Six to;
    for (int c : bending) to.c[c] = 0.02 * even(random);
    for (int i = 1; i <= 200; ++i) {
      Six at = from;
      for (int c : bending) at.c[c] += (to.c[c] - from.c[c]) * i / 200;
      one.go(at, 1), other.go(at, 1);
      for (int c : bending)
        EXPECT_NEAR(one.z.resultant.c[c], other.z.resultant.c[c], near * limit) << damage << " " << leg << " " << i;
    }
  }
  double turned = 0;
  for (int s : {0, 1}) turned = std::max(turned, std::min(one.z.station[s].reached, other.z.station[1 - s].reached));
  return turned;
}

TEST(Zone, ItDoesNotMatterWhichStationIsListedFirst) {
  std::mt19937 random(7);
  for (const double damage : {0.0, 0.3}) {
    double turned = 0;
    for (int walk = 0; walk < 8; ++walk)
      turned = std::max(turned, walk_both_ways(random, test::make_member(), damage, 6, 1e-7));
    EXPECT_GT(turned, 0.01);
  }
}

TEST(Zone, ItDoesNotMatterWhichStationOfADeepOrSlenderMemberIsListedFirst) {
  // stations that hardly feel themselves beside the other one: many turns
  std::mt19937 random(11);
  for (const double deep : {0.05, 10.0}) {
    ZoneParameters member = test::make_member();
    member.stiffness[1] *= deep, member.stiffness[2] *= deep;
    EXPECT_GT(walk_both_ways(random, member, 0, 20, 1e-6), 0.01);
  }
}

TEST(Zone, NeverGivesBackWhatWasDissipated) {
  // random walks of two stations, damaged to different shares
  std::mt19937 random(5);
  std::uniform_real_distribution<double> even(-1, 1);
  for (const double first : {0.0, 0.3, 0.9})
    for (const double second : {0.0, 0.3, 0.9})
      for (int walk = 0; walk < 4; ++walk) {
        ZoneLaw laws[2] = {test::plastic_hinge(100e3), test::plastic_hinge(100e3)};
        laws[0].damage_share = first, laws[1].damage_share = second;
        Walk w(laws[0], test::make_member(1));
        w.laws.push_back(compile_law(laws[1]));
        double most = 0, fall = 0;
        for (int leg = 0; leg < 8; ++leg) {
          const Six from = w.before;
          Six to;
          to.c[1] = 0.02 * even(random), to.c[5] = 0.02 * even(random);
          for (int i = 1; i <= 200; ++i) {
            Six at = from;
            for (int c : {1, 5}) at.c[c] += (to.c[c] - from.c[c]) * i / 200;
            w.go(at, 1);
            most = std::max(most, w.z.plastic), fall = std::max(fall, most - w.z.plastic);
          }
        }
        EXPECT_GT(most, 100);
        EXPECT_LT(fall, 1e-9 * most) << first << " " << second << " " << walk;
      }
}

TEST(Zone, AChargeTakesTheLimitsAwayWithinItsRamp) {
  ZoneLaw weak = make_law();
  for (double& f : weak.compression.f) f *= 0.1;
  Walk w;
  w.laws.push_back(compile_law(weak));
  w.go(deform(-1e6 / kStiff, 0, 0), 10);
  w.z.next_law = 1;
  w.z.ramp_begin = 0;
  w.z.ramp = 0.01;
  const Six d = deform(-1e6 / kStiff, 0, 0);
  for (int i = 1; i <= 10; ++i) advance_zone(w.p, w.laws, d, 0.001 * i, 0.001, w.z);
  EXPECT_NEAR(-w.z.resultant.c[0], 0.2e6, 0.2e6 * 0.3);  // at the foot of the weak curve: 0.15 to 0.2 MN
  EXPECT_LT(-w.z.resultant.c[0], 0.21e6);
}

TEST(Zone, AChargeFindsTheLawThatGoesWhereItStood) {
  // turned far about z, which strains a fifth of what it would about y; under the law that comes all of it
  ZoneLaw oblong = make_law();
  oblong.rotation_ratio = 0.2;
  Walk w(oblong);
  w.laws.push_back(compile_law(make_law()));
  w.go(deform(-0.2e6 / kStiff, 0, 0.06));
  ASSERT_TRUE(w.z.live);
  ASSERT_GT(w.z.station[0].reached, 0.05);
  const auto find_limits = [&](double time) {
    const Limits limits(w.laws, 0, w.z, time);
    StationState s = w.z.station[0];
    return std::array{limits.moment(0, -0.2e6, s).positive, limits.moment(1, -0.2e6, s).positive,
                      limits.compression(s, 0, 1), limits.capacity(1, s)};
  };
  const auto before = find_limits(0);
  begin_switch(w.p, w.laws, {.law = 1, .time = 0, .ramp = 1e-3, .stiffness_share = 1}, w.z);
  const auto after = find_limits(0), half = find_limits(0.5e-3), over = find_limits(1e-3);
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(after[i], before[i], 1e-9 * before[i]) << i;
    EXPECT_NEAR(half[i], 0.5 * (before[i] + over[i]), 1e-9 * before[i]) << i;
  }
  EXPECT_LT(over[0], 0.5 * before[0]);  // the edges have strained five times as much
}

TEST(Zone, AChargeLeavesWhatItsBarsCarryAtEveryStep) {
  // bars of 10 kN on a spring of 0.4 % take over from a zone under 1 MN; what it gives up flows on the stiff spring
  ZoneLaw bars = make_law();
  for (double& f : bars.compression.f) f = 10e3;
  for (const double h : {1e-3, 1e-4}) {
    Walk w;
    w.p.viscous = 0.2;
    w.p.relaxation = 1 - std::exp(-50 * h);
    w.laws.push_back(compile_law(bars));
    const Six held = deform(-1e6 / kStiff, 0, 0);
    w.go(held, 10);
    w.z.next_law = 1;
    w.z.ramp = 2.5e-3;
    w.z.next_share = 0.004;
    for (int i = 1; i * h < 6e-3; ++i) advance_zone(w.p, w.laws, held, i * h, h, w.z);
    ASSERT_TRUE(w.z.live);
    EXPECT_EQ(w.z.share, 0.004);
    EXPECT_NEAR(w.z.shortened, (1e6 - 10e3) / kStiff, 1e-9);
    EXPECT_NEAR(w.z.resultant.c[0], -10e3, 0.1 * 10e3);  // what is left in the damper goes on relaxing
  }
}

TEST(Zone, DampersDoNotPushBackWhatFallingLimitsLetGo) {
  // shortened within 5 ms through the peak of its compression: behind it the limit falls by 1.6 MN
  for (const double h : {1e-3, 1e-4}) {
    Walk w;
    w.p.viscous = 0.2;
    w.p.relaxation = 1 - std::exp(-60 * h);
    double plastic = 0, work = 0;
    Six before, force;
    for (int i = 1; i * h < 20e-3; ++i) {
      const Six d = deform(-5 * i * h, 0, 0);
      advance_zone(w.p, w.laws, d, i * h, h, w.z);
      ASSERT_TRUE(w.z.live);
      EXPECT_GE(w.z.plastic, plastic - 1e-9);
      // pressed as the spring is, by a fifth of the peak at most
      EXPECT_LE(w.z.damper_force[0], 0) << i;
      EXPECT_GE(w.z.damper_force[0], -0.2 * 2e6) << i;
      work += 0.5 * (force.c[0] + w.z.resultant.c[0]) * (d.c[0] - before.c[0]);
      plastic = w.z.plastic, before = d, force = w.z.resultant;
    }
    EXPECT_GT(w.z.shortened, 0.02);
    EXPECT_NEAR(w.z.energy + w.z.damper_energy + w.z.plastic + w.z.damping, work, 1e-9 * work);
  }
}

TEST(Zone, SoftensWithoutAJumpOfItsForces) {
  for (const int stations : {1, 2}) {
    Walk w(make_law(), make_parameters(stations, 1));
    const Six d{{-2e-3, 0.4e-3, -0.3e-3, 1e-4, 2e-4, -3e-4}};
    w.go(d, 50);
    const Six before = w.z.resultant;
    w.z.next_law = 0;
    w.z.next_share = 0.1;
    w.go(d, 1);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(w.z.resultant.c[i], before.c[i], 1e-9 * kStiff * 1e-3) << i;
    // and a tenth of the stiffness from here on
    Six more = d;
    more.c[0] -= 1e-4;
    more.c[3] += 1e-4;
    w.go(more, 1);
    EXPECT_NEAR(w.z.resultant.c[0] - before.c[0], -1e-4 * 0.1 * kStiff, 1e-6 * kStiff * 1e-4);
    EXPECT_NEAR(w.z.resultant.c[3] - before.c[3], 1e-4 * 0.1 * kStiff, 1e-6 * kStiff * 1e-4);
    EXPECT_NEAR(w.z.energy + w.z.plastic, w.work, 1e-9 * w.work + 1e-9);
  }
}

}  // namespace
}  // namespace topple::mbs
