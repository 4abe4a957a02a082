#include "uncertainty/local_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace topple::uncertainty {
namespace {

using Model = std::function<Told(const Point&)>;

/// Feeds a search; returns the number of points.
int drive(LocalSearch& search, const Model& model) {
  int asked = 0;
  while (!search.is_done()) {
    std::vector<Told> told;
    for (const auto& x : search.pending()) told.push_back(model(x));
    asked += static_cast<int>(told.size());
    search.tell(told);
  }
  return asked;
}

Space make_cube(int n) { return {std::vector<FuzzyNumber>(n, make_triangular(-2, 0.1, 2)), {}, {}}; }

TEST(ModelSearch, FindsTheBottomOfAQuadraticValley) {
  const Space space = make_cube(4);
  const Model model = [](const Point& x) {
    double s = 0;
    for (int i = 0; i < 4; ++i) {
      double row = -0.3 * i;
      for (int j = 0; j < 4; ++j) row += std::cos(i * j + 1.0) * x[j];
      s += std::pow(3, i) * row * row;
    }
    return Told{s, 0};
  };
  const Point start = {1, -1, 1, 1};
  ModelSearch search(make_region(space, 0), start, model(start), {});
  const int asked = drive(search, model);
  EXPECT_TRUE(search.is_converged());
  EXPECT_NEAR(search.value(), 0, 1e-8);
  EXPECT_LE(asked, 120) << "a Newton step or two";
}

TEST(ModelSearch, FollowsRosenbrocksValley) {
  const Space space = make_cube(2);
  const Model model = [](const Point& x) {
    return Told{100 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1 - x[0], 2), 0};
  };
  const Point start = {-1.2, 1};
  ModelSearch search(make_region(space, 0), start, model(start), {});
  drive(search, model);
  EXPECT_NEAR(search.best()[0], 1, 1e-3);
  EXPECT_NEAR(search.value(), 0, 1e-7);
}

TEST(ModelSearch, StopsInACornerOnIt) {
  const Space space = make_cube(3);
  const Model model = [](const Point& x) { return Told{x[0] - 2 * x[1] + 0.1 * x[2] * x[2] * x[2], 0}; };
  const Point start = {0, 0, -0.5};
  ModelSearch search(make_region(space, 0.25), start, model(start), {});
  drive(search, model);
  const Box box = make_box(space, 0.25);
  EXPECT_TRUE(search.is_converged());
  EXPECT_EQ(search.best(), (Point{box.lower[0], box.upper[1], box.lower[2]})) << "exactly";
}

TEST(ModelSearch, CrossesAJumpToBetterValues) {
  const Space space = make_cube(2);
  const Model model = [](const Point& x) {
    return x[0] > 0.5 ? Told{-10 + x[0] * x[0] + x[1] * x[1], 1} : Told{x[1] - x[0], 0};
  };
  const Point start = {0, 0};
  ModelSearch search(make_region(space, 0), start, model(start), {});
  drive(search, model);
  EXPECT_NEAR(search.value(), -9.75, 1e-3) << "at (0.5, 0), where the jump begins";
}

TEST(ModelSearch, StaysBeforeAWall) {
  const Space space = make_cube(2);
  const double infinite = std::numeric_limits<double>::infinity();
  const Model model = [&](const Point& x) {
    return x[0] + 2 * x[1] > 1 ? Told{infinite, failed_outcome} : Told{-x[0] - x[1] + x[0] * x[0], 0};
  };
  const Point start = {-1, -1};
  ModelSearch search(make_region(space, 0), start, model(start), {});
  drive(search, model);
  // on the wall y = (1 - x)/2: x² - x/2 - 1/2 is least at x = 1/4
  EXPECT_NEAR(search.value(), -0.5625, 1e-5);
  EXPECT_EQ(model(search.best()).outcome, 0);
}

TEST(EvolutionSearch, LeavesASmallBasin) {
  const Space space = make_cube(2);
  const Model model = [](const Point& x) {
    return Told{x[0] * x[0] + x[1] * x[1] + 0.3 * std::sin(15 * x[0]) * std::sin(15 * x[1]), 0};
  };
  const Point start = {1.5, -1.5};
  EvolutionSearch search(make_region(space, 0), start, model(start), {});
  drive(search, model);
  EXPECT_LT(search.value(), 0.3);
  EXPECT_FALSE(search.is_converged()) << "it has no model to tell";
}

TEST(WallProbe, FindsAPlane) {
  const Box box{{-2, -2, -2}, {2, 2, 2}};
  const auto is_inside = [](const Point& x) { return 2 * x[0] - x[1] + 2 * x[2] < 1.5; };
  WallProbe probe(box, {1, 1, 1}, {0, 1, 2}, {0.2, 0.1, 0.3}, {0.6, 0, 0.5}, 0.1);
  while (!probe.is_done()) {
    std::vector<bool> inside;
    for (const auto& x : probe.pending()) inside.push_back(is_inside(x));
    probe.tell(inside);
  }
  ASSERT_TRUE(probe.found());
  // bisected to 1/256 of rays of about 0.5
  EXPECT_NEAR(probe.normal()[0], 2.0 / 3, 0.03);
  EXPECT_NEAR(probe.normal()[1], -1.0 / 3, 0.03);
  EXPECT_NEAR(probe.normal()[2], 2.0 / 3, 0.03);
  EXPECT_NEAR(probe.calc_distance({0.2, 0.1, 0.3}), (1.5 - 0.4 + 0.1 - 0.6) / 3, 5e-3);
}

}  // namespace
}  // namespace topple::uncertainty
