#include "uncertainty/randomness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "uncertainty/alpha.h"

namespace topple::uncertainty {
namespace {

double calc_phi(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

TEST(NormalQuantile, InvertsTheDistribution) {
  // the distribution's own round-off over its slope bounds what can be asked
  for (double x = -8; x <= 8; x += 0.25) {
    const double u = calc_phi(x), slope = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
    EXPECT_NEAR(calc_normal_quantile(u), x, 1e-13 + 2.3e-16 * u / slope) << x;
  }
  EXPECT_EQ(calc_normal_quantile(0.5), 0);
  EXPECT_NEAR(calc_normal_quantile(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(calc_normal_quantile(1e-300), -37.0471, 1e-4);
}

TEST(Distributions, HaveTheMomentsOfTheirParameters) {
  const int count = 200000;
  for (const auto& [quantile, mean, deviation] :
       {std::tuple{make_normal(), 3.0, 2.0}, {make_lognormal(), 3.0, 2.0}, {make_gumbel(), 3.0, 2.0}}) {
    double sum = 0, squares = 0;
    for (int k = 0; k < count; ++k) {
      const double x = quantile((k + 0.5) / count, std::vector{mean, deviation});
      sum += x, squares += x * x;
    }
    EXPECT_NEAR(sum / count, mean, 1e-3) << "tails beyond the last of 200,000 quantiles";
    EXPECT_NEAR(std::sqrt(squares / count - sum * sum / count / count), deviation, 5e-3);
  }
  EXPECT_EQ(make_uniform()(0.25, std::vector{2.0, 6.0}), 3);
  const Quantile weibull = make_weibull();
  for (const double x : {0.1, 1.0, 5.0, 9.0}) {
    const double u = 1 - std::exp(-std::pow(x / 4, 1.7));
    EXPECT_NEAR(weibull(u, std::vector{4.0, 1.7}), x, 1e-13 * x / (1 - u));
  }
}

/// Outcome 1 where the random variable exceeds 2; the output is the variable.
const Evaluate inner = make_evaluate([](const Point& x) {
  Result r;
  r.state = Result::State::Done;
  r.outcome = x[2] > 2 ? 1 : 0;
  r.values = {x[2]};
  return r;
});

// Normal with fuzzy mean and deviation: the statistics are monotone in both, so their bounds are those of the ends.
TEST(FuzzyRandomnessPhysics, NormalHasClosedForms) {
  MonteCarloOptions options;
  options.samples = 4096;
  const Evaluate outer = with_monte_carlo(
      2, {{make_normal(), {0, 1}}}, inner,
      {make_mean(0), make_deviation(0), make_probability(1), make_share(0, Side::Above, 2), make_quantile(0, 0.9)},
      options);
  AlphaOptions outside = make_thrifty_options();
  outside.levels = {0, 0.5, 1};
  outside.space_points = 20;
  const AlphaResult r = optimise({make_triangular(-1, 0, 1), make_triangular(0.5, 1, 2)}, outer, outside, {});
  ASSERT_EQ(r.outputs.size(), 6u);
  for (const auto& [level, m, low, high] : {std::tuple{0, 1.0, 0.5, 2.0}, {1, 0.5, 0.75, 1.5}, {2, 0.0, 1.0, 1.0}}) {
    const auto bounds = [&, k = level](int o) { return r.outputs[o].levels[k]; };
    // spread points miss about 1/N of the tails: 3.5 deviations / 4096 and the like
    EXPECT_NEAR(bounds(0).lower.value, -m, 2e-3);
    EXPECT_NEAR(bounds(0).upper.value, m, 2e-3);
    EXPECT_NEAR(bounds(1).lower.value, low, 3e-3);
    EXPECT_NEAR(bounds(1).upper.value, high, 6e-3);
    EXPECT_NEAR(bounds(2).lower.value, 1 - calc_phi((2 + m) / low), 1e-3);
    EXPECT_NEAR(bounds(2).upper.value, 1 - calc_phi((2 - m) / high), 1e-3);
    EXPECT_EQ(bounds(3).upper.value, bounds(2).upper.value);
    EXPECT_NEAR(bounds(4).lower.value, -m + low * 1.2815516, 5e-3);
    EXPECT_NEAR(bounds(4).upper.value, m + high * 1.2815516, 1e-2);
    EXPECT_EQ(bounds(5).upper.value, 0) << "no inner run failed";
  }
}

// The k-th of n values stands for the middle of its stratum, (k - 1/2) / n; between them it is linear.
TEST(FuzzyRandomness, QuantilesOfWholeNumbersOfRuns) {
  for (const int n : {1, 10, 100, 1000}) {
    std::vector<Result> runs;
    for (int i = 1; i <= n; ++i) {
      runs.emplace_back().state = Result::State::Done;
      runs.back().values = {static_cast<double>(i)};
    }
    const auto quantile = [&](double q) { return make_quantile(0, q)(runs); };
    for (int k = 1; k <= n; ++k) EXPECT_NEAR(quantile((k - 0.5) / n), k, 1e-12 * n) << n;
    for (int k = 1; k < n; ++k) EXPECT_NEAR(quantile(static_cast<double>(k) / n), k + 0.5, 1e-12 * n) << n;
    // runs that have failed leave the ends open
    EXPECT_TRUE(std::isnan(quantile(0.1 / n))) << "below the first middle";
    EXPECT_TRUE(std::isnan(quantile(1 - 0.1 / n))) << "above the last";
  }
}

TEST(FuzzyRandomness, SameNumbersForEveryParameterSet) {
  MonteCarloOptions options;
  options.samples = 50;
  options.spread = false;
  options.batch = 120;
  const Evaluate outer = with_monte_carlo(2, {{make_normal(), {0, 1}}}, inner, {make_mean(0)}, options);
  std::vector<Point> points = {{0, 1}, {1, 1}, {0, 2}, {0, 1}, {3, 0}};
  std::vector<Result> out(5);
  outer(points, out);
  EXPECT_NEAR(out[1].values[0], out[0].values[0] + 1, 1e-14) << "round-off";
  EXPECT_NEAR(out[2].values[0], 2 * out[0].values[0], 1e-14);
  EXPECT_EQ(out[3].values, out[0].values);
  EXPECT_DOUBLE_EQ(out[4].values[0], 3);
}

TEST(FuzzyRandomness, CountsFailedRuns) {
  const Evaluate failing = make_evaluate([](const Point& x) {
    Result r;
    r.state = x[1] > 0 ? Result::State::Failed : Result::State::Done;
    r.text = "no";
    r.values = {x[1]};
    return r;
  });
  MonteCarloOptions options;
  options.samples = 1024;
  options.most_failed = 1;
  const RandomVariable v{make_uniform(), {0, 0}};
  const Evaluate outer = with_monte_carlo(1, {{[](double u, std::span<const double> p) { return p[0] + u; }, {0}}},
                                          failing, {make_mean(0), make_probability(failed_outcome)}, options);
  std::vector<Point> points = {{-2.0}, {-0.75}, {0.5}};
  std::vector<Result> out(3);
  outer(points, out);
  EXPECT_EQ(out[0].values[2], 0);
  EXPECT_NEAR(out[1].values[2], 0.25, 2e-3);
  EXPECT_EQ(out[1].values[1], out[1].values[2]);
  EXPECT_EQ(out[2].state, Result::State::Failed);
  // a quarter of the inner runs fails, 256 of 1024
  for (const auto& [most, state] : {std::pair{256.0, Result::State::Done}, {255.0, Result::State::Failed}}) {
    options.most_failed = most / 1024;
    const Evaluate strict = with_monte_carlo(1, {{[](double u, std::span<const double> p) { return p[0] + u; }, {0}}},
                                             failing, {make_mean(0)}, options);
    strict(points, out);
    EXPECT_EQ(out[0].state, Result::State::Done);
    EXPECT_EQ(out[1].state, state) << most;
    if (state == Result::State::Failed) { EXPECT_EQ(out[1].text, "256 of 1024 inner runs failed: no"); }
  }
}

TEST(FuzzyRandomness, StrataHoldOnePointEach) {
  for (const int count : {2, 7, 64, 100}) {
    const std::vector<Point> points = make_strata(5, count, 3);
    for (int i = 0; i < 5; ++i) {
      std::vector<double> u;
      for (const Point& x : points) u.push_back(x[i]);
      std::sort(u.begin(), u.end());
      for (int k = 0; k < count; ++k) EXPECT_EQ(u[k], (k + 0.5) / count);
    }
    EXPECT_EQ(points, make_strata(5, count, 3));
    if (count > 7) { EXPECT_NE(points, make_strata(5, count, 4)); }
  }
}

// Sobol points alone are correlated by about 0.1 at 100 points; a random order by 1/sqrt(count).
TEST(FuzzyRandomness, StrataOfDifferentCoordinatesAreHardlyCorrelated) {
  for (const auto& [n, count] : {std::pair{2, 20}, {2, 100}, {2, 400}, {5, 100}, {10, 200}})
    for (const int seed : {1, 2, 3}) {
      const std::vector<Point> points = make_strata(n, count, seed);
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j) {
          double sum = 0, all = 0;
          for (const Point& u : points) {
            const double a = calc_normal_quantile(u[i]), b = calc_normal_quantile(u[j]);
            sum += a * b, all += a * a;
          }
          EXPECT_LT(std::abs(sum / all), 1.1 / count) << n << " x " << count << " seed " << seed;
        }
    }
}

TEST(FuzzyRandomness, QuantilesAreThoseOfTheMiddlesOfStrata) {
  std::vector<Result> runs(5);
  for (int k = 0; k < 5; ++k) runs[k].state = Result::State::Done, runs[k].values = {10.0 * ((k * 3) % 5)};
  for (const auto& [q, value] : {std::pair{0.1, 0.0}, {0.5, 20.0}, {0.6, 25.0}, {0.9, 40.0}})
    EXPECT_DOUBLE_EQ(make_quantile(0, q)(runs), value) << q;
  for (const auto& [side, share] :
       {std::pair{Side::Above, 0.4}, {Side::AtLeast, 0.6}, {Side::Below, 0.4}, {Side::AtMost, 0.6}})
    EXPECT_EQ(make_share(0, side, 20)(runs), share);
  runs[0].state = Result::State::Failed;  // of all runs: neither above nor below
  EXPECT_EQ(make_share(0, Side::AtLeast, 20)(runs), 0.6);
  EXPECT_EQ(make_share(0, Side::Below, 20)(runs), 0.2);
}

TEST(FuzzyRandomness, FailsWhereParametersGiveNoDistribution) {
  RandomVariable v{make_normal(), {0, 1}, [](std::span<const double> p) -> std::string {
                     return p[1] < 0 ? "negative deviation" : "";
                   }};
  const Evaluate outer = with_monte_carlo(2, {v}, inner, {make_mean(0)}, {});
  std::vector<Point> points = {{0, 1}, {0, -1}, {1, 1}};
  std::vector<Result> out(3);
  outer(points, out);
  EXPECT_NEAR(out[0].values[0], 0, 1e-12) << "the strata are symmetric";
  EXPECT_EQ(out[1].state, Result::State::Failed);
  EXPECT_EQ(out[1].text, "negative deviation");
  EXPECT_NEAR(out[2].values[0], 1, 1e-12);
}

TEST(FuzzyRandomness, RefusesWhatCannotBe) {
  EXPECT_THROW(with_monte_carlo(1, {}, inner, {}, {}), InputError);
  EXPECT_THROW(with_monte_carlo(1, {{make_normal(), {0, 1}}}, inner, {}, {}), InputError);
}

}  // namespace
}  // namespace topple::uncertainty
