#include "nearfield/column.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/rcc.h"
#include "specimens.h"

namespace topple::nearfield {
namespace {

using unit::kN;
using unit::mm;
using unit::MPa;

using test::drifts;
using test::make_input;
using test::Specimen;
using test::specimens;

ColumnInput make_column(const Specimen& s) {
  ColumnInput in;
  in.zone = make_input(s);
  in.height = s.length * mm, in.compression = s.P * kN;
  return in;
}

struct Ratios {
  double sum = 0, squares = 0, count = 0;
  void add(double r) { sum += r, squares += r * r, ++count; }
  double mean() const { return sum / count; }
  double scatter() const { return std::sqrt((squares - sum * sum / count) / (count - 1)); }
};

TEST(ColumnReference, PeerColumnsReachTheirMeasuredEnvelopes) {
  Ratios at_drift[5], largest;
  for (const Specimen& s : specimens) {
    const ColumnEnvelope e = push_column(make_column(s));
    EXPECT_TRUE(e.converged) << s.name;
    EXPECT_EQ(e.ending, ColumnEnding::ReachedDrift) << s.name;
    EXPECT_LT(e.shear_from, 0) << s.name << " failed in bending, not in shear";
    std::printf("  %-15s", s.name);
    for (size_t k = 0; k < 5; ++k) {
      const double F = calc_force_at(e, drifts[k]) / kN;
      std::printf(" %5.0f/%3.0f", F, s.envelope[k]);
      if (s.envelope[k] > 0) at_drift[k].add(F / s.envelope[k]);
    }
    largest.add(e.largest_force / (s.F_max * kN));
    std::printf("  largest %5.0f/%3.0f %.2f, first yield at %.4f\n", e.largest_force / kN, s.F_max,
                e.largest_force / (s.F_max * kN), e.yield_drift);
  }
  std::printf("  largest force: mean %.3f, scatter %.3f\n", largest.mean(), largest.scatter());
  // A plain fibre section with Eurocode confinement is known to give 0.84 and 0.10.
  EXPECT_GT(largest.mean(), 0.80);
  EXPECT_LT(largest.mean(), 1.05);
  EXPECT_LT(largest.scatter(), 0.15);
  for (size_t k = 0; k < 5; ++k) {
    std::printf("  drift %.4f: mean %.3f, scatter %.3f\n", drifts[k], at_drift[k].mean(), at_drift[k].scatter());
    // Stiffness before yield scatters by a quarter between like columns; at 2 and 3 % cycles have worn the tests.
    EXPECT_GT(at_drift[k].mean(), 0.75) << drifts[k];
    EXPECT_LT(at_drift[k].mean(), 1.25) << drifts[k];
    EXPECT_LT(at_drift[k].scatter(), 0.25) << drifts[k];
  }
}

TEST(ColumnPhysics, ElasticColumnFollowsTheClosedForm) {
  ColumnInput in = make_column(specimens[1]);
  // Linear in both signs: no cracks, no yield, no slip; stiff in shear against bending.
  in.zone.concrete.fc = 3000 * MPa, in.zone.concrete.fct = 3000 * MPa, in.zone.concrete.eps_c1 = 0.5;
  in.zone.concrete.Gf = in.zone.concrete.Gcl = 1e12;
  in.zone.steel.fy = in.zone.steel.fu = 5000 * MPa;
  in.bars_slip = false, in.height = 8, in.largest_drift = 0.002;
  const double EI = make_rcc(in.zone).EI_y, L = in.height;
  for (const double share : {0.0, 0.1, 0.4}) {
    in.compression = share * 2.467401 * EI / (L * L);  // of Euler's load, π² EI / (4 L²)
    const ColumnEnvelope e = push_column(in);
    const double F = calc_force_at(e, 0.002), root = std::sqrt(in.compression / EI) * L;
    // Deflection of a cantilever with F and P at its tip: F L (tan λ - λ) / (λ P).
    const double bend = share > 0 ? L * (std::tan(root) - root) / (root * in.compression) : L * L * L / (3 * EI);
    const double stiffness = F / (0.002 * L);
    std::printf("  P %.1f P_E: stiffness %.4f of the closed form\n", share, stiffness * bend);
    // Shear adds 3 EI / (GA L²), 0.4 %; concrete that bars displace and 80 slices the rest.
    EXPECT_NEAR(stiffness * bend, 1, 0.01);
    for (const ColumnPoint& p : e.points)
      EXPECT_NEAR(p.force * L + in.compression * p.drift * L, p.foot_moment, 1e-9 * p.foot_moment);
  }
}

TEST(ColumnPhysics, SlenderColumnBucklesAtEulersLoad) {
  ColumnInput in = make_column(specimens[1]);
  in.zone.concrete.fc = 3000 * MPa, in.zone.concrete.fct = 3000 * MPa, in.zone.concrete.eps_c1 = 0.5;
  in.zone.concrete.Gf = in.zone.concrete.Gcl = 1e12;
  in.zone.steel.fy = in.zone.steel.fu = 5000 * MPa;
  in.bars_slip = false, in.height = 8, in.largest_drift = 0.002;
  const double euler = 2.467401 * make_rcc(in.zone).EI_y / (in.height * in.height);
  // Bars displace concrete: 0.2 % as above.
  in.compression = 0.99 * euler;
  const ColumnEnvelope below = push_column(in);
  EXPECT_EQ(below.ending, ColumnEnding::ReachedDrift);
  EXPECT_GT(below.largest_force, 0);
  in.compression = 1.01 * euler;
  const ColumnEnvelope above = push_column(in);
  EXPECT_EQ(above.ending, ColumnEnding::Buckles);
  EXPECT_TRUE(above.points.empty());
}

TEST(Column, SlipSoftensBeforeYieldOnly) {
  ColumnInput in = make_column(specimens[0]);
  const ColumnEnvelope slips = push_column(in);
  in.bars_slip = false;
  const ColumnEnvelope held = push_column(in);
  EXPECT_LT(calc_force_at(slips, 0.0025), 0.9 * calc_force_at(held, 0.0025));
  EXPECT_NEAR(calc_force_at(slips, 0.02), calc_force_at(held, 0.02), 0.02 * slips.largest_force);
  for (const ColumnPoint& p : slips.points) EXPECT_LT(p.slip, 0.6 * p.drift * in.height);
}

TEST(Column, HeavyLoadTakesTheForceBehindThePeak) {
  ColumnInput in = make_column(specimens[2]);
  double before = 1e9;
  for (const double share : {0.3, 0.45, 0.6, 0.75}) {
    in.compression = share * -make_rcc(in.zone).y_pos.normal_force.front();
    const ColumnEnvelope e = push_column(in);
    ASSERT_FALSE(e.points.empty());
    EXPECT_TRUE(e.converged);
    const double F = calc_force_at(e, 0.02);
    std::printf("  P %.2f N_u: largest %.0f kN, at 2 %% %.0f kN, ends at %.4f (%d)\n", share, e.largest_force / kN,
                F / kN, e.points.back().drift, static_cast<int>(e.ending));
    EXPECT_LT(F, before);
    before = F;
  }
  EXPECT_LT(before, 0) << "the load alone pushes it over";
  // Without ties nothing is left of the core either.
  in.zone.section.tie_spacing = 0;
  in.compression = 0.6 * -make_rcc(in.zone).y_pos.normal_force.front();
  const ColumnEnvelope e = push_column(in);
  EXPECT_NE(e.ending, ColumnEnding::ReachedDrift);
  EXPECT_LT(e.points.back().drift, 0.01);
}

TEST(Column, ShortColumnWithFewTiesIsToldToShear) {
  ColumnInput in = make_column(specimens[0]);
  in.height = 0.8;
  in.zone.section.tie_spacing = 0.4, in.zone.section.tie_legs_z = in.zone.section.tie_legs_y = 2;
  const ColumnEnvelope e = push_column(in);
  ASSERT_GT(e.shear_from, 0);
  EXPECT_LT(e.shear_from, 0.01);
  // Slender, it bends.
  in.height = 3;
  EXPECT_LT(push_column(in).shear_from, 0);
}

TEST(Column, RefusesNonsense) {
  ColumnInput in = make_column(specimens[0]);
  in.compression = 20e6;
  EXPECT_THROW(push_column(in), InputError);
  in = make_column(specimens[0]), in.height = 0;
  EXPECT_THROW(push_column(in), InputError);
  in = make_column(specimens[0]), in.zone.length = 2;
  EXPECT_THROW(push_column(in), InputError);
  in = make_column(specimens[0]), in.largest_drift = 0;
  EXPECT_THROW(push_column(in), InputError);
}

}  // namespace
}  // namespace topple::nearfield
