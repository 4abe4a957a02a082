#include "uncertainty/largest_box.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

constexpr double margin = 1e-6;
const Box unit{{0, 0}, {1, 1}};

Front make_front(const Point& seed, const std::vector<Point>& bad) {
  Front f(seed);
  for (const auto& p : bad) f.add(p);
  return f;
}

/// The largest rectangle by trying all sides at bad points and edges.
double find_exact(const Point& seed, const std::vector<Point>& bad) {
  std::vector<double> low[2], high[2];
  for (int i = 0; i < 2; ++i) {
    low[i] = {0}, high[i] = {1};
    for (const auto& p : bad) (p[i] < seed[i] ? low : high)[i].push_back(p[i]);
  }
  double best = 0;
  for (const double a : low[0])
    for (const double b : high[0])
      for (const double c : low[1])
        for (const double d : high[1]) {
          const bool empty = std::none_of(bad.begin(), bad.end(),
                                          [&](const Point& p) { return p[0] > a && p[0] < b && p[1] > c && p[1] < d; });
          if (empty) best = std::max(best, (b - a) * (d - c));
        }
  return best;
}

TEST(LargestBox, IsNearlyAlwaysTheLargestInTwoDimensions) {
  int exact = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Point middle = {random.next(0.3, 0.7), random.next(0.3, 0.7)};
    std::vector<Point> bad;
    for (int k = 0; k < 15; ++k) bad.push_back({random.next(), random.next()});
    const Box box = find_largest_box(unit, make_front(middle, bad), margin, 8, 1);
    EXPECT_TRUE(box.contains(middle));
    for (const auto& p : bad) EXPECT_FALSE(box.contains(p));
    const double best = find_exact(middle, bad), found = calc_volume(box);
    EXPECT_LE(found, best + 1e-12);
    EXPECT_GE(found, 0.8 * best) << "a local optimum, never far off; seed " << seed;
    exact += found > best - 1e-5;
  }
  EXPECT_GE(exact, 36) << "of 40";
}

TEST(LargestBox, IsEverythingWithoutViolations) {
  const Box box = find_largest_box(unit, make_front({0.5, 0.5}, {}), 0.01, 1, 1);
  EXPECT_EQ(box.lower, unit.lower);
  EXPECT_EQ(box.upper, unit.upper);
}

TEST(LargestBox, KeepsTheMargin) {
  const Box box = find_largest_box({{0}, {10}}, make_front({4}, {{1}, {9}, {9.5}}), 0.02, 1, 1);
  EXPECT_NEAR(box.lower[0], 1.2, 1e-9);
  EXPECT_NEAR(box.upper[0], 8.8, 1e-9);
}

TEST(LargestBox, IsTheSeedWhereThereIsNoRoom) {
  const Box box = find_largest_box(unit, make_front({0.5, 0.5}, {{0.501, 0.5}}), 0.01, 4, 1);
  EXPECT_EQ(calc_volume(box), 0);
  EXPECT_TRUE(box.contains({0.5, 0.5}));
}

TEST(LargestBox, FrontDropsWhatLiesBehind) {
  Front f({0, 0});
  f.add({2, 2});
  f.add({3, 3});
  EXPECT_EQ(f.points().size(), 1u);
  f.add({1, 4});
  f.add({-1, 1});
  EXPECT_EQ(f.points().size(), 3u);
  f.add({1, 1});
  EXPECT_EQ(f.points(), (std::vector<Point>{{-1, 1}, {1, 1}}));
}

}  // namespace
}  // namespace topple::uncertainty
