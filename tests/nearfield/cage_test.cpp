#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "material/steel.h"
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

}  // namespace
}  // namespace topple::nearfield
