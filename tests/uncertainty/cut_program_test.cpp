#include "uncertainty/cut_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

HalfSpace make_half_space(std::vector<double> a, double b) {
  double square = 0;
  for (const double c : a) square += c * c;
  for (double& c : a) c /= std::sqrt(square);
  return {std::move(a), b / std::sqrt(square)};
}

TEST(CutProgram, MinimisesAtACornerOfHalfSpaces) {
  // max 3x + 2y, x + y <= 4, x + 3y <= 6, x <= 3: (3, 1)
  const Quadratic q{{-3, -2}, {0, 0, 0, 0}};
  const std::vector<HalfSpace> planes{make_half_space({1, 1}, 4), make_half_space({1, 3}, 6)};
  const auto v = minimise(q, planes, {0, 0}, {3, 10}, {0, 0});
  EXPECT_NEAR(v[0], 3, 1e-12);
  EXPECT_NEAR(v[1], 1, 1e-12);
}

TEST(CutProgram, MinimisesOnAnEdgeAndInside) {
  const Quadratic q{{-2, -5}, {2, 0, 0, 2}};  // (x - 1)² + (y - 2.5)²
  const std::vector<HalfSpace> planes{make_half_space({-1, 2}, 2), make_half_space({1, 2}, 6)};
  const auto v = minimise(q, planes, {0, 0}, {10, 10}, {2, 0});
  EXPECT_NEAR(v[0], 1.4, 1e-12);
  EXPECT_NEAR(v[1], 1.7, 1e-12);
  const auto free = minimise(q, {}, {0, 0}, {10, 10}, {2, 0});
  EXPECT_NEAR(free[0], 1, 1e-12);
  EXPECT_NEAR(free[1], 2.5, 1e-12);
}

// The conditions of Karush, Kuhn and Tucker on random programmes: no feasible way leads down.
TEST(CutProgram, NoWayLeadsDownFromWhereItEnds) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t n = 2 + trial % 4;
    Quadratic q{std::vector<double>(n), std::vector<double>(n * n, 0.0)};
    for (double& s : q.slope) s = random.next(-1, 1);
    for (std::size_t i = 0; i < n; ++i) q.hessian[i * n + i] = random.next(0.2, 2);
    std::vector<HalfSpace> planes;
    for (std::size_t j = 0; j < 2 * n; ++j) {
      std::vector<double> a(n);
      for (double& c : a) c = random.next(-1, 1);
      planes.push_back(make_half_space(std::move(a), random.next(0, 0.3)));
    }
    const std::vector<double> low(n, -1.0), high(n, 1.0);
    const auto v = minimise(q, planes, low, high, std::vector<double>(n, 0.0));
    const auto is_feasible = [&](const std::vector<double>& w) {
      return std::all_of(planes.begin(), planes.end(), [&](const HalfSpace& h) {
        double at = -h.b;
        for (std::size_t k = 0; k < n; ++k) at += h.a[k] * w[k];
        return at <= 1e-12;
      });
    };
    EXPECT_TRUE(is_feasible(v));
    for (int k = 0; k < 300; ++k) {
      std::vector<double> w = v;
      for (double& c : w) c = std::clamp(c + random.next(-0.1, 0.1), -1.0, 1.0);
      if (is_feasible(w)) { EXPECT_GE(q(w), q(v) - 1e-12); }
    }
  }
}

// 1 - max(|x - y + 3|/4, |y - z - 1|/3): cuts are what lies between two pairs of planes, in the box of the inputs.
double calc_joint(const Point& x) {
  return std::max(0.0, 1 - std::max(std::abs(x[0] - x[1] + 3) / 4, std::abs(x[1] - x[2] - 1) / 3));
}

const Space& get_space() {
  static const Space space{
      {make_triangular(0, 3, 10), make_triangular(0, 6, 10), make_triangular(0, 5, 10)}, {}, calc_joint};
  return space;
}

TEST(CutProgram, FindsEdgesAndCornersOfACut) {
  CutProgram cut(get_space(), 0.75, calc_scale(get_space()), {0, 1, 2});
  const Point base{3, 6, 5};
  // x as large as it can be: the end of its own cut; then y as small as that lets: x - y + 3 = 1
  const Quadratic q{{-1, 0.1, 0}, std::vector<double>(9, 0.0)};
  const Point x = cut.minimise_from(base, q, 1);
  EXPECT_NEAR(x[0], 4.75, 1e-8);
  EXPECT_NEAR(x[1], 6.75, 1e-8);
  EXPECT_TRUE(is_in_cut(get_space(), make_box(get_space(), 0.75), 0.75, x));
  // onto the edge x - y + 3 = 1, y - z - 1 = -0.75: (s - 2, s, s - 0.25), s the mean of 6.3, 6, 6.45
  const Point p = cut.project_from(base, {4.3, 6, 6.2}, 1);
  EXPECT_NEAR(p[1], (6.3 + 6 + 6.45) / 3, 1e-8);
  EXPECT_NEAR(p[0], p[1] - 2, 1e-8);
  EXPECT_NEAR(p[2], p[1] - 0.25, 1e-8);
}

// Products of hats vanish with their slopes at the edges of their support: |x + y|, |y - 0.5 z|, |z + 0.3 w| and
// |w - 0.2 x| at most 1, 1, 1 and 1.
TEST(CutProgram, LeavesACornerWhereAProductOfHatsVanishesWithItsSlopes) {
  const auto calc_parts = [](const Point& x) {
    return Point{x[0] + x[1], x[1] - 0.5 * x[2], x[2] + 0.3 * x[3], x[3] - 0.2 * x[0]};
  };
  for (const bool is_flat : {false, true}) {
    Space space;
    for (int i = 0; i < 4; ++i) space.inputs.push_back(make_triangular(-5, 0, 5));
    space.joint = [&](const Point& x) {
      double product = 1;
      for (const double s : calc_parts(x)) product *= std::max(0.0, 1 - std::abs(s)) * (is_flat ? 1 - s * s : 1);
      return product;
    };
    // parts (1, 1, 1, 1), but for a hair
    const Point corner = [&] {
      // y = 1 + z/2, x = 1 - y, w = 1 + x/5, z = 1 - 0.3 w
      const double z = (1 - 0.3) / (1 - 0.3 * 0.1), y = 1 + 0.5 * z, x = 1 - y;
      return Point{x, y, z, 1 + 0.2 * x};
    }();
    Point base = corner;
    for (double& c : base) c *= 1 - 1e-11;
    ASSERT_TRUE(is_in_cut(space, make_box(space, 0), 0, base));
    CutProgram cut(space, 0, calc_scale(space), {0, 1, 2, 3});
    const Point rows[] = {{1, 1, 0, 0}, {0, 1, -0.5, 0}, {0, 0, 1, 0.3}, {-0.2, 0, 0, 1}};
    for (int k = 0; k < 16; ++k) {
      // least where part j is 1 for the bits of k that are set, -1 for the others
      Quadratic q{std::vector<double>(4, 0.0), std::vector<double>(16, 0.0)};
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) q.slope[i] += (k >> j & 1 ? -1 : 1) * rows[j][i];
      const Point parts = calc_parts(cut.minimise_from(base, q, 1));
      for (int j = 0; j < 4; ++j) EXPECT_NEAR(parts[j], k >> j & 1 ? 1 : -1, 1e-7) << k << " " << j;
    }
  }
}

TEST(CutProgram, FindsTheMostPossiblePlaceOfAHalfSpace) {
  // x + y/2 - z >= 4: 26/41 with x + y + z <= 17, 11/17 without
  Space space = get_space();
  const Point base{6, 8, 6};
  const HalfSpace side = make_half_space({-1, -0.5, 1}, (6 + 4 - 6 - 4) / 10.0);
  const Point x = find_most_possible(space, calc_scale(space), {0, 1, 2}, base, 1, {side});
  EXPECT_NEAR(calc_membership(space, x), 11.0 / 17, 1e-6);
  EXPECT_GE(x[0] + 0.5 * x[1] - x[2], 4 - 1e-9);
  space.constraints.push_back([](const Point& p) { return p[0] + p[1] + p[2] - 17; });
  const Point y = find_most_possible(space, calc_scale(space), {0, 1, 2}, {5, 6, 4}, 1,
                                     {make_half_space({-1, -0.5, 1}, (5 + 3 - 4 - 4) / 10.0)});
  EXPECT_NEAR(calc_membership(space, y), 26.0 / 41, 1e-6);
  space.constraints.clear();
  space.joint = nullptr;
  const Point z = find_most_possible(space, calc_scale(space), {0, 1, 2}, base, 1, {side});
  EXPECT_NEAR(calc_membership(space, z), 11.0 / 14, 1e-6) << "3 + 7t + 3 + 2t - 5 + 5t = 4";
}

}  // namespace
}  // namespace topple::uncertainty
