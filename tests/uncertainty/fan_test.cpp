#include "uncertainty/fan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "uncertainty/alpha.h"

namespace topple::uncertainty {
namespace {

/// e^{-δτ} cos ωτ on τ = 0, 0.1 ... 5 as trajectory.
Evaluate make_oscillation() {
  return make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    for (int k = 0; k <= 50; ++k) r.trajectory.push_back(std::exp(-x[0] * 0.1 * k) * std::cos(x[1] * 0.1 * k));
    return r;
  });
}

Space make_space() { return {{make_triangular(.05, .1, .2), make_triangular(1.6, 2, 2.6)}, {}, {}}; }

// Numbers computed independently, to six decimals.
TEST(FuzzyFunctionReference, FunctionalsOfTheTrajectoryAreOptimised) {
  const auto at = [](int k) { return [k](std::span<const double> t) { return t[k]; }; };
  const AlphaResult r = optimise(make_space(), with_functionals(make_oscillation(), {at(17), at(40)}), {}, {});
  const double want[2][4][2] = {
      {{-.918512, -.205161}, {-.899200, -.386531}, {-.880293, -.557179}, {-.858419, -.704318}},
      {{-.818731, .813151}, {-.778801, .677087}, {-.722182, .450678}, {-.478286, .177060}}};
  for (int o = 0; o < 2; ++o)
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(r.outputs[o].levels[k].lower.value, want[o][k][0], 2e-6);
      EXPECT_NEAR(r.outputs[o].levels[k].upper.value, want[o][k][1], 2e-6);
    }
  // the fan holds the optimised values where they were asked for, is nested, and nowhere wider than the truth
  const auto fan = calc_fan(make_space(), r.archive, {0, 0.25, 0.5, 0.75, 1});
  ASSERT_EQ(fan.size(), 5u);
  EXPECT_EQ(fan[0].lower[17], r.outputs[0].levels[0].lower.value);
  EXPECT_EQ(fan[0].upper[40], r.outputs[1].levels[0].upper.value);
  EXPECT_EQ(fan[4].curves, 1);
  for (std::size_t k = 1; k < fan.size(); ++k)
    for (std::size_t t = 0; t < fan[k].lower.size(); ++t) {
      EXPECT_GE(fan[k].lower[t], fan[k - 1].lower[t]);
      EXPECT_LE(fan[k].upper[t], fan[k - 1].upper[t]);
    }
  for (int t = 0; t <= 50; ++t) {
    double low = 1, high = -1;
    for (int i = 0; i <= 200; ++i)
      for (int j = 0; j <= 200; ++j) {
        const double v = std::exp(-(.05 + .15 * i / 200) * 0.1 * t) * std::cos((1.6 + j / 200.0) * 0.1 * t);
        low = std::min(low, v), high = std::max(high, v);
      }
    // the true envelope from a grid of 201 x 201, whose own error is below 1e-3
    EXPECT_GE(fan[0].lower[t], low - 1e-3);
    EXPECT_LE(fan[0].upper[t], high + 1e-3);
    EXPECT_NEAR(fan[0].lower[t], low, 0.03) << "an inner estimate, but a good one, at place " << t;
    EXPECT_NEAR(fan[0].upper[t], high, 0.03) << t;
  }
}

TEST(Fan, KeepsClassesApartAndTakesShortCurves) {
  const Space space{{make_triangular(0, 1, 2)}, {}, {}};
  Archive archive;
  const auto add = [&](double x, int outcome, std::vector<double> trajectory) {
    Result r;
    r.state = outcome == failed_outcome ? Result::State::Failed : Result::State::Done;
    r.outcome = outcome;
    r.trajectory = std::move(trajectory);
    archive.add({{x}, r});
  };
  add(1, 0, {0, 1, 2});
  add(0.5, 0, {0, 3});
  add(1.5, 1, {0, -5, -7});
  add(1.2, failed_outcome, {0, 100, 100});
  const auto all = calc_fan(space, archive, {0, 0.75});
  EXPECT_EQ(all[0].curves, 3);
  EXPECT_EQ(all[0].upper, (std::vector<double>{0, 3, 2}));
  EXPECT_EQ(all[0].lower, (std::vector<double>{0, -5, -7}));
  EXPECT_EQ(all[0].at_lower[2], 2);
  EXPECT_EQ(all[1].curves, 1);
  const auto one = calc_fan(space, archive, {0}, 1);
  EXPECT_EQ(one[0].curves, 1);
  EXPECT_EQ(one[0].upper[1], -5);
  const auto none = calc_fan(space, archive, {0}, 9);
  EXPECT_EQ(none[0].at_upper[0], -1);
  EXPECT_TRUE(std::isnan(none[0].upper[0]));
}

TEST(Fan, LeavesOutWhatACurveDoesNotHave) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Archive archive;
  for (const double middle : {nan, 2.0, 4.0}) {
    Result r;
    r.state = Result::State::Done;
    r.trajectory = {0, middle, nan};
    archive.add({{1 + 0.1 * static_cast<double>(archive.size())}, r});
  }
  const auto fan = calc_fan(Space{{make_triangular(0, 1, 2)}, {}, {}}, archive, {0});
  EXPECT_EQ(fan[0].lower[1], 2);
  EXPECT_EQ(fan[0].upper[1], 4);
  EXPECT_EQ(fan[0].at_lower[2], -1);
  EXPECT_TRUE(std::isnan(fan[0].upper[2]));
}

}  // namespace
}  // namespace topple::uncertainty
