#include "material/steel.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/unit.h"

namespace topple::material {
namespace {

using unit::MPa;

SteelInput make_input() {
  SteelInput in;
  in.fy = 420 * MPa, in.fu = 525 * MPa, in.Es = 200e3 * MPa, in.eps_u = 0.08;
  return in;
}

TEST(Steel, YieldsHardensAndBreaks) {
  const Steel s = make_steel(make_input());
  EXPECT_NEAR(calc_envelope(s, 1e-3).stress, 200 * MPa, 1);
  EXPECT_NEAR(calc_envelope(s, 2.1e-3).stress, 420 * MPa, 1);
  EXPECT_NEAR(calc_envelope(s, 0.08).stress, 525 * MPa, 1);
  EXPECT_EQ(calc_envelope(s, 0.0801).stress, 0);
  EXPECT_NEAR(calc_envelope(s, -2.1e-3).stress, -420 * MPa, 1);
}

TEST(Steel, HistoryFollowsTheEnvelopeWhenMonotone) {
  const Steel s = make_steel(make_input());
  SteelState state;
  for (double e = 0; e < 0.0799; e += 1e-4)
    EXPECT_NEAR(advance(s, state, e).stress, calc_envelope(s, e).stress, 1e-9 * s.fu);
  EXPECT_EQ(advance(s, state, 0.081).stress, 0);
  EXPECT_EQ(advance(s, state, 0.01).stress, 0) << "a broken bar stays broken";
}

TEST(Steel, ReversedYieldComesTwoYieldStressesLater) {
  const Steel s = make_steel(make_input());
  SteelState state;
  const double top = advance(s, state, 0.03).stress;
  const double reversed = 0.03 - 2 * s.fy / s.Es;
  EXPECT_NEAR(advance(s, state, reversed).stress, top - 2 * s.fy, 1e-9 * s.fu);
  EXPECT_NEAR(advance(s, state, reversed - 1e-3).tangent, s.hardening, 1e-9 * s.Es);
}

TEST(Steel, ClosedLoopDissipates) {
  const Steel s = make_steel(make_input());
  SteelState state;
  double work = 0, e0 = 0, s0 = 0;
  for (int i = 1; i <= 4 * 3600; ++i) {
    const double e = 0.01 * std::sin(i * 3.14159265358979 / 1800), stress = advance(s, state, e).stress;
    if (i > 3600) work += 0.5 * (stress + s0) * (e - e0);
    e0 = e, s0 = stress;
  }
  // Three stabilised parallelograms: width of the plastic strain range times 2 f_y.
  const double H = s.hardening * s.Es / (s.Es - s.hardening);
  const double range = (0.02 - 2 * s.fy / s.Es) * s.Es / (s.Es + H);
  EXPECT_NEAR(work, 3 * 2 * s.fy * range, 2e-3 * work);  // step size
}

TEST(Steel, NeverGivesBackEnergyInCycles) {
  SteelInput in = make_input();
  in.diameter = 0.016;
  for (const double free_length : {0.0, 0.1, 0.16, 0.3}) {
    in.free_length = free_length;
    const Steel s = make_steel(in);
    SteelState state;
    double work = 0, least = 0, e0 = 0, s0 = 0, greatest = 0;
    for (int i = 0; i <= 200000; ++i) {
      const double e = 3e-7 * i * std::sin(i * 3e-4) - 5e-8 * i;
      const double stress = advance(s, state, e).stress;
      ASSERT_LE(std::abs(stress), s.fu * (1 + 1e-9) + s.fy) << e;  // kinematic hardening shifts the range
      work += 0.5 * (stress + s0) * (e - e0);
      e0 = e, s0 = stress;
      least = std::min(least, work), greatest = std::max(greatest, work);
    }
    EXPECT_GE(least, -1e-6 * greatest) << free_length;  // trapezoidal rule
    EXPECT_GT(greatest, 5 * s.fy * 0.05) << free_length;
  }
}

TEST(Steel, SlenderBarsBuckle) {
  // Johnson meets Euler at half the yield stress.
  const double pi = 3.14159265358979, limit = std::sqrt(2 * pi * pi * 200e3 / 420) * 0.032 / 4;
  EXPECT_NEAR(calc_buckling_stress(420 * MPa, 200e3 * MPa, 0.032, limit), 210 * MPa, 1e-6 * MPa);
  EXPECT_NEAR(calc_buckling_stress(420 * MPa, 200e3 * MPa, 0.032, 2 * limit), 52.5 * MPa, 1e-6 * MPa);
  EXPECT_NEAR(calc_buckling_stress(420 * MPa, 200e3 * MPa, 0.032, 1e-6), 420 * MPa, 1e-3 * MPa);

  SteelInput in = make_input();
  in.diameter = 0.016, in.free_length = 0.2;
  const Steel s = make_steel(in);
  EXPECT_LT(-calc_envelope(s, -0.05).stress, 0.6 * s.fy);
  EXPECT_NEAR(-calc_envelope(s, -0.3).stress, 0.2 * s.fy, 1) << "residual";
  EXPECT_NEAR(calc_envelope(s, 0.05).stress, calc_envelope(make_steel(make_input()), 0.05).stress, 1);
  SteelState state;
  for (double e = 0; e > -0.3; e -= 1e-3)
    EXPECT_NEAR(advance(s, state, e).stress, calc_envelope(s, e).stress, 0.02 * s.fy) << e;

  in.free_length = 5 * in.diameter;
  EXPECT_FALSE(std::isfinite(make_steel(in).buckling_stress));
}

TEST(Steel, HeldBarsHardenInCompressionAsInTension) {
  SteelInput in = make_input();
  in.diameter = 0.02, in.free_length = 0.08;  // s / d = 4
  const Steel s = make_steel(in);
  for (double e : {1e-3, 2.1e-3, 0.01, 0.05, 0.08})
    EXPECT_NEAR(-calc_envelope(s, -e).stress, calc_envelope(s, e).stress, 1e-9 * s.fu) << e;
  EXPECT_NEAR(-calc_envelope(s, -0.2).stress, s.fu, 1e-9 * s.fu);
  SteelState state;
  for (double e = 0; e > -0.06; e -= 1e-4)
    EXPECT_NEAR(advance(s, state, e).stress, calc_envelope(s, e).stress, 1e-9 * s.fu) << e;
}

TEST(Steel, RefusesNonsense) {
  SteelInput in = make_input();
  in.fu = 400 * MPa;
  EXPECT_THROW(make_steel(in), InputError);
  in = make_input(), in.eps_u = 1e-3;
  EXPECT_THROW(make_steel(in), InputError);
  in = make_input(), in.fy = 0;
  EXPECT_THROW(make_steel(in), InputError);
}

}  // namespace
}  // namespace topple::material
