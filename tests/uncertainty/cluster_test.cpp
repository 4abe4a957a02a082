#include "uncertainty/cluster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

std::vector<Point> make_heaps(const std::vector<Point>& centres, int each, double radius, std::uint64_t seed) {
  Random random(seed);
  std::vector<Point> points;
  for (const auto& c : centres)
    for (int k = 0; k < each; ++k) {
      Point x = c;
      for (double& v : x) v += random.next(-radius, radius);
      points.push_back(std::move(x));
    }
  return points;
}

double distance(const Point& a, const Point& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

double cost_of(const std::vector<Point>& points, const std::vector<int>& medoids) {
  double cost = 0;
  for (const auto& x : points) {
    double nearest = 1e300;
    for (const int m : medoids) nearest = std::min(nearest, distance(x, points[m]));
    cost += nearest;
  }
  return cost;
}

TEST(Medoids, NoSwapIsBetter) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    std::vector<Point> points(40, Point(2));
    for (auto& x : points) x = {random.next(), random.next()};
    for (const int k : {1, 2, 3, 5}) {
      const Medoids r = find_medoids(points, k);
      EXPECT_NEAR(r.cost, cost_of(points, r.medoids), 1e-12) << "round-off";
      for (int g = 0; g < k; ++g)
        for (int c = 0; c < 40; ++c) {
          auto other = r.medoids;
          other[g] = c;
          EXPECT_GE(cost_of(points, other), r.cost - 1e-12);
        }
      for (std::size_t i = 0; i < points.size(); ++i)
        for (int g = 0; g < k; ++g)
          EXPECT_LE(distance(points[i], points[r.medoids[r.group[i]]]), distance(points[i], points[r.medoids[g]]));
    }
  }
}

TEST(Medoids, SilhouetteOfFourPointsOnALine) {
  const std::vector<Point> points = {{0}, {1}, {10}, {11}};
  // (10.5 - 1)/10.5 for the outer, (9.5 - 1)/9.5 for the inner points
  EXPECT_NEAR(find_medoids(points, 2).silhouette, 0.5 * (9.5 / 10.5 + 8.5 / 9.5), 1e-14);
  EXPECT_NEAR(calc_silhouette(points, {0, 1, 1, 0}, 2), 0.25 * (2 * ((5.5 - 11.0) / 11) + 2 * ((5.5 - 9.0) / 9)), 1e-14)
      << "a bad grouping is negative";
}

TEST(FuzzyMeans, RestsAtItsFixedPoint) {
  const auto points = make_heaps({{0, 0}, {3, 1}, {1, 4}}, 30, 0.8, 3);
  const FuzzyMeans r = find_fuzzy_means(points, 3);
  EXPECT_TRUE(r.converged);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double sum = 0;
    for (int g = 0; g < 3; ++g) {
      double inverse = 0;
      for (int h = 0; h < 3; ++h)
        inverse += std::pow(distance(points[i], r.centres[g]) / distance(points[i], r.centres[h]), 2);
      EXPECT_NEAR(r.share[i][g], 1 / inverse, 1e-8);
      sum += r.share[i][g];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  EXPECT_GT(r.partition_coefficient, 1.0 / 3);
  EXPECT_LT(r.partition_coefficient, 1);
}

TEST(FuzzyMeans, TwoPointsAreTheirOwnCentres) {
  const FuzzyMeans r = find_fuzzy_means({{-1, 0}, {1, 2}}, 2);
  EXPECT_NEAR(r.partition_coefficient, 1, 1e-12);
  EXPECT_NEAR(r.xie_beni, 0, 1e-12);
}

TEST(Groups, FindHowManyHeapsThereAre) {
  for (const auto kind : {Clustering::Medoids, Clustering::FuzzyMeans})
    for (int heaps = 2; heaps <= 5; ++heaps) {
      std::vector<Point> centres;
      for (int h = 0; h < heaps; ++h) centres.push_back({std::cos(1.2 * h), std::sin(1.2 * h)});
      const auto points = make_heaps(centres, 25, 0.15, 7);
      const Grouping g = find_groups(points, kind, 6);
      ASSERT_EQ(g.k, heaps);
      EXPECT_EQ(g.tried.size(), 5u);
      for (int h = 0; h < heaps; ++h)
        for (int k = 1; k < 25; ++k) EXPECT_EQ(g.group[25 * h + k], g.group[25 * h]);
    }
}

TEST(Groups, OfNextToNothing) {
  EXPECT_EQ(find_groups({}, Clustering::Medoids, 5).centre.size(), 0u);
  EXPECT_EQ(find_groups({{1, 2}}, Clustering::Medoids, 5).centre, std::vector<int>{0});
  EXPECT_EQ(find_groups({{1, 2}, {1, 2}}, Clustering::FuzzyMeans, 5).k, 1);
}

}  // namespace
}  // namespace topple::uncertainty
