#include "uncertainty/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace topple::uncertainty {
namespace {

// Closed forms throughout; tolerances are round-off.
constexpr double round_off = 1e-13;

TEST(Measures, OfATriangle) {
  const FuzzyNumber f = make_triangular(1, 2, 4);
  EXPECT_NEAR(calc_centroid(f), 7.0 / 3, round_off);
  EXPECT_NEAR(calc_mean_of_midpoints(f), (1 + 2 * 2 + 4) / 4.0, round_off);
  EXPECT_NEAR(calc_entropy(f), 1.5, round_off) << "half the width";
  // falling branch (4 - x)/2 = (x - 1)/3 at 2.8; rising branch x - 1 = (4 - x)/3 at 1.75
  EXPECT_NEAR(calc_jain(f), 2.8, round_off);
  EXPECT_NEAR(calc_chen(f), 1 + 3 * 0.5 * (0.6 + 1 - 0.75), round_off);
}

TEST(Measures, CentroidKeepsSmallWidthsBesideLargeValues) {
  // an ulp beside 1e9 is 1.2e-7
  EXPECT_NEAR(calc_centroid(make_triangular(1e9, 1e9 + 1, 1e9 + 3)) - 1e9, 4.0 / 3, 2e-7);
  EXPECT_NEAR(calc_centroid(make_triangular(0, 1e300, 3e300)) / 1e300, 4.0 / 3, round_off);
  const FuzzyNumber narrow = make_triangular(1e9, 1e9 + 1e-6, 1e9 + 3e-6);
  EXPECT_GE(calc_centroid(narrow), narrow.support().left);
  EXPECT_LE(calc_centroid(narrow), narrow.support().right);
}

TEST(Measures, OfASymmetricNumberAreItsMiddle) {
  const FuzzyNumber f = make_trapezoidal(-2, 0, 4, 6);
  EXPECT_NEAR(calc_centroid(f), 2, round_off);
  EXPECT_NEAR(calc_mean_of_midpoints(f), 2, round_off);
  EXPECT_NEAR(calc_chen(f), 2, round_off);
}

TEST(Measures, OfAnInterval) {
  const FuzzyNumber f = make_trapezoidal(1, 1, 3, 3);
  EXPECT_EQ(calc_entropy(f), 0);
  EXPECT_NEAR(calc_centroid(f), 2, round_off);
  EXPECT_NEAR(calc_jain(f), 3, round_off);
  EXPECT_NEAR(calc_chen(f), 2, round_off);
}

TEST(Measures, OfACrispNumberAreTheNumber) {
  const FuzzyNumber f(5.0);
  EXPECT_EQ(calc_centroid(f), 5);
  EXPECT_EQ(calc_mean_of_midpoints(f), 5);
  EXPECT_EQ(calc_jain(f), 5);
  EXPECT_EQ(calc_chen(f), 5);
  EXPECT_EQ(calc_entropy(f), 0);
}

TEST(Measures, EntropyAgreesWithItsIntegral) {
  const FuzzyNumber f({{0, 0, 9}, {0.2, 1, 7}, {0.2, 1.5, 6.5}, {0.9, 2, 5}, {1, 3, 4}});
  double sum = 0;
  const int steps = 900000;
  for (int i = 0; i < steps; ++i) {
    const double mu = f.membership(9 * (i + 0.5) / steps);
    if (mu > 0 && mu < 1) sum -= (mu * std::log(mu) + (1 - mu) * std::log(1 - mu)) * 9 / steps;
  }
  EXPECT_NEAR(calc_entropy(f), sum, 1e-6) << "error of the midpoint rule";
  EXPECT_NEAR(calc_entropy(f, 10, 2), 0.2 * calc_entropy(f), round_off);
}

TEST(Measures, RobustnessIsARatioOfEntropies) {
  EXPECT_DOUBLE_EQ(calc_robustness({1.5, 1.5}, 0.75), 4);
  EXPECT_TRUE(std::isinf(calc_robustness({1.5}, 0)));
  EXPECT_THROW(calc_entropy(make_triangular(0, 1, 2), 0), InputError);
}

// xy/(x+y) rises in both variables, so its cuts are exact; the numbers were computed independently.
TEST(MeasuresReference, RepeatedVariable) {
  const FuzzyNumber x = make_triangular(1, 2, 4), y = make_triangular(2, 3, 5);
  std::vector<AlphaCut> cuts;
  for (int k = 0; k <= 2000; ++k) {
    const double a = k / 2000.0;
    const auto f = [](double p, double q) { return p * q / (p + q); };
    cuts.push_back({a, f(x.cut(a).left, y.cut(a).left), f(x.cut(a).right, y.cut(a).right)});
  }
  const FuzzyNumber z(std::move(cuts));
  EXPECT_NEAR(calc_entropy(z), 0.777106, 6e-7);
  EXPECT_NEAR(calc_entropy(x) + calc_entropy(y), 3, round_off);
  EXPECT_NEAR(calc_centroid(z), 1.365447, 6e-7);
}

}  // namespace
}  // namespace topple::uncertainty
