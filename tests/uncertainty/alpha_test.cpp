#include "uncertainty/alpha.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "reference_cases.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

class AlphaReference : public testing::TestWithParam<std::uint64_t> {};

TEST_P(AlphaReference, BoundsAreExactWithFewEvaluations) {
  for (const auto& c : cases::make_all()) {
    AlphaOptions options;
    options.seed = GetParam();
    const AlphaResult r = optimise(c.inputs, c.model, options, {});
    EXPECT_LE(r.archive.size(), 10000u) << c.name;
    EXPECT_EQ(r.ending, Ending::Complete) << c.name;
    ASSERT_EQ(r.outputs.size(), c.outputs.size());
    for (std::size_t o = 0; o < c.outputs.size(); ++o) {
      const auto& want = c.outputs[o].at;
      // the reference numbers carry six decimals
      const double tolerance = c.tolerance * (want[0][1] - want[0][0]) + 6e-7;
      for (int k = 0; k < 4; ++k) {
        EXPECT_NEAR(r.outputs[o].levels[k].lower.value, want[k][0], tolerance) << c.name << " level " << k;
        EXPECT_NEAR(r.outputs[o].levels[k].upper.value, want[k][1], tolerance) << c.name << " level " << k;
        EXPECT_TRUE(r.outputs[o].levels[k].lower.converged) << c.name;
        EXPECT_TRUE(r.outputs[o].levels[k].upper.converged) << c.name;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AlphaReference, testing::Values(1, 2, 3, 4, 5, 6, 7, 8));

// Under a joint membership with kinks bounds lie on edges and at corners of the cuts.
TEST(InteractionReference, JointMembershipWithEdges) {
  const Space space{
      {make_triangular(0, 3, 10), make_triangular(0, 6, 10), make_triangular(0, 5, 10)}, {}, [](const Point& x) {
        return std::max(0.0, 1 - std::max(std::abs(x[0] - x[1] + 3) / 4, std::abs(x[1] - x[2] - 1) / 3));
      }};
  const Evaluate model = make_evaluate_values([](const Point& x) {
    return std::vector{x[0] * x[1] - x[2] * x[2], x[0] - x[1] + x[2]};
  });
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(space, model, options, {});
    EXPECT_EQ(r.ending, Ending::Complete);
    EXPECT_LT(r.archive.size(), 7000u);
    const LevelBounds& at = r.outputs[0].levels[3];
    EXPECT_NEAR(at.upper.value, 4.75 * 6.75 - 25, 1e-8) << "x - y + 3 = 1, y - z - 1 = 0.75, x = 4.75";
    // z - (y - x), of which y - x is 2 at least: with the end of z's cut
    EXPECT_NEAR(r.outputs[1].levels[3].upper.value, 6.25 - 2, 1e-8);
    EXPECT_TRUE(at.upper.converged);
  }
}

// The paper's equation (1) on its Table 1: full interaction keeps the tensile strength a function of f_c.
TEST(InteractionReference, TensileStrengthFollowsFromConcrete) {
  const Space space{{make_triangular(10, 25, 45)}, {}, {}};
  const Evaluate model = with_derived(space, {[](const Point& x) { return cases::calc_fct(x[0]); }},
                                      make_evaluate_values([](const Point& x) {
                                        return std::vector{x[1], x[0] / x[1]};
                                      }));
  const AlphaResult r = optimise(space, model, {}, {});
  const FuzzyNumber fct = make_number(r, 0);
  EXPECT_NEAR(fct.support().left, 0.478793, 6e-7);
  EXPECT_NEAR(fct.centre(), 1.994163, 6e-7);
  EXPECT_NEAR(fct.support().right, 3.349108, 6e-7);
  EXPECT_NEAR(fct.cut(0.5).left, 1.352936, 6e-7);
  EXPECT_NEAR(fct.cut(0.5).right, 2.714588, 6e-7);
  EXPECT_NEAR(r.outputs[1].levels[0].upper.value, 20.885841, 1e-5) << "not 93.99, which ignores the interaction";
}

TEST(Interaction, RefusesASupportOutsideTheFormula) {
  const Space space{{make_triangular(7, 25, 45)}, {}, {}};  // f_c below 8 N/mm² has no f_ct
  const auto model = make_evaluate_values([](const Point& x) { return std::vector{x[1]}; });
  EXPECT_THROW(with_derived(space, {[](const Point& x) { return cases::calc_fct(x[0]); }}, model), InputError);
}

TEST(Interaction, ConstraintCutsTheInputs) {
  // x + y on the disc of radius 1: ±√2; on the square it would be ±2
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const Space disc{{f, f}, {[](const Point& x) { return x[0] * x[0] + x[1] * x[1] - 1; }}, {}};
  const auto sum = make_evaluate_values([](const Point& x) { return std::vector{x[0] + x[1]}; });
  const AlphaResult r = optimise(disc, sum, {}, {});
  EXPECT_NEAR(r.outputs[0].levels[0].lower.value, -std::sqrt(2.0), 1e-4 * 2 * std::sqrt(2.0));
  EXPECT_NEAR(r.outputs[0].levels[0].upper.value, std::sqrt(2.0), 1e-4 * 2 * std::sqrt(2.0));
  EXPECT_NEAR(r.outputs[0].levels[2].upper.value, 1, 1e-6) << "at alpha 0.5 the corner (0.5, 0.5) lies in the disc";
  for (const auto& s : r.archive.samples()) EXPECT_LE(s.x[0] * s.x[0] + s.x[1] * s.x[1], 1);
}

TEST(InteractionReference, LinearProgrammesAreSolvedAlongTheirConstraints) {
  // Σ ±i x_i over triangles under three constraints, all of them active; bounds by a simplex method
  const FuzzyNumber f = make_triangular(-1, 0, 1.5);
  const Space space{{f, f, f, f, f, f},
                    {[](const Point& x) { return x[0] - x[1] + x[2] - x[3] + x[4] - x[5] - 1.2; },
                     [](const Point& x) { return x[0] + 2 * x[1] - x[4] - 1; },
                     [](const Point& x) { return x[2] + x[3] + 2 * x[5] - x[0] - 1.3; }},
                    {}};
  const auto model = make_evaluate_values(
      [](const Point& x) { return std::vector{x[0] - 2 * x[1] + 3 * x[2] - 4 * x[3] + 5 * x[4] - 6 * x[5]}; });
  const double expected[4][2] = {{-17.9, 14.1}, {-14.65, 11.475}, {-11.1, 8.85}, {-6.75, 5.65}};
  for (const std::uint64_t seed : {1, 2, 3}) {
    AlphaOptions o;
    o.seed = seed;
    const AlphaResult r = optimise(space, model, o, {});
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(r.outputs[0].levels[k].lower.value, expected[k][0], 1e-6 * 32) << seed << " " << k;
      EXPECT_NEAR(r.outputs[0].levels[k].upper.value, expected[k][1], 1e-6 * 32) << seed << " " << k;
    }
    EXPECT_LT(r.archive.size(), 6000U);
  }
}

TEST(Interaction, JointMembershipCutsTheInputs) {
  // a cone: the cut at alpha is a disc of radius 1 - alpha
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const Space cone{{f, f}, {}, [](const Point& x) { return 1 - std::hypot(x[0], x[1]); }};
  const auto sum = make_evaluate_values([](const Point& x) { return std::vector{x[0] + x[1]}; });
  const AlphaResult r = optimise(cone, sum, {}, {});
  for (const auto& level : r.outputs[0].levels)
    EXPECT_NEAR(level.upper.value, std::sqrt(2.0) * (1 - level.alpha), 1e-4 * 2 * std::sqrt(2.0)) << level.alpha;
}

TEST(Interaction, WhatIsImpossibleIsNotInTheSupport) {
  // the same cone, cut off at 0 as memberships are: the support is the disc and not the square
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const Space cone{{f, f}, {}, [](const Point& x) { return std::max(0.0, 1 - std::hypot(x[0], x[1])); }};
  EXPECT_FALSE(is_in_cut(cone, make_box(cone, 0), 0, {0.9, 0.9}));
  EXPECT_TRUE(is_in_cut(cone, make_box(cone, 0), 0, {0.7, 0.7}));
  const auto sum = make_evaluate_values([](const Point& x) { return std::vector{x[0] + x[1]}; });
  const AlphaResult r = optimise(cone, sum, {}, {});
  EXPECT_NEAR(r.outputs[0].levels[0].upper.value, std::sqrt(2.0), 1e-4 * 2 * std::sqrt(2.0));
  EXPECT_NEAR(r.outputs[0].levels[0].lower.value, -std::sqrt(2.0), 1e-4 * 2 * std::sqrt(2.0));
  for (const auto& s : r.archive.samples()) EXPECT_LT(std::hypot(s.x[0], s.x[1]), 1);
}

TEST(Interaction, RefusesACentreThatIsImpossible) {
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const auto model = make_evaluate_values([](const Point& x) { return x; });
  EXPECT_THROW(optimise(Space{{f}, {[](const Point&) { return 1.0; }}, {}}, model, {}, {}), InputError);
  EXPECT_THROW(optimise(Space{{f}, {}, [](const Point&) { return 0.5; }}, model, {}, {}), InputError);
  EXPECT_THROW(optimise(Space{}, model, {}, {}), InputError);
}

TEST(Alpha, CutsAreNested) {
  const cases::Case c = cases::make_all()[2];
  AlphaOptions options;
  options.levels = {0.1, 0.9, 0.35, 0.35};
  options.limit = 700;  // too few: nested all the same
  const AlphaResult r = optimise(c.inputs, c.model, options, {});
  EXPECT_EQ(r.ending, Ending::LimitReached);
  EXPECT_EQ(r.archive.size(), 700u);
  ASSERT_EQ(r.outputs[0].levels.size(), 5u) << "0 and 1 are added, doubles are dropped";
  EXPECT_NO_THROW(make_number(r, 0));
}

TEST(Alpha, CountsFailedRunsAndKeepsThemOutOfNumbers) {
  const FuzzyNumber f = make_triangular(0, 1, 2);
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.values = {x[0] + x[1]};
    if (x[0] > 1.5) r.state = Result::State::Failed, r.text = "did not converge";
    if (x[1] < 0.25) r.values[0] = std::numeric_limits<double>::quiet_NaN();
    return r;
  });
  const AlphaResult r = optimise({f, f}, model, {}, {});
  int failed = 0;
  for (const auto& s : r.archive.samples()) {
    const bool bad = s.x[0] > 1.5 || s.x[1] < 0.25;
    EXPECT_EQ(s.result.state == Result::State::Failed, bad);
    if (bad) { EXPECT_FALSE(s.result.text.empty()); }
    failed += bad;
  }
  EXPECT_GT(failed, 0);
  EXPECT_EQ(r.failed, failed);
  ASSERT_EQ(r.classes.size(), 2u);
  EXPECT_EQ(r.classes[0].outcome, failed_outcome);
  EXPECT_EQ(r.classes[0].count, failed);
  EXPECT_EQ(r.classes[0].count + r.classes[1].count, static_cast<int>(r.archive.size()));
  // the least sum that runs: x = 0, y at the edge 0.25; the largest: x at the edge 1.5, y = 2
  EXPECT_NEAR(r.outputs[0].levels[0].lower.value, 0.25, 1e-4 * 4);
  EXPECT_NEAR(r.outputs[0].levels[0].upper.value, 3.5, 1e-4 * 4);
}

TEST(Alpha, SaysWhenNothingRan) {
  const Evaluate model = make_evaluate([](const Point&) {
    Result r;
    r.state = Result::State::Failed;
    return r;
  });
  const AlphaResult r = optimise({make_triangular(0, 1, 2)}, model, {}, {});
  EXPECT_EQ(r.failed, static_cast<int>(r.archive.size()));
  EXPECT_TRUE(r.outputs.empty());
  EXPECT_THROW(make_number(r, 0), InputError);
}

TEST(Alpha, FindsAnIslandOfHalfAPerCent) {
  // a plain slope; inside a ball of 0.5 % of the volume a class of its own with a far larger value
  const FuzzyNumber f = make_triangular(-1, 0.1, 1);
  const double radius = std::cbrt(0.005 * 8 * 3 / (4 * cases::pi));
  const Point at = {-0.55, 0.4, -0.3};
  const Evaluate model = make_evaluate([&](const Point& x) {
    double d2 = 0;
    for (int i = 0; i < 3; ++i) d2 += (x[i] - at[i]) * (x[i] - at[i]);
    Result r;
    r.state = Result::State::Done;
    const bool inside = d2 < radius * radius;
    r.outcome = inside ? 1 : 0;
    r.values = {inside ? 10 - d2 : x[0]};
    return r;
  });
  AlphaOptions options;
  // missed with a probability of 1 % at most: N = ln 0.01 / ln 0.995
  options.space_points = 919;
  for (options.seed = 1; options.seed <= 10; ++options.seed) {
    const AlphaResult r = optimise({f, f, f}, model, options, {});
    EXPECT_LE(calc_miss_probability(r.coverage[0], 0.005), 0.01);
    ASSERT_EQ(r.classes.size(), 2u) << "seed " << options.seed;
    EXPECT_NEAR(r.outputs[0].levels[0].upper.value, 10, 1e-4 * 11) << "seed " << options.seed;
    EXPECT_NEAR(r.outputs[0].levels[0].lower.value, -1, 1e-12);
  }
}

TEST(Alpha, KeepsOneNumberForEachClass) {
  const AlphaResult r = optimise(cases::make_jump_inputs(), make_evaluate(cases::calc_jump), {}, {});
  ASSERT_EQ(r.classes.size(), 2u);
  const auto& stands = r.classes[0].outputs[0].levels[0];
  const auto& jumped = r.classes[1].outputs[0].levels[0];
  const double width = 31.6 + 14.64;
  EXPECT_NEAR(stands.lower.value, 0, 1e-3 * width) << "an inner estimate: nothing beyond the jump counts";
  EXPECT_GE(stands.lower.value, 0);
  EXPECT_NEAR(stands.upper.value, 31.6, 1e-12);
  EXPECT_NEAR(jumped.lower.value, -14.64, 1e-12);
  EXPECT_NEAR(jumped.upper.value, -10, 1e-3 * width);
  EXPECT_LT(jumped.upper.value, -10);
}

// Extremes that lie where another outcome begins, inside the cut: on a plane and on a sphere, in closed form.
TEST(AlphaPhysics, BoundsAtAJumpAreSharp) {
  const auto with_jump = [](auto f, auto beyond) {
    return make_evaluate([=](const Point& x) {
      Result r;
      r.state = Result::State::Done;
      r.outcome = beyond(x) > 0 ? 1 : 0;
      r.values = {f(x) - 5 * r.outcome};
      return r;
    });
  };
  const auto plane = with_jump(
      [](const Point& x) {
        double s = 0;
        for (const double v : x) s -= (v - 0.7) * (v - 0.7);
        return s;
      },
      [](const Point& x) { return x[0] + x[1] + x[2] + x[3] + x[4] - 2; });
  const auto sphere = with_jump([](const Point& x) { return x[0] + 0.5 * x[1] + 0.2 * x[2]; },
                                [](const Point& x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 0.5; });
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    for (const bool thrifty : {false, true}) {
      AlphaOptions options = thrifty ? make_thrifty_options() : AlphaOptions{};
      options.seed = seed;
      const FuzzyNumber f = make_triangular(0, 0.3, 1);
      const AlphaResult a = optimise(std::vector<FuzzyNumber>(5, f), plane, options, {});
      const auto& wide = a.outputs[0].levels[0];
      EXPECT_NEAR(wide.upper.value, -0.45, 1e-4 * (wide.upper.value - wide.lower.value)) << "at (0.4 ... 0.4)";
      const AlphaResult b = optimise(std::vector<FuzzyNumber>(3, f), sphere, options, {});
      EXPECT_NEAR(b.outputs[0].levels[0].upper.value, std::sqrt(0.5 * 1.29), 1e-4 * 5);
      EXPECT_LE(a.archive.size(), 10000u);
    }
}

// ---- several hills and kinks

double calc_hills(const Point& x) {
  constexpr double hills[][6] = {
      {.2, .3, .8, .6, 1.0, 9}, {.8, .7, .2, .3, 1.1, 14}, {.5, .9, .9, .1, .9, 7}, {.1, .1, .3, .9, 1.15, 25}};
  double sum = 0;
  for (const auto& h : hills) {
    double square = 0;
    for (int i = 0; i < 4; ++i) square += (x[i] - h[i]) * (x[i] - h[i]);
    sum += h[4] * std::exp(-h[5] * square);
  }
  return sum;
}

TEST(AlphaPhysics, AHillAtTheRimOfACutIsFound) {
  // by 600 evolution searches a cut
  const double want = 1.136999;
  const FuzzyNumber f = make_triangular(0, .5, 1);
  const auto model = make_evaluate_values([](const Point& x) { return std::vector{calc_hills(x)}; });
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(std::vector<FuzzyNumber>(4, f), model, options, {});
    EXPECT_NEAR(r.outputs[0].levels[1].upper.value, want, 2e-6) << seed;
    EXPECT_LE(r.archive.size(), 10000u);
  }
}

TEST(AlphaPhysics, EveryHillIsLookedFor) {
  // a narrow hill whose height is known stands among broad ones, which hide it from starts at the best samples
  for (const int n : {3, 4, 5})
    for (const std::uint64_t seed : {1, 2, 3}) {
      Random random(10 * seed + n);
      Point narrow;
      std::vector<Point> broad(3);
      for (int i = 0; i < n; ++i) narrow.push_back(random.next(.2, .3) + (random.next() < .5 ? .5 : 0));
      for (Point& p : broad)
        for (int i = 0; i < n; ++i) p.push_back(random.next(.1, .9));
      const auto calc = [&](const Point& x) {
        const auto square = [&x](const Point& p) {
          double sum = 0;
          for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - p[i]) * (x[i] - p[i]);
          return sum;
        };
        double most = 0;
        for (const Point& p : broad) most = std::max(most, std::exp(-5 * square(p)));
        return std::max(most, 1.2 * std::exp(-20 * square(narrow)));
      };
      AlphaOptions options;
      options.seed = seed;
      const AlphaResult r =
          optimise(std::vector<FuzzyNumber>(n, make_triangular(0, .5, 1)),
                   make_evaluate_values([&](const Point& x) { return std::vector{calc(x)}; }), options, {});
      EXPECT_NEAR(r.outputs[0].levels[0].upper.value, 1.2, 1e-4) << n << " inputs, seed " << seed;
      EXPECT_LE(r.archive.size(), 10000u);
    }
}

TEST(AlphaPhysics, EnvelopesOfPlanesAreExact) {
  // max_j |c_j·(x - p)| + d·x has its least value at p, if the c_j hold d in their hull
  for (const int n : {3, 4, 6})
    for (const std::uint64_t seed : {1, 2, 3}) {
      Random random(10 * seed + n);
      std::vector<Point> slopes(n);
      Point p;
      for (int i = 0; i < n; ++i) p.push_back(random.next(-.4, .4));
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) slopes[j].push_back((i == j ? 1 : 0) + random.next(-.4, .4));
      const auto calc = [&](const Point& x) {
        double sum = 0, most = 0;
        for (int j = 0; j < n; ++j) {
          double t = 0;
          for (int i = 0; i < n; ++i) t += slopes[j][i] * (x[i] - p[i]);
          most = std::max(most, std::abs(t)), sum += t / (2 * n);
        }
        return most + sum;
      };
      AlphaOptions options;
      options.seed = seed;
      const AlphaResult r =
          optimise(std::vector<FuzzyNumber>(n, make_triangular(-1, .1, 1)),
                   make_evaluate_values([&](const Point& x) { return std::vector{calc(x)}; }), options, {});
      const auto& wide = r.outputs[0].levels[0];
      EXPECT_NEAR(wide.lower.value, 0, 1e-5 * (wide.upper.value - wide.lower.value)) << n << " inputs, seed " << seed;
      EXPECT_LE(r.archive.size(), 10000u);
    }
}

TEST(AlphaPhysics, EdgesThatCrossAreFollowedToTheirEnd) {
  // y = a where both edges meet: a = bc, b = .2 - ca, largest at c of the cut's end or where b is
  const auto calc = [](const Point& x) {
    return -8 * std::abs(x[0] - x[1] * x[2]) - 5 * std::abs(x[1] + x[2] * x[0] - .2) + x[0];
  };
  const FuzzyNumber f = make_triangular(-1, .3, 1);
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r =
        optimise({f, f, f}, make_evaluate_values([&](const Point& x) { return std::vector{calc(x)}; }), options, {});
    const double width = r.outputs[0].levels[0].upper.value - r.outputs[0].levels[0].lower.value;
    for (int k = 0; k < 4; ++k) {
      // on the edges a = .2 c/(1 + c²)
      const double c = f.cut(r.outputs[0].levels[k].alpha).right;
      EXPECT_NEAR(r.outputs[0].levels[k].upper.value, .2 * c / (1 + c * c), 1e-4 * width) << seed << " level " << k;
    }
  }
}

TEST(AlphaPhysics, CuspsCountByTheValue) {
  const auto model = make_evaluate_values([](const Point& x) {
    return std::vector{std::sqrt(std::abs(x[0] - .3 * x[1])) + std::sqrt(std::abs(x[1] + .2))};
  });
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise({make_triangular(-1, .3, 1), make_triangular(-1, .4, 1)}, model, options, {});
    const auto& wide = r.outputs[0].levels[0];
    EXPECT_NEAR(wide.lower.value, 0, 1e-4 * (wide.upper.value - wide.lower.value)) << seed;
  }
}

// A sum and a product of functions of one input each, with a kink and several hills: the bounds are those of the
// functions, taken together.
TEST(AlphaPhysics, InputsThatActAloneAreExactOrMarked) {
  using Function = std::function<double(double)>;
  const std::vector<Function> functions = {[](double x) { return (x - .37) * (x - .37); },
                                           [](double x) { return std::sin(5 * x); },
                                           [](double x) { return std::abs(x - .61); },
                                           [](double x) { return x * x * x - x; },
                                           [](double x) { return std::exp(-40 * (x - .2) * (x - .2)); },
                                           [](double x) { return std::cos(7 * x + 1); }};
  // where their extremes lie, whatever the cut; others are at its ends
  const std::vector<std::vector<double>> extremes = {
      {.37}, {std::acos(0.0) / 5, 3 * std::acos(0.0) / 5, std::acos(0.0)},
      {.61}, {-1 / std::sqrt(3.0), 1 / std::sqrt(3.0)},
      {.2},  {}};
  std::vector<double> waves;
  for (int k = -3; k < 6; ++k) waves.push_back((2 * k * std::acos(0.0) - 1) / 7);
  const std::vector<FuzzyNumber> inputs = {make_triangular(-1, .1, 1.5), make_triangular(0, .4, 2),
                                           make_triangular(-.5, .5, 1),  make_triangular(-1, 0, 1.2),
                                           make_triangular(-1, .5, 1),   make_triangular(-1, -.2, 2)};
  const auto model = make_evaluate_values([&](const Point& x) {
    double sum = 0, product = 1;
    for (std::size_t i = 0; i < x.size(); ++i) sum += functions[i](x[i]), product *= 2 + functions[i](x[i]);
    return std::vector{sum, product};
  });
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(inputs, model, options, {});
    EXPECT_LE(r.archive.size(), 10000u);
    int marked = 0;
    for (int o = 0; o < 2; ++o)
      for (const LevelBounds& l : r.outputs[o].levels) {
        double lower = o, upper = o;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
          const AlphaCut cut = inputs[i].cut(l.alpha);
          double least = functions[i](cut.left), most = least;
          std::vector<double> places = i == 5 ? waves : extremes[i];
          places.push_back(cut.right);
          for (const double at : places)
            if (at >= cut.left && at <= cut.right)
              least = std::min(least, functions[i](at)), most = std::max(most, functions[i](at));
          lower = o == 0 ? lower + least : lower * (2 + least);
          upper = o == 0 ? upper + most : upper * (2 + most);
        }
        const double width = r.outputs[o].levels[0].upper.value - r.outputs[o].levels[0].lower.value;
        EXPECT_NEAR(l.lower.value, lower, 1e-4 * width) << "output " << o << ", alpha " << l.alpha << ", seed " << seed;
        EXPECT_NEAR(l.upper.value, upper, 1e-4 * width) << "output " << o << ", alpha " << l.alpha << ", seed " << seed;
        marked += !l.lower.converged + !l.upper.converged;
      }
    EXPECT_LE(marked, 8) << "of 20, seed " << seed;
  }
}

// The least value lies where runs begin to fail and values fall as a root does: near it is not at it.
TEST(AlphaPhysics, BoundsBesideASteepWallAreMarked) {
  const Evaluate model = [](std::span<const Point> points, std::span<Result> out) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = points[i][0], y = points[i][1], d = x * x - y + .7;
      out[i].state = d < 0 ? Result::State::Failed : Result::State::Done;
      if (d >= 0) out[i].values = {std::sqrt(d) - .2 * y};
    }
  };
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise({make_triangular(0, .6, 2), make_triangular(0, 1.6, 2)}, model, options, {});
    for (const LevelBounds& l : r.outputs[0].levels) {
      if (l.alpha == 1) continue;  // the core fails
      // on the wall, at the upper end of one of the inputs
      const double right = 2 - 1.4 * l.alpha, least = -.2 * std::min(2 - .4 * l.alpha, right * right + .7);
      const double most = std::sqrt(right * right - 1.6 * l.alpha + .7) - .32 * l.alpha;
      EXPECT_FALSE(l.lower.converged) << "seed " << seed;
      EXPECT_GE(l.lower.value, least - 1e-9);
      EXPECT_LE(l.lower.value, least + .03);
      EXPECT_TRUE(l.upper.converged) << "seed " << seed;
      EXPECT_NEAR(l.upper.value, most, 1e-6);
    }
  }
}

// The same within an outcome. The other one lies lower, so that bounds over all runs do not lead there.
TEST(AlphaPhysics, BoundsOfAnOutcomeBesideASteepWallAreMarked) {
  const Evaluate model = [](std::span<const Point> points, std::span<Result> out) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double a = points[i][0], b = points[i][1], d = .8 - a * a - (b - .5) * (b - .5);
      out[i].outcome = b > .1 ? 0 : 1;
      out[i].state = b > .1 && d < 0 ? Result::State::Failed : Result::State::Done;
      if (b <= .1 || d >= 0) out[i].values = {b > .1 ? std::sqrt(d) + .4 * a : -3 - a - b};
    }
  };
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    options.search_classes = true;
    const AlphaResult r = optimise({make_triangular(-1, 0, 1), make_triangular(-1, .2, 1)}, model, options, {});
    const auto up = std::ranges::find(r.classes, 0, &ClassBounds::outcome);
    ASSERT_NE(up, r.classes.end());
    const LevelBounds& support = up->outputs[0].levels[0];
    const double least = -.4 * std::sqrt(.8), most = std::sqrt(1.16 * .8);  // on the wall, and where slopes vanish
    EXPECT_FALSE(support.lower.converged) << "seed " << seed;
    EXPECT_GE(support.lower.value, least - 1e-9);
    EXPECT_LE(support.lower.value, least + .05) << "seed " << seed;
    EXPECT_TRUE(support.upper.converged) << "seed " << seed;
    EXPECT_NEAR(support.upper.value, most, 1e-6);
  }
}

// At alpha = 1 plateaus vary and points do not, so planes of jumps and of outcomes are found in other spaces there.
TEST(AlphaPhysics, CoresOfBothKindsBesideJumps) {
  const std::vector<FuzzyNumber> inputs = {make_triangular(0, .45, 1), make_trapezoidal(0, .3, .7, 1),
                                           make_triangular(0, .55, 1), make_trapezoidal(0, .2, .6, 1)};
  for (const bool has_names : {false, true}) {
    const Evaluate model = [has_names](std::span<const Point> points, std::span<Result> out) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Point& x = points[i];
        const bool first = .5 * x[0] + .7 * x[1] - .4 * x[2] + .3 * x[3] > .55,
                   second = x[3] - .6 * x[1] + .2 * x[0] > .3;
        out[i].state = Result::State::Done;
        out[i].outcome = has_names ? first + 2 * second : 0;
        out[i].values = {x[0] - .8 * x[1] + .6 * x[2] + .3 * x[3] + (first ? 1.2 : 0) - (second ? .9 : 0)};
      }
    };
    const AlphaResult r = optimise(inputs, model, {}, {});
    // at alpha = 1: x0 = .45 and x2 = .55; the first jump at 14 x1 + 6 x3 = 10.9, the second one at x3 = .21 + .6 x1
    const LevelBounds &core = r.outputs[0].levels.back(), &support = r.outputs[0].levels.front();
    const double close = 1e-4 * (support.upper.value - support.lower.value);
    EXPECT_NEAR(core.upper.value, 1.7034091, close) << has_names;
    EXPECT_NEAR(core.lower.value, -.3965909, close) << has_names;
  }
}

// Some 400 hills whose heights differ by little, narrower than what lies between spread runs; the bounds are those of
// a grid of 4,000 x 4,000, refined.
TEST(AlphaPhysics, HillsNarrowerThanSpreadRunsAreFound) {
  const auto model = make_evaluate_values([](const Point& x) {
    return std::vector{std::sin(3 * x[0] + 2 * x[1] * x[1]) * std::cos(4 * x[1] - x[0]) + 0.05 * x[0]};
  });
  const std::vector<FuzzyNumber> inputs = {make_triangular(-4, -0.9, 4), make_triangular(-4, 0.7, 4)};
  const std::vector<std::pair<double, double>> bounds = {{-1.1881244119, 1.1970693358},
                                                         {-1.1597222557, 1.1378644174},
                                                         {-1.0932641616, 1.0728122765},
                                                         {-1.0832257046, 0.9626184660}};
  int off = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(inputs, model, options, {});
    for (std::size_t k = 0; k < bounds.size(); ++k) {
      const LevelBounds& l = r.outputs[0].levels[k];
      EXPECT_GE(l.lower.value, bounds[k].first - 1e-9);
      EXPECT_LE(l.upper.value, bounds[k].second + 1e-9);
      off += l.lower.value > bounds[k].first + 2.4e-4;
      off += l.upper.value < bounds[k].second - 2.4e-4;
    }
  }
  EXPECT_LE(off, 16) << "of 64 bounds";
}

// ---- more inputs than all corners are run of

struct Ends {
  double lower, upper;
};

/// Bounds at alpha 0, 0.25, 0.5, 0.75 to 1e-6 of the support's width.
void expect_bounds(const AlphaResult& r, const std::vector<Ends>& want, const std::string& name) {
  const double tolerance = 1e-6 * (want[0].upper - want[0].lower);
  EXPECT_LE(r.archive.size(), 10000u) << name;
  for (std::size_t k = 0; k < want.size(); ++k) {
    EXPECT_NEAR(r.outputs[0].levels[k].lower.value, want[k].lower, tolerance) << name << " level " << k;
    EXPECT_NEAR(r.outputs[0].levels[k].upper.value, want[k].upper, tolerance) << name << " level " << k;
  }
}

std::vector<Ends> calc_ends(const FuzzyNumber& f, const std::function<Ends(double, double)>& of_cut) {
  std::vector<Ends> all;
  for (const double alpha : {0.0, 0.25, 0.5, 0.75}) all.push_back(of_cut(f.cut(alpha).left, f.cut(alpha).right));
  return all;
}

double calc_chain(const Point& x) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) sum += (i % 2 == 0 ? 1 : -1) * x[i] * x[i + 1];
  return sum;
}

/// Multilinear, so its extremes lie in corners: from one end of the chain to the other.
Ends calc_chain_ends(int n, double low, double high) {
  const auto calc_largest = [&](double sign) {
    double at_low = 0, at_high = 0;
    for (int i = 0; i + 1 < n; ++i) {
      const double c = sign * (i % 2 == 0 ? 1 : -1);
      const double to_low = std::max(at_low + c * low * low, at_high + c * high * low);
      at_high = std::max(at_low + c * low * high, at_high + c * high * high);
      at_low = to_low;
    }
    return std::max(at_low, at_high);
  };
  return {-calc_largest(-1), calc_largest(1)};
}

// Of three groups each has several basins: a search over all inputs at once ends in one of as many as their product.
TEST(AlphaGroups, SumsOfFunctionsOfAFewInputsAreExact) {
  std::vector<FuzzyNumber> inputs;
  for (int i = 0; i < 8; ++i) inputs.push_back(make_triangular(-1, -0.2 + 0.04 * i, 1));
  const Evaluate model = make_evaluate_values([](const Point& x) {
    return std::vector{std::cos(4 * x[0] - x[1] * x[1]) * x[2] + std::cos(3 * x[3] + x[4]) * x[5] + x[6] * x[7]};
  });
  for (const std::uint64_t seed : {1, 2}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(inputs, model, options, {});
    const auto& at = r.outputs[0].levels;
    EXPECT_NEAR(at[0].lower.value, -3, 1e-6);
    EXPECT_NEAR(at[0].upper.value, 3, 1e-6);
    EXPECT_NEAR(at[1].lower.value, -0.78 - 0.75 - 0.74 * 0.77, 1e-6);
    EXPECT_NEAR(at[1].upper.value, 0.78 + 0.75 + 0.76 * 0.77, 1e-6);
    EXPECT_NEAR(at[2].lower.value, -0.56 - 0.5 - 0.48 * 0.54, 1e-6);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(at[k].lower.converged) << k;
  }
}

TEST(AlphaGroups, AreFoundWhereCornersTellOfNone) {
  // cos(3 x) y is the same at both ends of x
  std::vector<FuzzyNumber> inputs;
  for (int i = 0; i < 8; ++i) inputs.push_back(make_triangular(-1, -0.3 + 0.07 * i, 1));
  AlphaOptions options;
  options.levels = {0, 1};
  const AlphaResult r = optimise(inputs, make_evaluate_values([](const Point& x) {
                                   double sum = 0;
                                   for (std::size_t i = 0; i < 8; i += 2) sum += std::cos(3 * x[i]) * x[i + 1];
                                   return std::vector{sum};
                                 }),
                                 options, {});
  EXPECT_NEAR(r.outputs[0].levels[0].lower.value, -4, 1e-6);
  EXPECT_NEAR(r.outputs[0].levels[0].upper.value, 4, 1e-6);
}

TEST(AlphaManyInputs, AlternatingChainIsExact) {
  const FuzzyNumber f = make_triangular(-1, .3, 2);
  const auto model = make_evaluate_values([](const Point& x) { return std::vector{calc_chain(x)}; });
  for (const int n : {9, 10, 12, 15})
    for (const std::uint64_t seed : {1, 2, 3}) {
      AlphaOptions options;
      options.seed = seed;
      const auto want = calc_ends(f, [n](double low, double high) { return calc_chain_ends(n, low, high); });
      expect_bounds(optimise(std::vector<FuzzyNumber>(n, f), model, options, {}), want,
                    std::to_string(n) + " inputs, seed " + std::to_string(seed));
    }
}

TEST(AlphaManyInputs, SumsOfQuarticsAreExact) {
  // Styblinski and Tang: two valleys an input, the largest value at the upper ends
  const FuzzyNumber f = make_triangular(-5, .5, 5);
  const auto calc = [](double x) { return 0.5 * (x * x * x * x - 16 * x * x + 5 * x); };
  const auto model = make_evaluate_values([&](const Point& x) {
    double sum = 0;
    for (const double v : x) sum += calc(v);
    return std::vector{sum};
  });
  for (const int n : {10, 12})
    for (const std::uint64_t seed : {1, 2, 3}) {
      AlphaOptions options;
      options.seed = seed;
      const auto want = calc_ends(f, [&](double low, double high) {
        Ends e{std::min(calc(low), calc(high)), std::max(calc(low), calc(high))};
        for (const double at : {-2.903534027771177, 0.15673125637247, 2.746802771398705})
          if (at > low && at < high) e = {std::min(e.lower, calc(at)), std::max(e.upper, calc(at))};
        return Ends{n * e.lower, n * e.upper};
      });
      expect_bounds(optimise(std::vector<FuzzyNumber>(n, f), model, options, {}), want,
                    std::to_string(n) + " inputs, seed " + std::to_string(seed));
    }
}

TEST(AlphaManyInputs, RandomBilinearFormsAreExact) {
  const FuzzyNumber f = make_triangular(-1, .1, 1.5);
  for (const int n : {9, 10, 13})
    for (const std::uint64_t seed : {1, 2, 3}) {
      Random random(100 * seed + n);
      std::vector<double> c(n * n + n);
      for (double& v : c) v = random.next(-1, 1);
      const auto calc = [&](const Point& x) {
        double sum = 0;
        for (int i = 0; i < n; ++i) {
          sum += c[n * n + i] * x[i];
          for (int j = 0; j < i; ++j) sum += c[i * n + j] * x[i] * x[j];
        }
        return sum;
      };
      const auto want = calc_ends(f, [&](double low, double high) {
        Ends e{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
        for (const Point& x : make_corners(Box{Point(n, low), Point(n, high)}))
          e = {std::min(e.lower, calc(x)), std::max(e.upper, calc(x))};
        return e;
      });
      AlphaOptions options;
      options.seed = seed;
      const AlphaResult r =
          optimise(std::vector<FuzzyNumber>(n, f),
                   make_evaluate_values([&](const Point& x) { return std::vector{calc(x)}; }), options, {});
      expect_bounds(r, want, std::to_string(n) + " inputs, seed " + std::to_string(seed));
      EXPECT_EQ(r.ending, Ending::Complete);
      EXPECT_GT(r.restarts, 0);
      for (int k = 0; k < 4; ++k)
        EXPECT_TRUE(r.outputs[0].levels[k].lower.converged && r.outputs[0].levels[k].upper.converged);
    }
}

TEST(AlphaManyInputs, DoNotClaimWhatRestartsHaveNotConfirmed) {
  // many valleys that bear on each other, and few runs
  const FuzzyNumber f = make_triangular(-1, .1, 1.5);
  const auto model = make_evaluate_values([](const Point& x) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      sum += std::sin(3 * x[i] + static_cast<double>(i)) + .3 * x[i] * x[(i + 1) % x.size()];
    return std::vector{sum};
  });
  AlphaOptions options;
  options.limit = 4000;
  const AlphaResult r = optimise(std::vector<FuzzyNumber>(10, f), model, options, {});
  EXPECT_EQ(r.archive.size(), 4000u);
  EXPECT_EQ(r.ending, Ending::LimitReached);
  EXPECT_FALSE(r.outputs[0].levels[0].lower.converged);
}

TEST(AlphaManyInputs, KeepToInteraction) {
  // the sum over a ball that the corners stick out of
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const int n = 10;
  const Space ball{std::vector<FuzzyNumber>(n, f),
                   {[](const Point& x) {
                     double sum = -4;
                     for (const double v : x) sum += v * v;
                     return sum;
                   }},
                   {}};
  const auto model = make_evaluate_values([](const Point& x) {
    double sum = 0;
    for (const double v : x) sum += v;
    return std::vector{sum};
  });
  const AlphaResult r = optimise(ball, model, {}, {});
  const double radius = std::sqrt(4.0 * n);
  EXPECT_NEAR(r.outputs[0].levels[0].upper.value, radius, 1e-4 * 2 * radius);
  EXPECT_NEAR(r.outputs[0].levels[0].lower.value, -radius, 1e-4 * 2 * radius);
  EXPECT_NEAR(r.outputs[0].levels[2].upper.value, 5, 1e-6) << "at alpha 0.5 the corner lies in the ball";
  for (const auto& s : r.archive.samples()) EXPECT_TRUE(is_allowed(ball, s.x));
}

TEST(Alpha, LeavesSomeOfASmallLimitForTheSearches) {
  const cases::Case c = cases::make_all()[3];
  AlphaOptions options;
  options.limit = 400;
  const AlphaResult r = optimise(c.inputs, c.model, options, {});
  EXPECT_EQ(r.archive.size(), 400u);
  EXPECT_GT(r.searches, 0);
  EXPECT_LE(r.coverage[0].space_points, 140);
}

TEST(Alpha, SearchesAllOutputsInOneArchive) {
  const cases::Case c = cases::make_all()[5];
  const AlphaResult both = optimise(c.inputs, c.model, {}, {});
  const auto first =
      make_evaluate_values([](const Point& x) { return std::vector{std::exp(-x[0] * 1.7) * std::cos(x[1] * 1.7)}; });
  const auto second =
      make_evaluate_values([](const Point& x) { return std::vector{std::exp(-x[0] * 4) * std::cos(x[1] * 4)}; });
  const auto alone =
      optimise(c.inputs, first, {}, {}).archive.size() + optimise(c.inputs, second, {}, {}).archive.size();
  EXPECT_LT(both.archive.size(), alone);
}

TEST(Alpha, BatchesAreWide) {
  const cases::Case c = cases::make_all()[2];
  const AlphaResult r = optimise(c.inputs, c.model, {}, {});
  EXPECT_GE(static_cast<double>(r.run) / r.batches, 32) << "points a call of the model";
}

TEST(Alpha, RefusesBadLevelsAndOutputs) {
  const auto model = make_evaluate_values([](const Point& x) { return x; });
  AlphaOptions options;
  options.levels = {0, 1.5};
  EXPECT_THROW(optimise({make_triangular(0, 1, 2)}, model, options, {}), InputError);
  const auto changing = make_evaluate_values([](const Point& x) { return std::vector<double>(x[0] > 1 ? 2 : 1, 0.0); });
  EXPECT_THROW(optimise({make_triangular(0, 1, 2)}, changing, {}, {}), InputError);
}

// ---- the same bits

void expect_same(const AlphaResult& a, const AlphaResult& b) {
  ASSERT_EQ(a.archive.size(), b.archive.size());
  for (int i = 0; i < static_cast<int>(a.archive.size()); ++i) {
    ASSERT_EQ(a.archive[i].x, b.archive[i].x) << i;
    ASSERT_EQ(a.archive[i].result.values, b.archive[i].result.values) << i;
  }
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (std::size_t o = 0; o < a.outputs.size(); ++o)
    for (std::size_t k = 0; k < a.outputs[o].levels.size(); ++k) {
      EXPECT_EQ(a.outputs[o].levels[k].lower.value, b.outputs[o].levels[k].lower.value);
      EXPECT_EQ(a.outputs[o].levels[k].upper.value, b.outputs[o].levels[k].upper.value);
      EXPECT_EQ(a.outputs[o].levels[k].lower.converged, b.outputs[o].levels[k].lower.converged);
    }
}

TEST(AlphaReplay, SameBitsForOneSeedAndAnyThreads) {
  for (const auto& c : {cases::make_all()[2], cases::make_all()[4]}) {
    const AlphaResult once = optimise(c.inputs, c.model, {}, {});
    for (const int threads : {1, 2, 4}) {
      const Evaluate spread = [&](std::span<const Point> batch, std::span<Result> out) {
        ASSERT_TRUE(parallel_for(batch.size(), threads,
                                 [&](std::size_t i) { c.model(batch.subspan(i, 1), out.subspan(i, 1)); }));
      };
      expect_same(once, optimise(c.inputs, spread, {}, {}));
    }
    AlphaOptions other;
    other.seed = 99;
    EXPECT_NE(optimise(c.inputs, c.model, other, {}).archive.samples().back().x, once.archive.samples().back().x);
  }
}

cases::Case make_chain_case() {
  return {"chain",
          std::vector<FuzzyNumber>(9, make_triangular(-1, .3, 2)),
          make_evaluate_values([](const Point& x) { return std::vector{calc_chain(x)}; }),
          {},
          0};
}

cases::Case make_edge_case() {
  return {"edges",
          std::vector<FuzzyNumber>(3, make_triangular(-1, .3, 1)),
          make_evaluate_values([](const Point& x) {
            return std::vector{std::max({x[0] + x[1], x[1] - x[2], .5 * x[2] - x[0]}) + .1 * x[0] * x[0]};
          }),
          {},
          0};
}

TEST(AlphaReplay, ResumedEqualsUninterrupted) {
  for (const auto& c : {cases::make_all()[2], cases::make_all()[4], make_chain_case(), make_edge_case()}) {
    const AlphaResult whole = optimise(c.inputs, c.model, {}, {});
    for (const int batches : {0, 1, 3, 7, 13}) {
      // stops in the middle of a batch, as an interrupted study does
      std::atomic<bool> cancel = false;
      Progress progress;
      progress.cancel = &cancel;
      int calls = 0;
      const Evaluate stopping = [&](std::span<const Point> batch, std::span<Result> out) {
        const bool stop = calls++ == batches;
        const std::size_t count = stop ? batch.size() / 2 : batch.size();
        c.model(batch.subspan(batch.size() - count), out.subspan(batch.size() - count));
        if (stop) cancel = true;
      };
      const AlphaResult part = optimise(c.inputs, stopping, {}, progress);
      EXPECT_EQ(part.ending, Ending::Cancelled);
      EXPECT_LT(part.archive.size(), whole.archive.size());
      AlphaOptions options;
      options.earlier = &part.archive;
      const AlphaResult resumed = optimise(c.inputs, c.model, options, {});
      EXPECT_EQ(resumed.ending, whole.ending);
      EXPECT_EQ(resumed.run + part.run, whole.run) << "nothing is run twice";
      expect_same(whole, resumed);
    }
  }
}

TEST(Alpha, ReportsBoundsSoFar) {
  const cases::Case c = cases::make_all()[2];
  AlphaOptions options;
  std::vector<double> upper;
  std::size_t seen = 0;
  options.watch = [&](const AlphaResult& so_far, const Archive& archive) {
    upper.push_back(so_far.outputs[0].levels[0].upper.value);
    EXPECT_GE(archive.size(), seen);
    seen = archive.size();
  };
  double done = 0;
  Progress progress;
  progress.report = [&](double d, double whole) {
    done = d;
    EXPECT_EQ(whole, options.limit);
  };
  const AlphaResult r = optimise(c.inputs, c.model, options, progress);
  ASSERT_GT(upper.size(), 3u);
  EXPECT_TRUE(std::is_sorted(upper.begin(), upper.end()));
  EXPECT_EQ(upper.back(), r.outputs[0].levels[0].upper.value);
  EXPECT_EQ(done, static_cast<double>(r.archive.size()));
}

// Steps whose edges no search can follow to an end: told as that, not as a limit that was not reached.
TEST(Alpha, SaysThatSearchesHaveNotConvergedWhereRunsAreLeft) {
  const Space space{{make_triangular(0, 4.7, 10)}, {}, {}};
  AlphaOptions options;
  options.limit = 100000;
  const AlphaResult r = optimise(space, make_evaluate_values([](const Point& x) {
                                   return Point{std::floor(3 * x[0]) / 3 + 0.1 * std::sin(5 * x[0])};
                                 }),
                                 options, {});
  EXPECT_LT(r.archive.size(), 100000u);
  EXPECT_EQ(r.ending, Ending::NotConverged);
  bool all = true;
  for (const auto& l : r.outputs.at(0).levels) all = all && l.lower.converged && l.upper.converged;
  EXPECT_FALSE(all);
}

// Searches saw no run of a thin class around them and took that for a place where nothing is to be gained.
// The corner at which two half spaces and ends of inputs meet; 1.908333 and 1.7 by linear programmes.
TEST(AlphaOfClasses, FindsCornersOfAWedge) {
  const Evaluate model = make_evaluate([](const Point& x) {
    const bool is_in = -.6 * x[0] + .8 * x[1] <= -.15 && .5 * x[0] - .6 * x[1] + .6 * x[2] <= .37;
    return Result{Result::State::Done, {x[0] + x[1] + x[2]}, is_in ? 1 : 0, {}, ""};
  });
  const std::vector<FuzzyNumber> inputs(3, make_triangular(0, .5, 1));
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(inputs, model, options, {});
    ASSERT_EQ(r.classes.size(), 2u);
    const auto& levels = r.classes[1].outputs[0].levels;
    EXPECT_NEAR(levels[0].upper.value, 1.908333, 3e-4) << seed;
    EXPECT_NEAR(levels[1].upper.value, 1.7, 3e-4) << seed;
  }
}

TEST(AlphaOfClasses, FollowsAThinClass) {
  const Evaluate model = make_evaluate([](const Point& x) {
    const bool is_in = std::abs(std::hypot(x[0] - 3, x[1] - 6) - 3.5) < 0.02;
    return Result{Result::State::Done, {x[0] + x[1]}, is_in ? 1 : 0, {}, ""};
  });
  const std::vector<FuzzyNumber> inputs = {make_triangular(0, 3, 10), make_triangular(0, 6, 10)};
  for (const std::uint64_t seed : {1, 2, 3}) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(inputs, model, options, {});
    ASSERT_EQ(r.classes.size(), 2u);
    const LevelBounds& l = r.classes[1].outputs[0].levels[0];
    EXPECT_NEAR(l.lower.value, 9 - 3.52 * std::sqrt(2), 20 * (l.lower.converged ? 1e-4 : 1e-3)) << seed;
    EXPECT_NEAR(l.upper.value, 9 + 3.52 * std::sqrt(2), 20 * (l.upper.converged ? 1e-4 : 1e-3)) << seed;
  }
}

TEST(AlphaPhysics, BoundsOnARoundBoundaryThatAreOffAreMarked) {
  // the sum within a torus about an axis along x2
  const Evaluate model = [](std::span<const Point> points, std::span<Result> out) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point& x = points[i];
      const double around = std::hypot(x[0] - .2, x[1] + .1) - 1.2, up = x[2] - .6;
      out[i].state = Result::State::Done;
      out[i].outcome = around * around + up * up < .04 ? 1 : 0;
      out[i].values = {x[0] + x[1] + x[2]};
    }
  };
  const double half = 1.2 * std::sqrt(2.0) + .2 * std::sqrt(3.0);
  int marked = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    AlphaOptions options;
    options.seed = seed;
    const AlphaResult r = optimise(std::vector(3, make_triangular(-2, 0, 2)), model, options, {});
    for (const auto& c : r.classes) {
      if (c.outcome != 1) continue;
      const LevelBounds& l = c.outputs[0].levels.front();
      ASSERT_EQ(l.alpha, 0);
      EXPECT_NEAR(l.lower.value, .7 - half, (l.lower.converged ? 2e-4 : 2e-2) * 2 * half) << seed;
      EXPECT_NEAR(l.upper.value, .7 + half, (l.upper.converged ? 2e-4 : 2e-2) * 2 * half) << seed;
      marked += !l.lower.converged + !l.upper.converged;
    }
  }
  EXPECT_GT(marked, 0);
}

AlphaResult optimise_with(std::uint64_t seed, const Evaluate& model) {
  AlphaOptions options;
  options.seed = seed;
  return optimise(std::vector(3, make_triangular(0, .5, 1)), model, options, {});
}

// What no outcome tells: a worse value behind an oblique plane, two of them of different heights, and a piece that the
// cut of a level only just reaches.
TEST(AlphaAtJumps, FollowsAPlane) {
  const Evaluate model = make_evaluate_values([](const Point& x) {
    return std::vector{x[0] + .6 * x[1] - .3 * x[2] - (2 * x[0] + x[1] + 2 * x[2] > 2.2 ? 1 : 0)};
  });
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const AlphaResult r = optimise_with(seed, model);
    // the least x2, the largest x1, and of x0 what the plane leaves
    for (const LevelBounds& l : r.outputs[0].levels) {
      const double low = .5 * l.alpha, high = 1 - low;
      if (l.alpha == 1) continue;
      EXPECT_NEAR(l.upper.value, (2.2 - high - 2 * low) / 2 + .6 * high - .3 * low, 1e-4) << seed << " " << l.alpha;
      EXPECT_TRUE(l.upper.converged) << seed << " " << l.alpha;
    }
  }
}

TEST(AlphaAtJumps, FollowsAnEdgeOfTwo) {
  const Evaluate model = make_evaluate_values([](const Point& x) {
    return std::vector{x[0] + x[1] + .2 * x[2] - (x[0] + 2 * x[1] + x[2] > 2 ? 1 : 0) -
                       (2 * x[0] + x[1] + x[2] > 1.9 ? .5 : 0)};
  });
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const AlphaResult r = optimise_with(seed, model);
    // where both planes meet, down to the least x2
    for (const LevelBounds& l : r.outputs[0].levels) {
      if (l.alpha == 1) continue;
      EXPECT_NEAR(l.upper.value, 1.3 - 1.4 / 3 * .5 * l.alpha, 1e-4) << seed << " " << l.alpha;
    }
  }
}

TEST(AlphaAtJumps, FollowsAPlaneThroughNoise) {
  const Evaluate model = make_evaluate_values([](const Point& x) {
    const double wild = std::fmod(std::abs(43758.5453 * std::sin(7919.77 * x[0] + 12989.8 * x[1] + 3571.3 * x[2])), 1);
    return std::vector{.4 * x[0] + .2 * x[1] - .12 * x[2] - (x[0] + .8 * x[1] + .6 * x[2] >= 1.5 ? .3 : 0) +
                       1e-4 * (2 * wild - 1)};
  });
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const AlphaResult r = optimise_with(seed, model);
    // behind the plane, at the largest x1 and x2
    for (const int k : {0, 1, 2}) {
      const LevelBounds& l = r.outputs[0].levels[static_cast<std::size_t>(k)];
      const double high = 1 - .5 * l.alpha;
      EXPECT_NEAR(l.lower.value, .4 * (1.5 - 1.4 * high) + .2 * high - .12 * high - .3, 1e-3) << seed << " " << l.alpha;
    }
  }
}

TEST(AlphaAtJumps, SeesAPieceThatALevelJustReaches) {
  // at the level 0.5 the corner 0.75, 0.75, 0.75 lies 0.03 beyond the plane
  const Evaluate model = make_evaluate_values(
      [](const Point& x) { return std::vector{-x[0] - x[1] + (.6 * x[0] + .64 * x[1] + .48 * x[2] > 1.26 ? 2 : 0)}; });
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const AlphaResult r = optimise_with(seed, model);
    const LevelBounds& l = r.outputs[0].levels[2];
    ASSERT_EQ(l.alpha, .5);
    EXPECT_NEAR(l.upper.value, 2 - .75 - (1.26 - .64 * .75 - .48 * .75) / .6, 1e-4) << seed;
  }
}

}  // namespace
}  // namespace topple::uncertainty
