#include "nearfield/ring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"
#include "nearfield/shell.h"

namespace topple::nearfield {
namespace {

constexpr double pi = 3.14159265358979323846;

RingInput chimney_ring() {
  RingInput in;
  in.name = "foot";
  in.outer = 2.5, in.thickness = 0.25;
  in.concrete = {"C20", 20 * unit::MPa, 1.8 * unit::MPa, 27 * unit::GPa, 0.0022, 120, 15000, 2500};
  in.steel = {"bars", 420 * unit::MPa, 500 * unit::MPa, 200 * unit::GPa, 0.08};
  in.as_outer = in.as_inner = 6 * unit::cm2;
  in.bar_diameter = 12 * unit::mm, in.cover = 30 * unit::mm;
  in.length = 0.4;
  return in;
}

/// All but a mouth around y of the half angle `mouth`.
RingInput with_mouth(RingInput in, double mouth) {
  in.sectors = {{mouth, 2 * pi - mouth, 1, 1}};
  return in;
}

double peak_at(const MomentFamily& f, double N) {
  const size_t J = f.rotation.size();
  double peak = 0;
  for (size_t j = 0; j < J; ++j)
    for (size_t k = 1; k < f.normal_force.size(); ++k)
      if (f.normal_force[k - 1] <= N && N <= f.normal_force[k]) {
        const double s = (N - f.normal_force[k - 1]) / (f.normal_force[k] - f.normal_force[k - 1]);
        peak = std::max(peak, (1 - s) * f.moment[(k - 1) * J + j] + s * f.moment[k * J + j]);
      }
  return peak;
}

TEST(Ring, HasTheAreaAndSecondMomentOfAnAnnulus) {
  RingInput in = chimney_ring();
  in.as_outer = in.as_inner = 0;
  const RingProperties p = calc_ring_properties(in);
  const double ri = in.outer - in.thickness, E = in.concrete.Ec;
  EXPECT_NEAR(p.area, pi * (in.outer * in.outer - ri * ri), 1e-9 * p.area);
  const double I = pi / 4 * (std::pow(in.outer, 4) - std::pow(ri, 4));
  EXPECT_NEAR(p.EI_y / E, I, 1e-4 * I);  // cells 6 cm thick: (t/4)²/12 of r²
  EXPECT_NEAR(p.EI_z / E, I, 1e-4 * I);
  EXPECT_EQ(p.y, 0);
  EXPECT_TRUE(p.is_closed);
  const Fibres f = make_ring_fibres(in, Axis::Z, 1, 0, 0);
  double area = 0, second = 0;
  for (size_t i = 0; i < f.at.size(); ++i) area += f.core_area[i], second += f.core_area[i] * f.at[i] * f.at[i];
  EXPECT_NEAR(area, p.area, 1e-9 * p.area);
  EXPECT_NEAR(second, I, 1e-3 * I);  // strips 8 cm wide lose width²/12 each: 2.5e-4
  EXPECT_NEAR(f.half_depth, in.outer, 1e-12);
}

TEST(Ring, AThinRingWithAMouthHasTheClosedFormsOfAnArc) {
  RingInput in = chimney_ring();
  in.as_outer = in.as_inner = 0;
  in.thickness = 0.02;
  const double R = in.outer - 0.01, t = in.thickness, E = in.concrete.Ec;
  for (const double mouth : {0.4, 1.0, 1.8}) {
    const RingProperties p = calc_ring_properties(with_mouth(in, mouth));
    const double b = pi - mouth;  // half angle of what is left, behind
    EXPECT_NEAR(p.area, 2 * b * R * t, 1e-9);
    EXPECT_NEAR(p.y, -R * std::sin(b) / b, 1e-4 * R);
    EXPECT_NEAR(p.z, 0, 1e-9);
    const double I_z = t * R * R * R * (b + std::sin(b) * std::cos(b) - 2 * std::sin(b) * std::sin(b) / b);
    const double I_y = t * R * R * R * (b - std::sin(b) * std::cos(b));
    EXPECT_NEAR(p.EI_z / E, I_z, 1e-3 * I_z) << mouth;  // (t/R)² and cells of half a degree
    EXPECT_NEAR(p.EI_y / E, I_y, 1e-3 * I_y) << mouth;
    EXPECT_FALSE(p.is_closed);
  }
}

TEST(Ring, SectorsTogetherAreTheRing) {
  const RingInput in = chimney_ring();
  const RingProperties whole = calc_ring_properties(in);
  RingInput front = in, rear = in;
  front.sectors = {{-1.1, 1.1, 1, 1}}, rear.sectors = {{1.1, 2 * pi - 1.1, 1, 1}};
  const RingProperties a = calc_ring_properties(front), b = calc_ring_properties(rear);
  EXPECT_NEAR(a.EA + b.EA, whole.EA, 1e-9 * whole.EA);
  const double EI = a.EI_z + a.EA * a.y * a.y + b.EI_z + b.EA * b.y * b.y;
  EXPECT_NEAR(EI, whole.EI_z, 1e-5 * EI);
  EXPECT_NEAR(a.EA * a.y + b.EA * b.y, 0, 1e-6 * whole.EA);
}

/// Rigid and plastic thin ring, compressed at f_c over the angle 2 θ, bars at f_y everywhere.
double calc_plastic_moment(double R, double t, double fc, double yield, double N) {
  double low = 0, high = pi;
  for (int i = 0; i < 60; ++i) {
    const double q = 0.5 * (low + high);
    const double force = -2 * q * R * t * fc + yield * (1 - 2 * q / pi);
    (force > N ? low : high) = q;
  }
  return std::sin(low) * (2 * R * R * t * fc + 2 / pi * yield * R);
}

TEST(Ring, AReinforcedRingReachesThePlasticMomentOfAThinRing) {
  const RingInput in = chimney_ring();
  const Rcc rcc = make_ring_rcc(in);
  const RingProperties p = calc_ring_properties(in);
  const double R = in.outer - 0.5 * in.thickness;
  for (const double N : {0.0, -2e6, -5e6}) {
    const double plastic = calc_plastic_moment(R, in.thickness, in.concrete.fc, p.steel_area * in.steel.fy, N);
    const double found = peak_at(rcc.z_pos, N);
    // curves of the materials: the edge softens before the rest yields, bars harden
    EXPECT_GT(found, 0.93 * plastic) << N;
    EXPECT_LT(found, 1.12 * plastic) << N;
  }
  EXPECT_EQ(rcc.y_pos.moment, rcc.z_neg.moment);
}

TEST(Ring, WithoutBarsThePressureLineStaysInTheRing) {
  RingInput in = chimney_ring();
  in.as_outer = in.as_inner = 0;
  in.steel = {};
  in.concrete = make_masonry(6 * unit::MPa, 4 * unit::GPa);
  in.length = std::min(0.25, 0.9 * calc_largest_zone_length(in.concrete));
  const Rcc rcc = make_ring_rcc(in);
  const double R = in.outer - 0.5 * in.thickness;
  for (const double share : {0.05, 0.1, 0.2}) {
    const double N = -share * 2 * pi * R * in.thickness * 6 * unit::MPa, q = pi * share;
    const double plastic = -N * R * std::sin(q) / q;
    const double found = peak_at(rcc.z_pos, N);
    EXPECT_GT(found, 0.9 * plastic) << share;   // a parabola instead of a block
    EXPECT_LT(found, 1.06 * plastic) << share;  // and a little tension
  }
}

TEST(Ring, WithAMouthTheMomentTowardsItIsThatOfItsLips) {
  const RingInput in = with_mouth(chimney_ring(), 0.5 * 210 * pi / 180);
  const RingProperties p = calc_ring_properties(in);
  const Rcc rcc = make_ring_rcc(in);
  const double R = in.outer - 0.5 * in.thickness, mouth = 0.5 * 210 * pi / 180, t = in.thickness, fc = in.concrete.fc;
  const double bars = (in.as_outer + in.as_inner) * R * in.steel.fy;  // per radian
  const double N = -4e6;
  double low = 0, high = pi - mouth;
  for (int i = 0; i < 60; ++i) {
    const double q = 0.5 * (low + high);
    const double force = -2 * q * (R * t * fc + bars) + 2 * (pi - mouth - q) * bars;
    (force > N ? low : high) = q;
  }
  const double q = low;
  // moments about the ring's centre, pressure ahead of it positive, then about the centroid
  const double lips = 2 * R * (std::sin(mouth + q) - std::sin(mouth)), back = -2 * R * std::sin(mouth + q);
  const double centre = lips * (R * t * fc + bars) - back * bars;
  const double plastic = centre + N * p.y;  // N < 0 acts at the centroid, p.y < 0
  const double found = peak_at(rcc.z_pos, N);
  EXPECT_GT(found, 0.9 * plastic);
  EXPECT_LT(found, 1.1 * plastic);
  // away from the mouth the back is pressed: another resistance
  EXPECT_GT(std::abs(peak_at(rcc.z_neg, N) - found), 0.02 * found);
}

TEST(Ring, ItsMirrorImageHasTheSameCurvesToTheOtherSide) {
  RingInput in = chimney_ring(), image = in;
  // a mouth towards the fall and a cut to one side of it
  in.sectors = {{85 * pi / 180, 115 * pi / 180, 1, 1},
                {115 * pi / 180, 140 * pi / 180, 0.1, 1},
                {140 * pi / 180, 275 * pi / 180, 1, 1}};
  for (size_t i = in.sectors.size(); i-- > 0;) {
    const RingSector& s = in.sectors[i];
    image.sectors.push_back({2 * pi - s.to, 2 * pi - s.from, s.concrete, s.bars});
  }
  turn_to_principal_axes(in), turn_to_principal_axes(image);
  const Rcc a = make_ring_rcc(in), b = make_ring_rcc(image);
  EXPECT_NEAR(a.EI_y, b.EI_y, 1e-9 * a.EI_y);
  const auto expect_same = [](const MomentFamily& f, const MomentFamily& g) {
    ASSERT_EQ(f.rotation.size(), g.rotation.size());
    const double most = *std::max_element(f.moment.begin(), f.moment.end());
    for (size_t j = 0; j < f.rotation.size(); ++j) EXPECT_NEAR(f.rotation[j], g.rotation[j], 1e-6 * f.rotation.back());
    for (size_t j = 0; j < f.moment.size(); ++j) EXPECT_NEAR(f.moment[j], g.moment[j], 1e-3 * most) << j;
  };
  expect_same(a.y_pos, b.y_neg), expect_same(a.y_neg, b.y_pos);
  expect_same(a.z_pos, b.z_pos), expect_same(a.z_neg, b.z_neg);
}

TEST(Ring, ACutThatDoesNotOpenItIsTwistedByShearAround) {
  RingInput in = chimney_ring(), cut = in;
  const double half = 0.5;
  cut.sectors = {{0, pi, 1, 1}, {pi, 2 * pi, half, 1}};
  const Rcc whole = make_ring_rcc(in), weak = make_ring_rcc(cut);
  EXPECT_NEAR(weak.GJ, whole.GJ / (0.5 + 0.5 / half), 1e-9 * whole.GJ);
  EXPECT_NEAR(weak.torsion, half * whole.torsion, 1e-9 * whole.torsion);
  EXPECT_EQ(whole.biaxial_exponent, 2);
  EXPECT_EQ(weak.biaxial_exponent, 1.5);
}

TEST(Ring, BarsLeftByAChargeAreTheirShareOfThePull) {
  RingInput in = chimney_ring();
  in.sectors = {{-1.5, 1.5, 1, 1}};
  const ResidualCage cage = make_ring_cage(in, 2.0, 0.25);
  const double area = calc_ring_properties(in).steel_area;
  EXPECT_NEAR(cage.tension.force.front(), 0.25 * area * in.steel.fy, 1e-6 * area * in.steel.fy);
  EXPECT_LT(cage.compression.force.front(), 0.1 * cage.tension.force.front());  // 2 m of 12 mm buckle
}

TEST(Ring, TurnsToThePrincipalAxesOfWhatIsLeft) {
  // an arc, in pieces and across the beginning of the circle
  RingInput arc = chimney_ring();
  arc.sectors = {{0, 0.9, 1, 1}, {0.9, 1.2, 1, 1}, {2 * pi - 1, 2 * pi, 1, 1}};
  const RingProperties before = calc_ring_properties(arc);
  EXPECT_GT(std::abs(before.EI_yz), 0.01 * before.EI_y);
  EXPECT_NEAR(turn_to_principal_axes(arc), 0.1, 1e-9);
  ASSERT_EQ(arc.sectors.size(), 1u);
  EXPECT_NEAR(arc.sectors[0].angle(), 2.2, 1e-12);
  const RingProperties p = calc_ring_properties(arc);
  EXPECT_NEAR(p.EI_yz, 0, 1e-9 * p.EI_y);
  EXPECT_NEAR(p.z, 0, 1e-9);
  EXPECT_NEAR(p.y, std::hypot(before.y, before.z), 1e-6);
  // a mouth beside a gap: no axis of symmetry
  RingInput two = chimney_ring();
  two.sectors = {{0.9, 1.2, 1, 1}, {2.0, 5.5, 1, 0.5}};
  turn_to_principal_axes(two);
  const RingProperties q = calc_ring_properties(two);
  EXPECT_NEAR(q.EI_yz, 0, 1e-9 * q.EI_y);
  EXPECT_GT(std::abs(q.z), 0.01);
  RingInput whole = chimney_ring();
  EXPECT_EQ(turn_to_principal_axes(whole), 0);
}

}  // namespace
}  // namespace topple::nearfield
