// Laws of springs and dampers: values, slopes, integrals.
#include "mbs/characteristic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace topple::mbs {
namespace {

using Kind = Characteristic::Kind;

Characteristic linear(double rate) { return {Kind::Linear, rate, {}, {}, {}}; }
Characteristic polynomial(std::vector<double> c) { return {Kind::Polynomial, 0, std::move(c), {}, {}}; }
Characteristic table(std::vector<double> x, std::vector<double> f) {
  return {Kind::Table, 0, {}, std::move(x), std::move(f)};
}

/// Integral by Simpson's rule on pieces that end at the corners of the tables used here (multiples of 1/8).
double integrate(const CompiledCharacteristic& c, double from, double to) {
  const int pieces = static_cast<int>(std::lround(std::abs(to - from) * 8));
  double sum = 0;
  const double h = (to - from) / pieces;
  for (int i = 0; i < pieces; ++i) {
    const double a = from + i * h;
    sum += h / 6 * (calc_force(c, a) + 4 * calc_force(c, a + h / 2) + calc_force(c, a + h));
  }
  return sum;
}

TEST(Characteristic, TakesItsValues) {
  const auto l = compile_characteristic(linear(3));
  EXPECT_DOUBLE_EQ(calc_force(l, -2), -6);
  const auto p = compile_characteristic(polynomial({1, -2, 0, 4}));
  EXPECT_DOUBLE_EQ(calc_force(p, 0.5), 1 - 1 + 0.5);
  EXPECT_DOUBLE_EQ(calc_slope(p, 0.5), -2 + 12 * 0.25);
  const auto t = compile_characteristic(table({-1, 0, 2}, {-5, 0, 1}));
  EXPECT_DOUBLE_EQ(calc_force(t, -0.5), -2.5);
  EXPECT_DOUBLE_EQ(calc_force(t, 1), 0.5);
  EXPECT_DOUBLE_EQ(calc_force(t, -7), -5);
  EXPECT_DOUBLE_EQ(calc_force(t, 7), 1);
  EXPECT_DOUBLE_EQ(calc_slope(t, 1), 0.5);
  EXPECT_DOUBLE_EQ(calc_slope(t, 3), 0);
  EXPECT_TRUE(compile_characteristic({}).is_zero);
  EXPECT_TRUE(compile_characteristic(polynomial({0, 0})).is_zero);
  EXPECT_TRUE(compile_characteristic(table({0, 1}, {0, 0})).is_zero);
}

TEST(Characteristic, StoresTheIntegralOfItsLaw) {
  for (const Characteristic& from : {linear(3), polynomial({1, -2, 0, 4}), table({-1, -0.5, 0.25, 2}, {-5, 1, 0, 7}),
                                     table({0.5, 1}, {2, 3}), table({-2, -1}, {-4, 1})}) {
    const auto c = compile_characteristic(from);
    EXPECT_EQ(calc_integral(c, 0), 0);
    for (const double x : {-3.0, -1.0, -0.75, -0.25, 0.125, 0.25, 1.0, 2.5, 4.0})
      EXPECT_NEAR(calc_integral(c, x), integrate(c, 0, x), 1e-13 * (1 + std::abs(integrate(c, 0, x)))) << x;
    for (const auto& [a, b] : {std::pair{-0.75, -0.625}, {-3.0, 1.0}, {0.5, -0.5}, {2.0, 3.0}, {0.625, 0.75}})
      EXPECT_NEAR(calc_mean(c, a, b), integrate(c, a, b) / (b - a), 1e-12) << a << " " << b;
  }
}

TEST(Characteristic, KnowsItsSteepestPlace) {
  EXPECT_EQ(find_steepest(compile_characteristic(linear(-3)), 0, 1), 0);
  EXPECT_EQ(find_steepest(compile_characteristic(table({0, 1, 2}, {0, 5, 6})), 0, 0), 5);
  const auto cubic = compile_characteristic(polynomial({0, 2, 0, 1}));
  EXPECT_FALSE(cubic.has_bound_slope);
  EXPECT_DOUBLE_EQ(find_steepest(cubic, -1, 3), 2 + 27);
}

TEST(Characteristic, IsReachedAsFarAsEnergyAndStrengthAllow) {
  const auto spring = compile_characteristic(linear(8));
  const Reach r = find_reach(spring, 0.5, 3, kUnlimited);  // 1 J is stored already: 4 J at 1 m
  EXPECT_NEAR(r.from, -1, 1e-12);
  EXPECT_NEAR(r.to, 1, 1e-12);
  EXPECT_NEAR(find_reach(spring, 0, 1e9, 4).to, 0.5, 1e-12);
  EXPECT_NEAR(find_reach(spring, 0.5, 0, kUnlimited).to, 0.5, 1e-12);
}

TEST(Characteristic, HasAChordWhereItIsFlat) {
  const auto gap = compile_characteristic(table({-2, -1, 1, 2}, {-100, 0, 0, 100}));
  const double chord = find_chord(gap, 50);  // 50 N at 1.5 m: 33 N/m, found within a factor of two
  EXPECT_GT(chord, 15);
  EXPECT_LE(chord, 50.0 / 1.5);
}

}  // namespace
}  // namespace topple::mbs
