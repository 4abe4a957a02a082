#include "uncertainty/randomness.h"

#include <gtest/gtest.h>

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
      {make_mean(0), make_deviation(0), make_probability(1), make_exceedance(0, 2), make_empirical_quantile(0, 0.9)},
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

// The smallest value that q of all do not exceed: the k-th where q n is k, whatever floating point makes of it.
TEST(FuzzyRandomness, QuantilesOfWholeNumbersOfRuns) {
  const auto make_runs = [](int n) {
    std::vector<Result> runs;
    for (int i = 1; i <= n; ++i) {
      runs.emplace_back().state = Result::State::Done;
      runs.back().values = {static_cast<double>(i)};
    }
    return runs;
  };
  for (const int n : {1, 10, 100, 1000}) {
    const std::vector<Result> runs = make_runs(n);
    for (int k = 1; k <= n; ++k) EXPECT_EQ(make_empirical_quantile(0, static_cast<double>(k) / n)(runs), k) << n;
    EXPECT_EQ(make_empirical_quantile(0, 0)(runs), 1);
  }
  EXPECT_GT(0.07 * 100, 7) << "what floating point makes of it";
  EXPECT_EQ(make_empirical_quantile(0, 0.07)(make_runs(100)), 7);
  EXPECT_EQ(make_empirical_quantile(0, 0.0701)(make_runs(100)), 8);
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
}

TEST(FuzzyRandomness, RefusesWhatCannotBe) {
  EXPECT_THROW(with_monte_carlo(1, {}, inner, {}, {}), InputError);
  EXPECT_THROW(with_monte_carlo(1, {{make_normal(), {0, 1}}}, inner, {}, {}), InputError);
}

}  // namespace
}  // namespace topple::uncertainty
