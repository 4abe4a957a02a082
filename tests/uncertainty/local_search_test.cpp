#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "uncertainty/kink_search.h"
#include "uncertainty/line_search.h"
#include "uncertainty/random.h"

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

// The product of two inputs of a simplex is largest in the middle of an edge, which a search has to go along: round-off
// of the constraint stopped it up to 7e-3 off.
TEST(ModelSearch, GoesAlongAConstraint) {
  for (const int n : {3, 5, 8})
    for (const double off : {.004, .02, .1})
      for (const double slack : {0.0, 1e-4}) {
        const Space space{std::vector<FuzzyNumber>(n, make_triangular(0, .1, 1)),
                          {[](const Point& x) {
                            double sum = -1;
                            for (const double v : x) sum += v;
                            return sum;
                          }},
                          {}};
        const Model model = [](const Point& x) { return Told{-x[0] * x[1], 0}; };
        Point start(n, 0.0);
        start[0] = .5 + off - slack, start[1] = .5 - off;
        ModelSearch search(make_region(space, 0), start, model(start), {});
        drive(search, model);
        EXPECT_TRUE(search.is_converged());
        EXPECT_NEAR(search.value(), -.25, 1e-8) << n << " inputs, " << off << " off";
      }
}

TEST(LineSearch, FindsTheBasinOfEachInputThatActsAlone) {
  const Space space = make_cube(5);
  const Model model = [](const Point& x) {
    double sum = 0;
    for (int i = 0; i < 5; ++i) sum += std::cos((2 + .7 * i) * x[i]) + .2 * x[i];
    return Told{sum, 0};
  };
  double want = 0;
  for (int i = 0; i < 5; ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 400000; ++k)
      least = std::min(least, std::cos((2 + .7 * i) * (-2 + 1e-5 * k)) + .2 * (-2 + 1e-5 * k));
    want += least;
  }
  const Point start(5, 0.1);
  LineSearch search(make_region(space, 0), start, model(start), {});
  const int asked = drive(search, model);
  EXPECT_TRUE(search.is_converged());
  EXPECT_NEAR(search.value(), want, .02) << "of 10: searches on a model do the rest";
  EXPECT_LE(asked, 250);
  // from there nothing leads elsewhere
  LineSearch again(make_region(space, 0), search.best(), model(search.best()), {});
  EXPECT_LE(drive(again, model), 130);
  EXPECT_TRUE(again.is_converged());
  EXPECT_NEAR(again.value(), search.value(), .02);
}

TEST(LineSearch, LooksAtPlacesThatAreGivenAndKeepsInside) {
  // a hole that no step of the grid meets, and a constraint
  const Space space{
      std::vector<FuzzyNumber>(2, make_triangular(-2, 0.1, 2)), {[](const Point& x) { return x[0] + x[1] - 1.5; }}, {}};
  int outside = 0;
  const Model model = [&](const Point& x) {
    outside += x[0] + x[1] > 1.5;
    return Told{std::abs(x[1] - .777) < 1e-3 ? -1.0 : 0.0, 0};
  };
  LineSearch::Options options;
  const Point start = {0.1, 0.1};
  LineSearch without(make_region(space, 0), start, model(start), options);
  drive(without, model);
  EXPECT_EQ(without.value(), 0);
  options.more = {{}, {.777}};
  LineSearch with(make_region(space, 0), start, model(start), options);
  drive(with, model);
  EXPECT_EQ(with.value(), -1);
  EXPECT_EQ(outside, 0);
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

// An envelope of planes is least at a vertex, which a search over the vertices of a grid cannot miss by much.
TEST(KinkSearch, FindsTheLowestPlaceOfPlanes) {
  for (int k = 0; k < 20; ++k) {
    Random random(k);
    const std::size_t planes = 7, n = 2;
    std::vector<double> at(planes);
    std::vector<std::vector<double>> slopes(planes, std::vector<double>(n));
    for (double& v : at) v = -random.next();
    for (auto& s : slopes)
      for (double& v : s) v = random.next(-1, 1);
    const std::vector<double> lower = {-0.5, -1}, upper = {1, 0.25};
    const auto calc = [&](double x, double y) {
      double most = -10;
      for (std::size_t j = 0; j < planes; ++j) most = std::max(most, at[j] + slopes[j][0] * x + slopes[j][1] * y);
      return most;
    };
    const std::vector<double> found = find_lowest(at, slopes, lower, upper);
    double least = 10;
    for (int i = 0; i <= 400; ++i)
      for (int j = 0; j <= 400; ++j) least = std::min(least, calc(lower[0] + 1.5 * i / 400, lower[1] + 1.25 * j / 400));
    EXPECT_LE(calc(found[0], found[1]), least + 1e-12) << k;
    EXPECT_TRUE(found[0] >= lower[0] && found[0] <= upper[0] && found[1] >= lower[1] && found[1] <= upper[1]);
  }
}

// In a valley that is narrower than the first star curvatures grow as stars shrink, as they do at a kink.
TEST(ModelSearch, TellsNarrowValleysFromKinks) {
  const Space space = make_cube(2);
  const Model waves = [](const Point& x) {
    return Told{std::sin(6 * x[0] + 4 * x[1] * x[1]) * std::cos(8 * x[1] - 2 * x[0]) + 0.05 * x[0], 0};
  };
  const Model kink = [](const Point& x) {
    return Told{std::abs(x[0] - 0.3 * x[1]) + 2 * std::abs(x[1] + 0.2 * x[0]), 0};
  };
  ModelSearch::Options options;
  options.edge = 1e-3;
  int misled = 0;
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const Point start = {random.next(-1.9, 1.9), random.next(-1.9, 1.9)};
    for (const bool doubts : {false, true}) {
      options.doubts_edges = doubts;
      ModelSearch smooth(make_region(space, 0), start, waves(start), options);
      drive(smooth, waves);
      if (doubts)
        EXPECT_TRUE(smooth.is_converged() && !smooth.is_at_edge()) << "from " << start[0] << ", " << start[1];
      else
        misled += smooth.is_at_edge() ? 1 : 0;
      ModelSearch bent(make_region(space, 0), start, kink(start), options);
      drive(bent, kink);
      EXPECT_TRUE(bent.is_at_edge() && !bent.is_wavy()) << "from " << start[0] << ", " << start[1];
    }
  }
  EXPECT_GE(misled, 20) << "nothing that could mislead";
}

// Beside a wall at which values fall as a root does every place looks like an end; beside others it is one.
TEST(ModelSearch, SeesValuesFallSteeplyTowardsAWall) {
  const Space space = make_cube(2);
  const auto calc_depth = [](const Point& x) { return x[0] * x[0] - x[1] + 0.7; };
  const Model root = [&](const Point& x) {
    const double d = calc_depth(x);
    return d < 0 ? Told{std::numeric_limits<double>::infinity(), failed_outcome} : Told{std::sqrt(d) - 0.2 * x[1], 0};
  };
  const Model line = [&](const Point& x) {
    const double d = calc_depth(x);
    return d < 0 ? Told{std::numeric_limits<double>::infinity(), failed_outcome} : Told{d + 0.5 * x[0] * x[0], 0};
  };
  Random random(5);
  ModelSearch::Options options;
  options.looks_steep = [](const Point&) { return true; };
  for (int k = 0; k < 40; ++k) {
    Point start;
    do { start = {random.next(-1.5, 1.5), random.next(-1.5, 1.5)}; } while (calc_depth(start) < 0);
    ModelSearch steep(make_region(space, 0), start, root(start), options);
    drive(steep, root);
    EXPECT_TRUE(steep.is_steep() && !steep.is_converged())
        << "from " << start[0] << ", " << start[1] << " to " << steep.best()[0] << ", " << steep.best()[1] << " "
        << steep.value() << " depth " << calc_depth(steep.best()) << " conv " << steep.is_converged()
        << steep.is_at_edge() << steep.has_met_walls();
    ModelSearch flat(make_region(space, 0), start, line(start), options);
    drive(flat, line);
    EXPECT_FALSE(flat.is_steep()) << "from " << start[0] << ", " << start[1];
  }
}

TEST(ModelSearch, ForetellsWhatItMayComeTo) {
  const Space space = make_cube(2);
  const Model model = [](const Point& x) { return Told{std::cosh(x[0] - 0.2) + std::cosh(1.5 * (x[1] + 0.1)), 0}; };
  const Point start = {1.5, 1.2};
  ModelSearch search(make_region(space, 0), start, model(start), {});
  EXPECT_EQ(search.calc_outlook(), -std::numeric_limits<double>::infinity());
  int foretold = 0;
  while (!search.is_done()) {
    std::vector<Told> told;
    for (const Point& x : search.pending()) told.push_back(model(x));
    search.tell(told);
    if (!std::isfinite(search.calc_outlook())) continue;
    ++foretold;
    EXPECT_LE(search.calc_outlook(), 2 + 1e-9);
  }
  EXPECT_GE(foretold, 2);
  EXPECT_NEAR(search.calc_outlook(), 2, 1e-6);
}

TEST(KinkSearch, FollowsAnEdgeThatNoAxisImproves) {
  const Space space = make_cube(3);
  const Model model = [](const Point& x) {
    return Told{5 * std::abs(x[0] - x[1] * x[2]) + 3 * std::abs(x[1] + x[2] - 0.2) + x[0], 0};
  };
  const Point start = {-0.03, 0.3, -0.1};  // on both edges
  ModelSearch::Options options;
  options.edge = 1e-3;
  ModelSearch stuck(make_region(space, 0), start, model(start), options);
  drive(stuck, model);
  EXPECT_TRUE(stuck.is_at_edge());
  KinkSearch::Options more;
  more.iterations = 300;
  KinkSearch search(make_region(space, 0), stuck.best(), model(stuck.best()), more);
  EXPECT_LE(drive(search, model), 1505);
  // on the edges x0 = x1 (0.2 - x1), which is least at an end
  EXPECT_NEAR(search.value(), -2, 1e-3) << "not " << stuck.value();
}

TEST(KinkSearch, EndsInACornerAtOnce) {
  const Space space = make_cube(4);
  const Model model = [](const Point& x) { return Told{x[0] + x[1] + x[2] + x[3], 0}; };
  const Point corner = {-2, -2, -2, -2};
  KinkSearch search(make_region(space, 0), corner, model(corner), {});
  EXPECT_EQ(drive(search, model), 6);
  EXPECT_TRUE(search.is_converged());
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

TEST(FaceSearch, FindsTheBestCornerOfABilinearForm) {
  const int n = 11;
  const Space space = make_cube(n);
  const auto calc = [](const Point& x) {
    double s = 0;
    for (int i = 0; i < n; ++i) {
      s += std::cos(3.7 * i) * x[i];
      for (int j = 0; j < i; ++j) s += std::sin(5.1 * i + 2.3 * j * j) * x[i] * x[j];
    }
    return s;
  };
  const Model model = [&](const Point& x) { return Told{calc(x), 0}; };
  const Region region = make_region(space, 0);
  double least = std::numeric_limits<double>::infinity();
  for (const Point& x : make_corners(region.box)) least = std::min(least, calc(x));
  FaceSearch::Options options;
  options.least_gain = 1e-6;
  int found = 0;
  for (std::uint64_t start = 0; start < 10; ++start) {
    const Point x = place_in(region.box, make_sobol_points(n, 1, 1, start)[0]);
    FaceSearch alone(region, x, model(x), options);
    EXPECT_LE(drive(alone, model), 150);
    EXPECT_TRUE(alone.is_converged());
    EXPECT_FALSE(alone.is_paired());
    found += alone.value() <= least + 1e-9;
    FaceSearch::Options with_pairs = options;
    with_pairs.pairs = true;
    FaceSearch search(region, x, model(x), with_pairs);
    EXPECT_LE(drive(search, model), 250);
    EXPECT_TRUE(search.is_paired());
    EXPECT_TRUE(search.is_foretold());
    EXPECT_NEAR(search.value(), least, 1e-9) << "start " << start;
  }
  EXPECT_LT(found, 10) << "single moves alone end in other corners too";
}

TEST(FaceSearch, FindsTheDeeperValleyOfEachInput) {
  const Space space = make_cube(10);
  const Model model = [](const Point& x) {
    double s = 0;
    for (const double v : x) s += v * v * v * v - 3 * v * v + 0.5 * v;
    return Told{s, 0};
  };
  const Point start(10, 1.1);
  FaceSearch::Options options;
  options.least_gain = 1e-6;
  const Region region = make_region(space, 0);
  options.wide_axes = region.axes;
  FaceSearch search(region, start, model(start), options);
  drive(search, model);
  for (const double v : search.best()) EXPECT_NEAR(v, -1.264, 0.3) << "refining is for others";
  EXPECT_FALSE(search.is_foretold()) << "no corner";
}

TEST(FaceSearch, KeepsInsideAndPassesFailures) {
  Space space = make_cube(9);
  space.constraints.push_back([](const Point& x) { return x[0] + x[1] + x[2] - 3; });
  const double infinite = std::numeric_limits<double>::infinity();
  const Region region = make_region(space, 0);
  const Model model = [&](const Point& x) {
    EXPECT_TRUE(region.contains(x));
    if (x[8] > 1) return Told{infinite, failed_outcome};
    double s = 0;
    for (const double v : x) s -= v;
    return Told{s, 0};
  };
  const Point start(9, 0.1);
  FaceSearch::Options options;
  options.least_gain = 1e-6;
  options.pairs = true;
  options.wide_axes = region.axes;
  FaceSearch search(region, start, model(start), options);
  drive(search, model);
  EXPECT_TRUE(search.is_converged());
  EXPECT_LE(search.value(), -10 - 2.2 - 1)
      << "five at their ends, two of the constraint's three, one before the failure";
  EXPECT_LE(search.best()[8], 1);
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

// The same plane with half of what lies beyond it taken away: rays that leave what counts before they meet it say
// nothing, and nothing is asked there.
TEST(WallProbe, KeepsToWhatCounts) {
  const Box box{{-2, -2, -2}, {2, 2, 2}};
  const auto is_inside = [](const Point& x) { return 2 * x[0] - x[1] + 2 * x[2] < 1.5; };
  const auto is_allowed = [](const Point& x) { return x[0] + 3 * x[1] + x[2] < 1.4; };
  const Point inside{0.2, 0.1, 0.3}, outside{0.6, 0, 0.5};
  WallProbe probe(box, {1, 1, 1}, {0, 1, 2}, inside, outside, 0.1, is_allowed);
  int asked = 0;
  while (!probe.is_done()) {
    std::vector<bool> told;
    for (const auto& x : probe.pending()) {
      EXPECT_TRUE(is_allowed(x));
      told.push_back(is_inside(x));
      ++asked;
    }
    probe.tell(told);
  }
  EXPECT_GT(asked, 20);
  ASSERT_TRUE(probe.found());
  // whatever rays are left, crossings lie on the plane
  EXPECT_NEAR(probe.calc_distance(inside), (1.5 - 0.4 + 0.1 - 0.6) / 3, 0.02);
}

}  // namespace
}  // namespace topple::uncertainty
