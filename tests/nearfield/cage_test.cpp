#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "material/steel.h"
#include "nearfield/fired.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {
namespace {

using unit::MPa;

constexpr double pi = 3.14159265358979323846;

ZoneInput make_four_bars() {
  ZoneInput in;
  in.section.name = "four", in.section.width = 0.4, in.section.height = 0.5;
  for (double y : {-0.15, 0.15})
    for (double z : {-0.2, 0.2}) in.section.bars.push_back({y, z, 0.25 * pi * 0.03 * 0.03, 0.03});
  in.steel = {"", 400 * MPa, 500 * MPa, 200e9, 0.08};
  in.length = 0.5;
  return in;
}

ZoneInput make_column_with_concrete() {
  ZoneInput in = make_four_bars();
  in.section.cover = 0.03, in.section.tie_diameter = 0.008, in.section.tie_spacing = 0.15;
  in.concrete.fc = 25 * MPa, in.concrete.fct = 2 * MPa, in.concrete.Ec = 30e9, in.concrete.eps_c1 = 2.2e-3;
  in.concrete.Gf = 130, in.concrete.Gcl = 15e3;
  return in;
}

TEST(ResidualCage, SlenderBarsCarryEulersForce) {
  const double h = 2.0, A = 0.25 * pi * 0.03 * 0.03;
  const ResidualCage cage = make_residual_cage(make_four_bars(), h, 0.5);
  const double inertia = pi * std::pow(0.03, 4) / 64, euler = pi * pi * 200e9 * inertia / (h * h);
  EXPECT_NEAR(cage.compression.force.front(), 0.5 * 4 * euler, 1e-9 * euler);
  EXPECT_NEAR(cage.tension.force.front(), 0.5 * 4 * A * 400 * MPa, 1);
  EXPECT_NEAR(cage.tension.force[1], 0.5 * 4 * A * 500 * MPa, 1);
  EXPECT_EQ(cage.tension.force.back(), 0);
  EXPECT_NEAR(cage.EA, 0.5 * 4 * A * 200e9, 1);
  // Compressed bars give Euler's force, pulled ones as much: couples over 0.4 and 0.3 m.
  EXPECT_NEAR(cage.moment_y, 0.5 * 2 * euler * 0.4, 1e-6 * euler);
  EXPECT_NEAR(cage.moment_z, 0.5 * 2 * euler * 0.3, 1e-6 * euler);
  EXPECT_NEAR(cage.shear, 0.5 * 4 * 2 * (400 * MPa * std::pow(0.03, 3) / 6) / h, 1e-6);
}

TEST(ResidualCage, BuckledBarsDoTheWorkOfTheirHinges) {
  const double h = 1.0;
  const ResidualCage cage = make_residual_cage(make_four_bars(), h, 1);
  const AxialCurve& c = cage.compression;
  EXPECT_NEAR(c.displacement.back(), h, 1e-12);
  for (size_t i = 1; i < c.force.size(); ++i) EXPECT_LE(c.force[i], c.force[i - 1]);
  // At half the height cos θ = 1/2: P = 4 M_p / (h sin 60°).
  const double Mp = 400 * MPa * std::pow(0.03, 3) / 6, expected = 4 * 4 * Mp / (h * std::sqrt(0.75));
  size_t i = 1;
  while (c.displacement[i] < 0.5) ++i;
  const double s = (0.5 - c.displacement[i - 1]) / (c.displacement[i] - c.displacement[i - 1]);
  EXPECT_NEAR((1 - s) * c.force[i - 1] + s * c.force[i], expected, 0.02 * expected);  // chord
}

TEST(ResidualCage, StockyBarsYield) {
  const ResidualCage cage = make_residual_cage(make_four_bars(), 0.05, 1);
  EXPECT_NEAR(cage.compression.force.front() / cage.tension.force.front(), 1, 0.01);
}

TEST(ResidualCage, NothingLeftCarriesNothing) {
  const ResidualCage cage = make_residual_cage(make_four_bars(), 1, 0);
  EXPECT_EQ(cage.compression.force.front(), 0);
  EXPECT_EQ(cage.moment_y, 0);
  EXPECT_EQ(cage.EA, 0);
  EXPECT_THROW(make_residual_cage(make_four_bars(), 0, 0.5), InputError);
  EXPECT_THROW(make_residual_cage(make_four_bars(), 1, 1.5), InputError);
}

size_t row_of(const MomentFamily& f, double N) {
  size_t best = 0;
  for (size_t k = 0; k < f.normal_force.size(); ++k)
    if (std::abs(f.normal_force[k] - N) < std::abs(f.normal_force[best] - N)) best = k;
  return best;
}
double peak_of(const MomentFamily& f, size_t k) {
  const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * f.rotation.size());
  return *std::max_element(row, row + static_cast<std::ptrdiff_t>(f.rotation.size()));
}

TEST(FiredZone, CageFollowsItsInteraction) {
  const double h = 1.2, eta = 0.6, A = 0.25 * pi * 0.03 * 0.03;
  const FiredZone z = make_fired_zone(make_column_with_concrete(), {h, eta, 0.3, 0});
  const double P = eta * A * material::calc_buckling_stress(400 * MPa, 200e9, 0.03, h);
  const MomentFamily& f = z.y_pos;
  EXPECT_NEAR(f.normal_force.front(), -4 * P, 1e-6 * P);
  EXPECT_NEAR(f.normal_force.back(), 4 * eta * A * 500 * MPa, 1);
  for (size_t k = 1; k + 1 < f.normal_force.size(); ++k) {
    const double N = f.normal_force[k];
    if (N > 0) continue;
    // Two bars on each side at 0.2 m: those in compression give 2 P, the others what is missing.
    const double expected = 0.2 * (N + 4 * P);
    EXPECT_NEAR(peak_of(f, k), expected, 0.02 * 0.8 * P) << N;  // grid of rotations
  }
  EXPECT_NEAR(peak_of(f, row_of(f, 0)), z.cage.moment_y, 0.02 * z.cage.moment_y);
  EXPECT_NEAR(peak_of(z.z_neg, row_of(z.z_neg, 0)), z.cage.moment_z, 0.02 * z.cage.moment_z);
  // Tension: all bars near f_u, and nothing of a moment is left.
  EXPECT_LT(peak_of(f, f.normal_force.size() - 2), 0.5 * 0.4 * 2 * eta * A * 500 * MPa);
  for (double M : f.moment) EXPECT_TRUE(std::isfinite(M) && M >= 0);
}

TEST(FiredZone, UnequalSidesStartWithoutMoment) {
  ZoneInput in = make_column_with_concrete();
  for (product::Bar& b : in.section.bars)
    if (b.z > 0) b.area *= 0.5, b.diameter *= std::sqrt(0.5);
  const FiredZone z = make_fired_zone(in, {1.0, 1, 0, 0});
  const size_t k = row_of(z.y_pos, -0.3 * -z.y_pos.normal_force.front());
  // Under compression the stocky side gives more, so bending that presses it is stronger; near the origin M = 0 both
  // ways.
  for (const MomentFamily* f : {&z.y_pos, &z.y_neg}) {
    const double *M = &f->moment[k * f->rotation.size()], slope = M[1] / f->rotation[1];
    EXPECT_GT(slope, 0);
    EXPECT_NEAR(M[2] / f->rotation[2], slope, 0.3 * slope);
  }
  const double N = z.y_pos.normal_force[k];
  const auto buckling = [&](double d) {
    return 2 * 0.25 * pi * d * d * material::calc_buckling_stress(400 * MPa, 200e9, d, 1.0);
  };
  const double strong = buckling(0.03), weak = buckling(0.03 * std::sqrt(0.5));
  // Limits of the couple about the middle: the pressed side buckles, the other takes the rest.
  EXPECT_NEAR(peak_of(z.y_pos, k), 0.2 * (N + 2 * strong), 0.03 * 0.4 * strong);
  EXPECT_NEAR(peak_of(z.y_neg, k), 0.2 * (N + 2 * weak), 0.03 * 0.4 * strong);
}

TEST(FiredZone, BuckledBarsLoseTheirMoment) {
  const FiredZone z = make_fired_zone(make_column_with_concrete(), {0.6, 1, 0, 0});
  const MomentFamily& f = z.y_pos;
  const size_t J = f.rotation.size(), k = row_of(f, 0);
  size_t j = 0;
  while (f.rotation[j] < 0.3) ++j;
  EXPECT_LT(f.moment[k * J + j], 0.5 * peak_of(f, k));
  EXPECT_GT(f.moment[k * J + j], 0);
  // The last column: broken.
  EXPECT_EQ(f.moment[k * J + J - 1], 0);
}

TEST(FiredZone, TransitionLiesBetweenCageAndIntactSection) {
  const ZoneInput in = make_column_with_concrete();
  const Rcc intact = make_rcc(in);
  const FiredZone z = make_fired_zone(in, {1.0, 0.8, 0.5, 0.2});
  const auto strength = [](const Rcc& r) { return -r.y_pos.normal_force.front(); };
  EXPECT_LT(strength(z.transition), 0.6 * strength(intact));
  EXPECT_GT(strength(z.transition), z.cage.compression.force.front());
  EXPECT_NEAR(z.transition.length, 0.5, 1e-12);
  // Not fully destroyed: a fifth of the concrete within the ties, as weak as beside, and bars without ties.
  ASSERT_TRUE(z.partial.has_value());
  EXPECT_LT(strength(*z.partial), strength(z.transition));
  EXPECT_GT(strength(*z.partial), z.cage.compression.force.front());
  EXPECT_FALSE(make_fired_zone(in, {1.0, 0.8, 0.5, 0}).partial.has_value());
  // what hardly any concrete is left of bears what the cage does: its bars buckle over the same length
  const FiredZone bare = make_fired_zone(in, {1.0, 0.8, 0, 1e-4});
  EXPECT_NEAR(strength(*bare.partial) / bare.cage.compression.force.front(), 1, 0.02);
  EXPECT_THROW(make_fired_zone(in, {1.0, 0.8, 1.5, 0}), InputError);
  EXPECT_THROW(make_fired_zone(in, {1.0, 0.8, 0.5, -1}), InputError);
}

TEST(FiredZone, NoBarsLeaveNoCage) {
  const FiredZone z = make_fired_zone(make_column_with_concrete(), {1.0, 0, 0.5, 0});
  EXPECT_TRUE(z.y_pos.moment.empty());
  EXPECT_EQ(z.cage.moment_y, 0);
}

}  // namespace
}  // namespace topple::nearfield
