#include "collapse/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plans.h"

namespace topple::collapse {
namespace {

TEST(Schedule, NormalNumbersHaveMeanZeroAndUnitVariance) {
  constexpr int n = 20000;
  double sum = 0, sum2 = 0;
  for (int i = 0; i < n; ++i) {
    const double x = calc_normal(7, static_cast<std::uint64_t>(i));
    sum += x, sum2 += x * x;
  }
  // four standard errors: 1/sqrt(n) of the mean, sqrt(2/n) of the variance
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(sum2 / n, 1, 4 * std::sqrt(2.0 / n));
}

TEST(Schedule, NumbersAreTheSameEverywhere) {
  // every operation is exact or rounded as IEEE 754 says; the numbers come from an implementation in another language
  EXPECT_EQ(calc_normal(1998, 0), calc_normal(1998, 0));
  EXPECT_NE(calc_normal(1998, 0), calc_normal(1998, 1));
  EXPECT_NE(calc_normal(1998, 0), calc_normal(1999, 0));
  EXPECT_EQ(calc_normal(1998, 0), 0x1.76a8d5bfcca00p-1);
  EXPECT_EQ(calc_normal(1998, 3), 0x1.d51f04c6faae9p+0);
}

TEST(Schedule, FiresWithinTheScatterAndNeverBeforeTheStage) {
  product::Plan plan;
  plan.analysis.seed = 5;
  plan.stages.resize(1);
  plan.stages[0].time = 2;
  product::Charge c;
  c.delay = 0.01, c.scatter = 0.01;
  plan.stages[0].charges.assign(3000, c);
  const auto schedule = make_schedule(plan, default_knowledge());
  ASSERT_EQ(schedule.size(), 3000u);
  EXPECT_TRUE(std::is_sorted(schedule.begin(), schedule.end(),
                             [](const Firing& a, const Firing& b) { return a.time < b.time; }));
  EXPECT_EQ(schedule.front().time, 2.0);  // one sigma below the delay is cut off at the stage
  // three standard deviations above, rounded
  EXPECT_LE(schedule.back().time, 2.04 + 1e-12);
  EXPECT_GT(schedule.back().time, 2.03);
}

TEST(Schedule, KeepsTheOrderOfThePlanAtEqualTimesAndMarksFailures) {
  product::Plan plan;
  plan.stages.resize(2);
  plan.stages[0].charges.resize(3);
  plan.stages[0].charges[1].fails = true;
  plan.stages[0].charges[2].delay = 5;
  plan.stages[1].time = 1;
  plan.stages[1].charges.resize(1);
  const auto s = make_schedule(plan, default_knowledge());
  ASSERT_EQ(s.size(), 4u);
  EXPECT_EQ(s[0].charge, 0);
  EXPECT_EQ(s[1].charge, 1);
  EXPECT_TRUE(s[1].fails);
  EXPECT_EQ(s[2].stage, 1);
  EXPECT_EQ(s[3].time, 5);
}

}  // namespace
}  // namespace topple::collapse
