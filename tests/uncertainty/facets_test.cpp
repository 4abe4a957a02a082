#include "uncertainty/facets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "uncertainty/cut_program.h"
#include "uncertainty/possibility.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

/// a·x <= b for all rows: outcome 1, others 0. The sum of the inputs is the output.
struct Polytope {
  std::vector<std::vector<double>> rows;
  std::vector<double> ends;

  bool contains(const Point& x) const {
    for (std::size_t j = 0; j < rows.size(); ++j)
      if (std::inner_product(x.begin(), x.end(), rows[j].begin(), 0.0) > ends[j]) return false;
    return true;
  }
};

Space make_space(int n) {
  return {std::vector<FuzzyNumber>(static_cast<std::size_t>(n), make_triangular(0, .5, 1)), {}, {}};
}

Evaluate make_model(const std::function<bool(const Point&)>& is_inside) {
  return make_evaluate([is_inside](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = is_inside(x);
    r.values = {std::accumulate(x.begin(), x.end(), 0.0)};
    return r;
  });
}

bool is_in(const Result& r) { return r.outcome == 1; }

/// The support is the unit cube, so widths are lengths.
struct Setting {
  Space space;
  Region support;
  Progress progress;
  Asker asker;
  Setting(int n, const std::function<bool(const Point&)>& is_inside)
      : space(make_space(n)), support(make_region(space, 0)), asker(make_model(is_inside), progress) {
    std::vector<Point> points = {calc_centre(space)};
    for (const auto& u : make_sobol_points(n, 1, 200, 1)) points.push_back(u);
    asker.ask(points);
  }
};

TEST(FacetsPhysics, PlanesAreLocatedExactly) {
  const Polytope p{{{1, 1, 1}, {1, -1, 0}, {-.2, 0, -1}}, {1.1, .15, -.1}};
  Setting run(3, [&p](const Point& x) { return p.contains(x); });
  FacetSearch search(run.support, run.asker, is_in);
  // the first two meet at the most of x1, the last one bounds the least of x3
  const FacetSearch::Goal first{run.support, {-1, 0, 0}}, second{run.support, {0, 0, 1}};
  const int before = run.asker.asked();
  search.run({first, second}, 2000);
  EXPECT_LE(run.asker.asked() - before, 600);
  EXPECT_TRUE(search.is_polyhedral() && search.is_complete());
  const std::vector<Boundary::Plane> planes = search.list_planes();
  ASSERT_EQ(planes.size(), 3u);
  for (std::size_t j = 0; j < 3; ++j) {
    const double length = std::sqrt(std::inner_product(p.rows[j].begin(), p.rows[j].end(), p.rows[j].begin(), 0.0));
    const auto is_this = [&](const Boundary::Plane& f) {
      double off = std::abs(f.side.b - p.ends[j] / length);
      for (std::size_t k = 0; k < 3; ++k) off = std::max(off, std::abs(f.side.a[k] - p.rows[j][k] / length));
      return off < 2e-5;
    };
    EXPECT_EQ(std::count_if(planes.begin(), planes.end(), is_this), 1) << j;
  }
  const auto most = search.confirm(first), least = search.confirm(second);
  ASSERT_TRUE(most && least);
  // x2 = x1 - .15, x3 = 0, x1 + x2 + x3 = 1.1
  EXPECT_NEAR(*most, -.625, 1e-6);
  EXPECT_NEAR(*least, 0, 1e-6) << "where x1 is .5 and more";
}

// Against linear programmes over the true half spaces: cuts, outcomes, both signs.
TEST(FacetsPhysics, BoundsAndPossibilitiesInRandomPolytopes) {
  int bounds = 0;
  for (const int n : {2, 3, 4, 5})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Random random(100 * static_cast<std::uint64_t>(n) + seed);
      Polytope p;
      Point inside(static_cast<std::size_t>(n));
      for (double& x : inside) x = random.next(.15, .85);
      for (int j = 0; j < 3; ++j) {
        std::vector<double> row(static_cast<std::size_t>(n));
        for (double& a : row) a = random.next(-1, 1);
        p.ends.push_back(std::inner_product(row.begin(), row.end(), inside.begin(), 0.0) + random.next(.02, .1));
        p.rows.push_back(row);
      }
      const Space space = make_space(n);
      // the least sum in the polytope and a cut; nothing where they do not meet
      const auto solve = [&](double alpha, double sign) -> std::optional<double> {
        const Box box = make_box(space, alpha);
        const std::size_t size = inside.size();
        Quadratic excess{std::vector<double>(size + 1, 0.0), std::vector<double>((size + 1) * (size + 1), 0.0)};
        excess.slope[size] = 1;
        std::vector<HalfSpace> sides, lifted;
        std::vector<double> start = calc_centre(space), lower = box.lower, upper = box.upper;
        double most = -1;
        for (std::size_t j = 0; j < p.rows.size(); ++j) {
          sides.push_back({p.rows[j], p.ends[j]});
          lifted.push_back(sides.back());
          lifted.back().a.push_back(-1);
          most = std::max(most, std::inner_product(start.begin(), start.end(), p.rows[j].begin(), -p.ends[j]));
        }
        start.push_back(most), lower.push_back(-2), upper.push_back(most + 1);
        std::vector<double> at = minimise(excess, lifted, lower, upper, start);
        if (at.back() > 0) return std::nullopt;
        at.pop_back();
        const Quadratic sum{std::vector<double>(size, sign), std::vector<double>(size * size, 0.0)};
        return sum(minimise(sum, sides, box.lower, box.upper, at));
      };
      Progress progress;
      Asker asker(make_model([&p](const Point& x) { return p.contains(x); }), progress);
      PossibilityResult found;
      AlphaOptions options;
      options.seed = seed;
      options.before_classes = [&] {
        found = find_possibilities(space, asker, {});
        return found.facets;
      };
      const AlphaResult r = optimise(space, asker, options);
      double low = 0, high = 1;
      for (int k = 0; k < 40; ++k) (solve(.5 * (low + high), 1) ? low : high) = .5 * (low + high);
      for (const Possibility& c : found.classes) {
        if (c.outcome != 1) continue;
        EXPECT_NEAR(c.possibility, solve(1, 1) ? 1 : low, 2e-5) << n << " seed " << seed;
      }
      for (const ClassBounds& c : r.classes)
        for (const auto& level : c.outputs[0].levels) {
          if (c.outcome != 1 || level.alpha >= 1) continue;
          for (const double sign : {1.0, -1.0}) {
            const Bound& bound = sign > 0 ? level.lower : level.upper;
            const auto least = solve(level.alpha, sign);
            if (!least || level.alpha > low - .01) continue;
            ++bounds;
            EXPECT_NEAR(sign * bound.value, *least, 1e-4 * n) << n << " seed " << seed << " alpha " << level.alpha;
          }
        }
      EXPECT_LE(asker.asked(), 10000);
    }
  EXPECT_GT(bounds, 50);
}

TEST(Facets, ABendIsNoPlane) {
  for (const int n : {2, 3, 5}) {
    Setting run(n, [](const Point& x) {
      double square = 0;
      for (const double v : x) square += (v - .3) * (v - .3);
      return square < .12;
    });
    FacetSearch search(run.support, run.asker, is_in);
    const int before = run.asker.asked();
    search.run({{run.support, std::vector<double>(static_cast<std::size_t>(n), -1.0)}}, 2000);
    EXPECT_TRUE(search.has_bend()) << n;
    EXPECT_FALSE(search.is_polyhedral()) << n;
    EXPECT_LE(run.asker.asked() - before, 200) << n;
  }
}

// Each of its planes leaves out what is known beyond it.
TEST(Facets, AnOutcomeWithANotchIsNotComplete) {
  Setting run(2, [](const Point& x) { return x[0] < .55 || x[1] < .55; });
  FacetSearch search(run.support, run.asker, is_in);
  search.run({{run.support, {-1, -1}}}, 2000);
  EXPECT_FALSE(search.is_complete());
  EXPECT_TRUE(search.list_planes().empty());
}

TEST(Facets, NothingIsAskedWithTooFewRunsForAPlane) {
  const Polytope p{{{1, 1, 1}}, {1.1}};
  Setting run(3, [&p](const Point& x) { return p.contains(x); });
  const int before = run.asker.asked();
  FacetSearch search(run.support, run.asker, is_in);
  search.run({{run.support, {-1, 0, 0}}}, 100);
  EXPECT_EQ(run.asker.asked(), before);
  EXPECT_FALSE(search.is_complete());
}

TEST(Facets, OutputsAreFittedOverTheOutcomeAlone) {
  Setting run(2, [](const Point& x) { return x[0] > .5; });
  const auto fits = FacetSearch(run.support, run.asker, is_in).fit_outputs();
  ASSERT_EQ(fits.size(), 1u);
  EXPECT_NEAR(fits[0].slope[0], 1, 1e-12);
  EXPECT_NEAR(fits[0].slope[1], 1, 1e-12);
  EXPECT_NEAR(fits[0].at_zero, 0, 1e-12);
  EXPECT_LT(fits[0].largest_error, 1e-12);
  EXPECT_TRUE(FacetSearch(run.support, run.asker, [](const Result&) { return false; }).fit_outputs().empty());
}

}  // namespace
}  // namespace topple::uncertainty
