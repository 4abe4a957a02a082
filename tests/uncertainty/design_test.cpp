#include "uncertainty/design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "reference_cases.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

struct Found {
  DesignResult design;
  Archive archive;
};

Found find(const Space& space, const Evaluate& model, const Requirement& requirement, const DesignOptions& options,
           int limit = 20000) {
  const Progress progress;
  Asker asker(model, progress, nullptr, limit);
  Found f;
  f.design = find_permissible_boxes(space, asker, requirement, options);
  f.archive = asker.archive();
  return f;
}

/// Outcome 0 where `is_good`, else 1.
Evaluate make_model(std::function<bool(const Point&)> is_good) {
  return make_evaluate([is_good](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = is_good(x) ? 0 : 1;
    r.values = {x[0]};
    return r;
  });
}

/// With 95 %, shares of the rest for each try that could have come.
double bound_of(const PermissibleBox& b) {
  return 1 - std::pow(0.05 * 6 / std::pow(std::numbers::pi * b.tries, 2), 1.0 / b.fresh);
}

const Requirement outcome_0 = [](const Result& r) { return r.outcome == 0 ? 1.0 : -1.0; };

// The sum of four inputs between 0 and 1 stays below 2.3. With 300 runs a box must come with fewer trials than
// growing takes; of ten seeds at most one may break a statement that holds with a confidence of 95 %.
TEST(DesignPhysics, SaysLittleButTrueThingsFromFewRuns) {
  const auto is_good = [](const Point& x) { return x[0] + x[1] + x[2] + x[3] < 2.3; };
  const Space space{std::vector<FuzzyNumber>(4, make_triangular(0, 0.4, 1)), {}, {}};
  int kept = 0, wrong = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    DesignOptions options;
    options.space_points = 100;
    options.fresh = 20;
    options.rerun_limit = 0;
    options.k_max = 2;
    options.seed = seed;
    const Found f = find(space, make_model(is_good), outcome_0, options, 300);
    EXPECT_LE(f.archive.size(), 300u);
    for (const auto& b : f.design.boxes) {
      if (!b.kept) continue;
      ++kept;
      EXPECT_LE(b.fresh, 20);
      EXPECT_GE(b.fresh, 10) << "half of them, where later runs made it smaller";
      EXPECT_NEAR(b.violating, bound_of(b), 1e-12);
      Random random(99);
      int bad = 0;
      for (int k = 0; k < 20000; ++k) {
        Point x;
        for (int i = 0; i < 4; ++i) x.push_back(random.next(b.box.lower[i], b.box.upper[i]));
        bad += !is_good(x);
      }
      wrong += bad > b.violating * 20000;
    }
  }
  EXPECT_GE(kept, 10) << "a box for each seed";
  EXPECT_LE(wrong, 1);
}

// Corners are what breaks: random points inside seldom find them, the analysis of the box does.
TEST(DesignPhysics, FinishesABoxWithTheRunsThatThereAre) {
  for (const int n : {3, 5}) {
    const double limit = n == 3 ? 2 : 3.2;
    const auto is_good = [limit](const Point& x) {
      double sum = 0;
      for (const double v : x) sum += v;
      return sum < limit;
    };
    const Space space{std::vector<FuzzyNumber>(static_cast<std::size_t>(n), make_triangular(0, 0.4, 1)), {}, {}};
    DesignOptions options;
    options.space_points = 200 * n;
    options.rerun_limit = 300;
    const Found f = find(space, make_model(is_good), outcome_0, options, 4000);
    ASSERT_FALSE(f.design.boxes.empty());
    EXPECT_TRUE(f.design.boxes.front().kept) << n;
    for (const auto& b : f.design.boxes) {
      EXPECT_EQ(b.kept, b.kept && b.broken == 0);
      int broken = 0;
      for (const auto& s : f.archive.samples()) broken += b.box.contains(s.x) && !is_good(s.x);
      EXPECT_EQ(b.broken, broken) << "counted, kept or not";
    }
  }
}

// A run behind the search violates inside: what is left of the box is kept, or nothing if that is little.
TEST(Design, BoxesShrinkWhenLaterRunsViolate) {
  const Space space{std::vector<FuzzyNumber>(2, make_triangular(0, 0.4, 1)), {}, {}};
  DesignOptions options;
  options.rerun_limit = 200;
  Found f = find(space, make_model([](const Point& x) { return x[0] < 0.8; }), outcome_0, options, 2000);
  ASSERT_TRUE(f.design.boxes.front().kept);
  const PermissibleBox before = f.design.boxes.front();
  ASSERT_GT(before.box.upper[1], 0.95);
  const auto add = [&f](Point x) {
    Sample s{std::move(x), {}};
    s.result.outcome = 1;
    f.archive.add(std::move(s));
  };
  add({0.7, 0.9});
  std::vector<PermissibleBox> boxes{before};
  review_boxes(space, boxes, outcome_0, f.archive, options);
  const PermissibleBox& b = boxes.front();
  EXPECT_TRUE(b.kept);
  EXPECT_EQ(b.broken, 0);
  EXPECT_FALSE(b.box.contains({0.7, 0.9}));
  EXPECT_LT(b.volume, 0.95 * before.volume);
  EXPECT_GT(b.volume, 0.8 * before.volume);
  EXPECT_LT(b.fresh, before.fresh);
  EXPECT_EQ(static_cast<int>(b.fresh_points.size()), b.fresh);
  EXPECT_NEAR(b.violating, bound_of(b), 1e-12);
  EXPECT_EQ(b.inputs[0].support().right, b.box.upper[0]);
  EXPECT_EQ(b.inputs[1].support().right, b.box.upper[1]);
  ASSERT_EQ(b.outputs.size(), before.outputs.size());
  // on both sides of the core: hardly anything is left
  const Point core = f.archive[before.centre].x;
  for (const double by : {-0.02, 0.02}) add({core[0] + by, core[1]}), add({core[0], core[1] + by});
  boxes = {before};
  review_boxes(space, boxes, outcome_0, f.archive, options);
  EXPECT_FALSE(boxes.front().kept);
  EXPECT_EQ(boxes.front().broken, 5);
}

// Near the lower ends nothing violates: a box that had to shrink to its upper corners reaches down to them again.
TEST(DesignPhysics, FacesThatShrankForOthersMoveBackOut) {
  const auto is_good = [](const Point& x) { return x[0] + x[1] + x[2] + x[3] + x[4] < 2.5; };
  const Space space{std::vector<FuzzyNumber>(5, make_triangular(0, 0.3, 1)), {}, {}};
  DesignOptions options;
  options.rerun_limit = 0;
  const Found f = find(space, make_model(is_good), outcome_0, options, 8000);
  const double largest_there_is = std::pow(0.5, 5);
  ASSERT_FALSE(f.design.boxes.empty());
  for (const auto& b : f.design.boxes) {
    EXPECT_TRUE(b.kept);
    EXPECT_GT(b.volume, 0.6 * largest_there_is);
    EXPECT_LE(b.volume, largest_there_is);
  }
}

TEST(Design, DrawsNoFreshPointTwiceWhereItSearchesAgain) {
  const auto is_good = [](const Point& x) { return x[0] + x[1] + x[2] + x[3] < 2.3; };
  const Space space{std::vector<FuzzyNumber>(4, make_triangular(0, 0.4, 1)), {}, {}};
  DesignOptions options;
  options.space_points = 100;
  options.fresh = 20;
  options.rerun_limit = 0;
  options.k_max = 2;
  const Progress progress;
  Asker asker(make_model(is_good), progress, nullptr, 900);
  asker.set_limit(300);
  const DesignResult first = find_permissible_boxes(space, asker, outcome_0, options);
  asker.set_limit(900);
  for (const auto& b : first.boxes) options.tried = std::max(options.tried, b.tries);
  ASSERT_GT(options.tried, 0);
  const DesignResult second = find_permissible_boxes(space, asker, outcome_0, options);
  // where in its box a fresh point lies
  const auto places = [](const DesignResult& r) {
    std::vector<double> all;
    for (const auto& b : r.boxes)
      for (const Point& x : b.fresh_points)
        for (size_t i = 0; i < 4; ++i) all.push_back((x[i] - b.box.lower[i]) / (b.box.upper[i] - b.box.lower[i]));
    return all;
  };
  const std::vector<double> before = places(first), now = places(second);
  ASSERT_FALSE(before.empty());
  ASSERT_FALSE(now.empty());
  for (const double x : now)
    EXPECT_TRUE(std::ranges::none_of(before, [&](double y) { return std::abs(x - y) < 1e-12; })) << x;
  for (const auto& b : second.boxes)
    if (b.fresh > 0) { EXPECT_GT(b.tries, options.tried); }
}

TEST(Space, CornersAreThoseOfItsWideInputs) {
  Box box{Point(40, 1), Point(40, 1)};
  box.upper[3] = 2, box.upper[31] = 5;
  const std::vector<Point> corners = make_corners(box);
  ASSERT_EQ(corners.size(), 4u);
  EXPECT_EQ(corners[1][3], 2);
  EXPECT_EQ(corners[1][31], 1);
  EXPECT_EQ(corners[2][31], 5);
  EXPECT_EQ(corners[3][0], 1);
}

TEST(Design, KeepsNoBoxWithoutRunsForIt) {
  DesignOptions options;
  options.space_points = 60;
  const Found f = find(Space{std::vector<FuzzyNumber>(3, make_triangular(0, 0.4, 1)), {}, {}},
                       make_model([](const Point& x) { return x[0] + x[1] < 1.3; }), outcome_0, options, 60);
  EXPECT_EQ(f.archive.size(), 60u);
  EXPECT_EQ(f.design.ending, Ending::LimitReached);
  for (const auto& b : f.design.boxes) {
    EXPECT_FALSE(b.kept);
    EXPECT_EQ(b.box.lower.size(), 3u) << "a box all the same: its centre";
  }
}

// x1 x2 / 100 >= 8: permissible on .879201442 of the support; the largest box from the upper corner reaches to
// (20.225996, 39.553059) and has the area 1200.224726.
TEST(DesignReference, BoxesOfTheJump) {
  for (const auto kind : {Clustering::Medoids, Clustering::FuzzyMeans})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      DesignOptions options;
      options.clustering = kind;
      options.seed = seed;
      options.edge = 1e-3;
      const Found f = find(
          Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump),
          [](const Result& r) { return r.outcome == 0 ? r.values[0] : -1; }, options);
      ASSERT_FALSE(f.design.boxes.empty());
      double largest = 0;
      Point corner;
      for (const auto& b : f.design.boxes) {
        EXPECT_TRUE(b.kept);
        EXPECT_GE(b.box.lower[0] * b.box.lower[1], 800) << "the whole box is permissible";
        EXPECT_EQ(b.box.upper, (Point{45, 88}));
        EXPECT_EQ(b.inputs[0].support().left, b.box.lower[0]);
        EXPECT_EQ(b.inputs[1].centre(), f.archive[b.centre].x[1]);
        EXPECT_EQ(b.fresh, 149);
        EXPECT_NEAR(b.violating, bound_of(b), 1e-12);
        if (calc_volume(b.box) > largest) largest = calc_volume(b.box), corner = b.box.lower;
      }
      EXPECT_LE(largest, 1200.224726);
      EXPECT_NEAR(largest, 1200.224726, 2e-3 * 1200) << "twice the edge";
      EXPECT_NEAR(corner[0], 20.225996, 0.5) << "flat along the boundary";
      EXPECT_NEAR(corner[1], 39.553059, 1.0);
    }
}

TEST(DesignReference, PermissiblePartOfTheJump) {
  DesignOptions options;
  options.space_points = 16000;
  options.rounds = 1;
  const Found f =
      find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump), outcome_0, options, 30000);
  EXPECT_NEAR(f.design.fraction, .879201442, 1e-3) << "below half the standard error of independent points";
  EXPECT_NEAR(f.design.fraction_error, std::sqrt(.8792 * .1208 / 16000), 1e-5);
  EXPECT_EQ(f.design.permissible + f.design.forbidden + f.design.failed, static_cast<int>(f.archive.size()));
}

// Σ of the products' logarithms is symmetric: the largest box of Π x_i >= c from the corner (1 ... 1) is a cube.
TEST(DesignPhysics, LargestBoxOfAProductIsACube) {
  for (const int n : {3, 5}) {
    const double c = std::pow(0.6, n) * 0.3, side = 1 - std::pow(c, 1.0 / n);
    DesignOptions options;
    options.k_max = 2;
    const Found f =
        find(Space{std::vector<FuzzyNumber>(n, make_triangular(0, .6, 1)), {}, {}}, make_model([&](const Point& x) {
               double p = 1;
               for (const double v : x) p *= v;
               return p >= c;
             }),
             outcome_0, options, 30000);
    double largest = 0;
    for (const auto& b : f.design.boxes) {
      if (!b.kept) continue;
      double p = 1;
      for (const double v : b.box.lower) p *= v;
      EXPECT_GE(p, c);
      largest = std::max(largest, b.volume);
    }
    EXPECT_LE(largest, std::pow(side, n));
    EXPECT_GE(largest, 0.93 * std::pow(side, n)) << n << " inputs";
  }
}

TEST(Design, LeavesForbiddenIslandsAndFailuresOut) {
  // two permissible fields, a wall between them with a gap that is too small, an island, a corner that fails
  const auto is_forbidden = [](const Point& x) {
    return std::abs(x[0] - 0.5) < 0.06 || std::hypot(x[0] - 0.2, x[1] - 0.25) < 0.08;
  };
  const Evaluate model = make_evaluate([&](const Point& x) {
    Result r;
    r.state = x[0] + x[1] > 1.7 ? Result::State::Failed : Result::State::Done;
    r.outcome = is_forbidden(x) ? 1 : 0;
    r.values = {x[0] + 2 * x[1]};
    return r;
  });
  const FuzzyNumber f = make_triangular(0, 0.3, 1);
  DesignOptions options;
  const Found found = find(Space{{f, f}, {}, {}}, model, outcome_0, options);
  EXPECT_GT(found.design.failed, 0);
  int left = 0, right = 0;
  Random random(5);
  for (const auto& b : found.design.boxes) {
    if (!b.kept) continue;
    (b.box.upper[0] < 0.5 ? left : right) += 1;
    EXPECT_GT(b.volume, 0.05);
    int violating = 0;
    for (int k = 0; k < 20000; ++k) {
      const Point x = {random.next(b.box.lower[0], b.box.upper[0]), random.next(b.box.lower[1], b.box.upper[1])};
      violating += is_forbidden(x) || x[0] + x[1] > 1.7;
    }
    EXPECT_LE(violating, b.violating * 20000) << "the stated bound";
  }
  EXPECT_GE(left, 1);
  EXPECT_GE(right, 1);
}

TEST(Design, BoxesOfManyInputsMayBeSmall) {
  const auto unit_box = [](size_t n) { return Box{Point(n, 0.0), Point(n, 1.0)}; };
  EXPECT_DOUBLE_EQ(calc_smallest(1e-3, unit_box(1)), 1e-3);
  EXPECT_DOUBLE_EQ(calc_smallest(1e-3, unit_box(3)), 1e-3);
  EXPECT_NEAR(calc_smallest(1e-3, unit_box(5)), 1e-5, 1e-18);  // a tenth of each side
  // a cube with a quarter of each side: 0.08 % of the support
  const auto is_good = [](const Point& x) {
    return std::all_of(x.begin(), x.end(), [](double v) { return std::abs(v - 0.5) <= 0.12; });
  };
  const Space space{std::vector<FuzzyNumber>(5, make_triangular(0, 0.5, 1)), {}, {}};
  DesignOptions options;
  options.rerun_limit = 0;
  const Found f = find(space, make_model(is_good), outcome_0, options, 6000);
  ASSERT_FALSE(f.design.boxes.empty());
  const PermissibleBox& b = f.design.boxes.front();
  EXPECT_TRUE(b.kept);
  EXPECT_GT(b.volume, 0.4 * std::pow(0.24, 5));
  for (int i = 0; i < 5; ++i) {
    EXPECT_GE(b.box.lower[i], 0.38);
    EXPECT_LE(b.box.upper[i], 0.62);
  }
}

TEST(Design, RanksKeptBoxesFirst) {
  const Found f = find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump), outcome_0, {});
  ASSERT_FALSE(f.design.boxes.empty());
  EXPECT_TRUE(std::is_partitioned(f.design.boxes.begin(), f.design.boxes.end(), [](const auto& b) { return b.kept; }));
  for (const auto& b : f.design.boxes) {
    if (!b.kept) continue;
    EXPECT_GT(b.robustness, 0);
    EXPECT_GT(b.samples, b.fresh);
    ASSERT_EQ(b.outputs.size(), 1u);
    // the fuzzy analysis on the box: its output is monotone, so its corners bound it
    const auto value = [](const Point& x) { return x[0] * x[1] / 100 - 8; };
    EXPECT_NEAR(b.outputs[0].levels[0].lower.value, value(b.box.lower), 1e-9);
    EXPECT_NEAR(b.outputs[0].levels[0].upper.value, value(b.box.upper), 1e-9);
  }
}

TEST(Design, SaysWhenNothingIsPermissible) {
  const Found f = find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump),
                       [](const Result&) { return -1.0; }, {});
  EXPECT_TRUE(f.design.boxes.empty());
  EXPECT_EQ(f.design.fraction, 0);
  EXPECT_EQ(f.design.permissible, 0);
}

TEST(Design, OnePointWithoutASpreadIsJudged) {
  const Space crisp{{make_triangular(2, 2, 2)}, {}, {}};
  const Evaluate model = make_evaluate_values([](const Point& x) { return std::vector{x[0]}; });
  const Found f = find(crisp, model, [](const Result& r) { return 3 - r.values[0]; }, {});
  EXPECT_EQ(f.design.fraction, 1);
}

TEST(Design, EverythingPermissibleIsOneBox) {
  const Found f = find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump),
                       [](const Result&) { return 1.0; }, {});
  ASSERT_EQ(f.design.boxes.size(), 1u) << "the same box of all groups is kept once";
  EXPECT_EQ(f.design.boxes[0].volume, 1);
  EXPECT_TRUE(f.design.boxes[0].kept);
  EXPECT_EQ(f.design.fraction, 1);
  const double n = f.design.spread;
  EXPECT_GT(n, 0);
  EXPECT_NEAR(f.design.fraction_error, std::sqrt(n + 1) / std::pow(n + 2, 1.5), 1e-12) << "never certain";
}

// Searches for where an outcome changes leave most runs beside the boundary, so that the middle run of a group lies
// there: a box has no room around it, and begins elsewhere.
TEST(Design, BeginsWhereThereIsRoom) {
  const Evaluate model = make_model([](const Point& x) { return x[0] < 0.3; });
  const Progress progress;
  Asker asker(model, progress, nullptr, 20000);
  Random random(3);
  std::vector<Point> beside;
  for (int k = 0; k < 4000; ++k)
    beside.push_back({0.3 + (k % 2 ? 1e-3 : -1e-3) * random.next(0, 1), random.next(0, 1)});
  (void)asker.ask(beside);
  const FuzzyNumber f = make_triangular(0, 0.5, 1);
  const DesignResult design = find_permissible_boxes(Space{{f, f}, {}, {}}, asker, outcome_0, {});
  double largest = 0;
  for (const PermissibleBox& b : design.boxes)
    if (b.kept) largest = std::max(largest, b.volume);
  EXPECT_GT(largest, 0.28);
  EXPECT_LT(largest, 0.3);
}

// What breaks a constraint takes nothing away, also where runs were made there: every possible point keeps the
// requirement.
TEST(Design, WhatConstraintsExcludeCutsNoBox) {
  const Space space{
      {make_triangular(0, 1, 2), make_triangular(0, 1, 2)}, {[](const Point& x) { return 0.5 - x[0] * x[1]; }}, {}};
  const Evaluate model = make_model([](const Point& x) { return x[0] * x[1] >= 0.5; });
  const Progress progress;
  Asker asker(model, progress, nullptr, 6000);
  asker.ask({{0.1, 0.1}, {0.4, 0.4}, {0.2, 1.9}, {1.9, 0.2}, {0.6, 0.7}});
  const DesignResult d = find_permissible_boxes(space, asker, outcome_0, {});
  EXPECT_EQ(d.fraction, 1);
  EXPECT_EQ(d.forbidden, 0);
  ASSERT_EQ(d.boxes.size(), 1u);
  EXPECT_TRUE(d.boxes[0].kept);
  EXPECT_EQ(d.boxes[0].volume, 1);
  EXPECT_EQ(d.boxes[0].broken, 0);
}

// x1 + x2 <= 1.5 holds wherever the joint membership, a cone of radius 1, is above 0 (the largest sum there is √2).
TEST(Design, JointMembershipSaysWhatCounts) {
  const Space space{{make_triangular(-2, 0, 2), make_triangular(-2, 0, 2)}, {}, [](const Point& x) {
                      return std::max(0.0, 1 - std::hypot(x[0], x[1]));
                    }};
  int outside = 0;
  const Evaluate model = make_evaluate([&](const Point& x) {
    outside += std::hypot(x[0], x[1]) >= 1;
    Result r;
    r.state = Result::State::Done;
    r.outcome = x[0] + x[1] <= 1.5 ? 0 : 1;
    r.values = {x[0] + x[1]};
    return r;
  });
  const Found f = find(space, model, outcome_0, {}, 6000);
  EXPECT_EQ(f.design.fraction, 1);
  EXPECT_EQ(outside, 0) << "runs that count for nothing";
  ASSERT_GE(f.design.boxes.size(), 1u);
  EXPECT_TRUE(f.design.boxes[0].kept);
  EXPECT_EQ(f.design.boxes[0].volume, 1);
  ASSERT_EQ(f.design.boxes[0].outputs.size(), 1u);
  // over the disc alone
  EXPECT_NEAR(f.design.boxes[0].outputs[0].levels[0].upper.value, std::sqrt(2), 1e-3);
}

TEST(DesignReplay, SameBits) {
  DesignOptions options;
  const auto run = [&] {
    return find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump), outcome_0, options);
  };
  const Found a = run(), b = run();
  ASSERT_EQ(a.archive.size(), b.archive.size());
  ASSERT_EQ(a.design.boxes.size(), b.design.boxes.size());
  for (std::size_t k = 0; k < a.design.boxes.size(); ++k) {
    EXPECT_EQ(a.design.boxes[k].box.lower, b.design.boxes[k].box.lower);
    EXPECT_EQ(a.design.boxes[k].robustness, b.design.boxes[k].robustness);
  }
}

TEST(Design, RefusesBadOptions) {
  DesignOptions options;
  options.confidence = 1;
  EXPECT_THROW(find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump), outcome_0, options),
               InputError);
}

}  // namespace
}  // namespace topple::uncertainty
