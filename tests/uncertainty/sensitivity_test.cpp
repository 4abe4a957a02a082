#include "uncertainty/sensitivity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "reference_cases.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

// Ishigami & Homma (1990), a = 7, b = 0.1, uniform on [-π, π]: closed forms of the variances.
TEST(SensitivityReference, IndicesOfIshigami) {
  const double a = 7, b = 0.1, p4 = std::pow(cases::pi, 4), p8 = p4 * p4;
  const double v1 = 0.5 * std::pow(1 + b * p4 / 5, 2), v2 = a * a / 8, v13 = b * b * p8 * (1.0 / 18 - 1.0 / 50);
  const double v = v1 + v2 + v13;
  const double first[] = {v1 / v, v2 / v, 0}, total[] = {(v1 + v13) / v, v2 / v, v13 / v};
  const cases::Case c = cases::make_all()[2];
  const Progress progress;
  Asker asker(c.model, progress, nullptr, 100000);
  SensitivityOptions options;
  options.rows = 4096;
  const Sensitivity s = find_drivers(Space{c.inputs, {}, {}}, asker, options);
  EXPECT_EQ(asker.asked(), 4096 * 5);
  EXPECT_EQ(s.rows_used, 4096);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(s.outputs[0][i].first, first[i], 0.01) << i;
    EXPECT_NEAR(s.outputs[0][i].total, total[i], 0.01) << i;
    EXPECT_LT(s.outputs[0][i].first_error, 0.05);
    EXPECT_GT(s.outputs[0][i].total_error, 0);
  }
}

// The outcome x1 > 1/2 or x2 > 3/4 of independent uniform inputs; x3 does nothing.
TEST(SensitivityPhysics, DriversOfAnOutcomeHaveClosedForms) {
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = x[0] > 0.5 || x[1] > 0.75 ? 3 : 1;
    r.values = {5.0};
    return r;
  });
  const Progress progress;
  Asker asker(model, progress, nullptr, 100000);
  const Space space{std::vector<FuzzyNumber>(3, make_triangular(0, 0.3, 1)), {}, {}};
  SensitivityOptions options;
  options.rows = 4096;
  const Sensitivity s = find_drivers(space, asker, options);
  ASSERT_EQ(s.outcomes.size(), 2u);
  EXPECT_EQ(s.outcomes[1].outcome, 3);
  const double p = 1 - 0.5 * 0.75, v = p * (1 - p);
  EXPECT_NEAR(s.outcomes[1].share, p, 0.01);
  // E[I|x1] is 1 or 1/4, E[I|x2] is 1 or 1/2; total: the mean variance given the others
  const double want[3][2] = {{0.25 * 0.75 * 0.75 / v, 0.75 * 0.25 / v}, {0.1875 * 0.25 / v, 0.5 * 0.1875 / v}, {0, 0}};
  for (int i = 0; i < 3; ++i)
    for (const auto& o : s.outcomes) {
      EXPECT_NEAR(o.inputs[i].first, want[i][0], 0.02) << i;
      EXPECT_NEAR(o.inputs[i].total, want[i][1], 0.02) << i;
    }
  EXPECT_EQ(s.outcomes[0].inputs[2].total, 0) << "exactly: nothing changes with x3";
  EXPECT_EQ(s.outputs[0][0].total, 0) << "an output that does not vary has no driver";
}

// The same function from spread runs alone. With N points in √N bins the share that a smooth function has inside a bin
// is lost, about 1/√N of its own variance share (10 % for 100 points), beside the error that is told.
TEST(SensitivityReference, SharesOfIshigamiFromSpreadRuns) {
  const cases::Case c = cases::make_all()[2];
  const Space space{c.inputs, {}, {}};
  const double want[] = {0.313905, 0.442411, 0};
  for (const int count : {100, 1000})
    for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
      const Progress progress;
      Asker asker(c.model, progress, nullptr, 100000);
      const Box box = make_box(space, 0);
      std::vector<Point> points;
      for (const auto& u : make_sobol_points(3, 1, count, seed)) points.push_back(place_in(box, u));
      const Sensitivity s = read_drivers(space, asker.archive(), asker.ask(points));
      EXPECT_EQ(s.rows, count);
      for (int i = 0; i < 3; ++i) {
        const Driver& d = s.outputs[0][i];
        EXPECT_NEAR(d.first, want[i], 3 * d.first_error) << count << " " << seed;
        EXPECT_LT(d.first_error, 2.0 / std::sqrt(count));
        EXPECT_TRUE(std::isnan(d.total)) << "needs rows";
      }
    }
}

// The outcome x1 < p and x2 < q, and a number that is 0 elsewhere: few rows meet it, and their errors say so.
TEST(SensitivityPhysics, FewRowsOfARareOutcomeAreNotTakenForCertain) {
  struct Corner {
    int rows;
    double p, q;
  };
  for (const Corner c : {Corner{35, 0.15, 0.2}, Corner{256, 0.03, 0.08}, Corner{256, 0.05, 0.1}}) {
    const Evaluate model = make_evaluate([c](const Point& x) {
      Result r;
      r.state = Result::State::Done;
      r.outcome = x[0] < c.p && x[1] < c.q ? 3 : 1;
      r.values = {r.outcome == 3 ? 2.0 + x[2] : 0.0};
      return r;
    });
    const double v = c.p * c.q * (1 - c.p * c.q);
    const double first[] = {c.q * c.q * c.p * (1 - c.p) / v, c.p * c.p * c.q * (1 - c.q) / v, 0};
    const double total[] = {c.q * c.p * (1 - c.p) / v, c.p * c.q * (1 - c.q) / v, 0};
    const Space space{std::vector<FuzzyNumber>(3, make_triangular(0, 0.5, 1)), {}, {}};
    int told = 0, wrong = 0;
    for (unsigned seed = 0; seed < 100; ++seed) {
      const Progress progress;
      Asker asker(model, progress, nullptr, 100000);
      SensitivityOptions options;
      options.rows = c.rows;
      options.seed = seed;
      const Sensitivity s = find_drivers(space, asker, options);
      if (s.outcomes.size() < 2) continue;  // no run has met it
      for (const OutcomeDrivers& o : s.outcomes)
        for (size_t i = 0; i < 3; ++i) {
          const Driver& d = o.inputs[i];
          ++told;
          wrong += std::abs(d.first - first[i]) > 3 * d.first_error + 0.05;
          wrong += std::abs(d.total - total[i]) > 3 * d.total_error + 0.05;
        }
      const Driver& d = s.outputs[0][1];
      ++told;
      wrong += std::abs(d.total - total[1]) > 3 * d.total_error + 0.1;
    }
    EXPECT_GT(told, 300) << c.rows;
    EXPECT_LT(wrong, 0.02 * told) << c.rows << " rows, " << c.p << " by " << c.q << ": " << told;
  }
}

// What is the same everywhere has no drivers, and the size of values does not matter.
TEST(Sensitivity, SharesDoNotHangOnSizeNorOnRounding) {
  const Space space{{make_triangular(0, 1, 3), make_triangular(1, 2, 3)}, {}, {}};
  const Evaluate model = [](std::span<const Point> batch, std::span<Result> out) {
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const double a = batch[k][0], b = batch[k][1], y = a + 0.1 * b;
      const double same = k % 2 == 0 ? 4.2 : 4.2 * (1 + 3e-16);
      out[k] = {
          Result::State::Done, {y, 99.7, same, 1e9 + 1e-5 * a, 1e300 * y, 1e300 * (1.5 - y), 1e-300 * y}, 0, {}, ""};
    }
  };
  const Progress progress;
  Asker asker(model, progress, nullptr, 100000);
  const Box box = make_box(space, 0);
  std::vector<Point> points;
  for (const auto& u : make_sobol_points(2, 1, 300, 1)) points.push_back(place_in(box, u));
  const Sensitivity spread = read_drivers(space, asker.archive(), asker.ask(points));
  SensitivityOptions options;
  options.rows = 64;
  const Sensitivity rows = find_drivers(space, asker, options);
  for (const Sensitivity* s : {&spread, &rows}) {
    const auto share = [&](std::size_t output, std::size_t input) { return s->outputs.at(output).at(input); };
    EXPECT_GT(share(0, 0).first, 0.8);
    for (const std::size_t constant : {1U, 2U})
      for (const std::size_t input : {0U, 1U}) {
        EXPECT_EQ(share(constant, input).first, 0) << constant;
        EXPECT_EQ(share(constant, input).first_error, 0) << constant;
      }
    EXPECT_NEAR(share(3, 0).first, 1, 0.2);
    EXPECT_NEAR(share(3, 1).first, 0, 0.2);
    for (const std::size_t scaled : {4U, 5U, 6U})
      for (const std::size_t input : {0U, 1U})
        EXPECT_NEAR(share(scaled, input).first, share(0, input).first, 1e-9) << scaled;
    EXPECT_EQ(s->outcomes.at(0).inputs.at(0).first, 0) << "the only outcome";
  }
}

// Spread points line up with bins of one input now and then: then an input that does nothing seems to act.
TEST(Sensitivity, ErrorsOfFewSpreadRunsHoldWhatLinesUp) {
  int cases = 0, beyond = 0;
  double most = 0;
  for (int n = 2; n <= 8; ++n)
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const std::vector<Point> points = make_sobol_points(n, 1, 40, seed);
      for (int acts = 0; acts < n; ++acts) {
        const Evaluate model = [acts](std::span<const Point> x, std::span<Result> out) {
          for (std::size_t k = 0; k < x.size(); ++k) out[k] = {Result::State::Done, {x[k][acts]}, 0, {}, ""};
        };
        const Space space{std::vector<FuzzyNumber>(static_cast<std::size_t>(n), make_trapezoidal(0, 0, 1, 1)), {}, {}};
        const Progress progress;
        Asker asker(model, progress);
        const Sensitivity s = read_drivers(space, asker.archive(), asker.ask(points));
        for (int i = 0; i < n; ++i) {
          const Driver& d = s.outputs[0][i];
          if (i == acts) {
            EXPECT_GT(d.first, 0.9);
          } else {
            ++cases;
            beyond += d.first > 2 * d.first_error;
            most = std::max(most, d.first / d.first_error);
          }
        }
      }
    }
  EXPECT_LE(beyond, cases / 100) << "of " << cases;
  EXPECT_LT(most, 3);
}

TEST(Sensitivity, KnowsNothingFromAHandfulOfRuns) {
  const Space space{{make_triangular(0, 1, 2)}, {}, {}};
  const Progress progress;
  Asker asker(make_evaluate_values([](const Point& x) { return x; }), progress);
  const auto samples = asker.ask({{0.1}, {0.5}, {0.9}, {1.5}});
  EXPECT_TRUE(std::isnan(read_drivers(space, asker.archive(), samples).outputs[0][0].first));
  EXPECT_TRUE(read_drivers(space, asker.archive(), {}).outputs.empty());
}

TEST(Sensitivity, LeavesRowsWithFailedRunsOut) {
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = x[0] > 0.9 ? Result::State::Failed : Result::State::Done;
    r.values = {x[0] + 0 * x[1]};
    return r;
  });
  const Progress progress;
  Asker asker(model, progress, nullptr, 100000);
  const Sensitivity s = find_drivers(Space{std::vector<FuzzyNumber>(2, make_triangular(0, 0.3, 1)), {}, {}}, asker, {});
  EXPECT_EQ(s.rows, 512);
  EXPECT_NEAR(s.rows_used, 512 * 0.81, 15);
  ASSERT_EQ(s.outcomes.size(), 2u);
  EXPECT_EQ(s.outcomes[0].outcome, failed_outcome);
  EXPECT_NEAR(s.outcomes[0].share, 0.1, 0.01);
  EXPECT_NEAR(s.outcomes[0].inputs[0].total, 1, 0.1);
  EXPECT_NEAR(s.outputs[0][0].total, 1, 0.1);
  EXPECT_EQ(s.outputs[0][1].total, 0);
}

TEST(Sensitivity, KnowingAnInputNarrowsTheResult) {
  // y = 3 a + b: widths 6 and 2 of 8; outcome 1 for a > 1.5, which is possible to 0.5 unless a is known
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = x[0] > 1.5 ? 1 : 0;
    r.values = {3 * x[0] + x[1]};
    return r;
  });
  const Space space{{make_triangular(0, 1, 2), make_triangular(0, 1, 2)}, {}, {}};
  const Progress progress;
  Asker asker(model, progress, nullptr, 100000);
  const AlphaResult all = optimise(space, asker, {});
  const auto effects = find_effects_of_knowing(space, asker, all, {}, 3000);
  ASSERT_EQ(effects.size(), 2u);
  EXPECT_NEAR(effects[0].width[0], 0.25, 1e-9);
  EXPECT_NEAR(effects[0].entropy[0], 0.25, 1e-9);
  EXPECT_NEAR(effects[1].width[0], 0.75, 1e-9);
  ASSERT_EQ(effects[0].classes.size(), 1u) << "with a known nothing but outcome 0 is possible";
  ASSERT_EQ(effects[1].classes.size(), 2u);
  EXPECT_NEAR(effects[1].classes[1].possibility, 0.5, 1e-3);
}

TEST(Sensitivity, OutcomesOfKnowingAnInputTakeFewRuns) {
  // outcome 1 for a > 1.5, outcome 2 for a + b > 3.4: possible to 0.5 and 0.3; with b known to 0.5, and not at all
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = x[0] + x[1] > 3.4 ? 2 : x[0] > 1.5 ? 1 : 0;
    r.values = {x[0]};
    return r;
  });
  const Space space{{make_triangular(0, 1, 2), make_triangular(0, 1, 2)}, {}, {}};
  const Progress progress;
  Asker asker(model, progress, nullptr, 100000);
  (void)optimise(space, asker, {});
  const int before = asker.asked();
  const auto effects = find_outcomes_of_knowing(space, asker, {}, 100);
  EXPECT_LE(asker.asked(), before + 200);
  ASSERT_EQ(effects.size(), 2u);
  for (const Fixed& f : effects) ASSERT_EQ(f.classes.size(), 3u);
  EXPECT_EQ(effects[0].classes[1].possibility, 0) << "with a known nothing but outcome 0";
  EXPECT_FALSE(effects[0].classes[1].converged) << "there is no run from which to search";
  EXPECT_NEAR(effects[1].classes[1].possibility, 0.5, 1e-3);
  // what has converged takes no runs again
  const auto again = find_outcomes_of_knowing(space, asker, {}, 1000, effects);
  EXPECT_EQ(again[1].classes[1].sample, effects[1].classes[1].sample);
}

// An island that the most possible runs of its class do not reach, moved to the known value.
TEST(SensitivityPhysics, IslandsWithAnInputKnownAreFound) {
  const Evaluate model = make_evaluate([](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.outcome = std::pow(x[0] - .4, 2) - 2 * std::pow(x[1] + .3, 2) + std::pow(x[2], 3) >= 6 ? 1 : 0;
    r.values = {x[0]};
    return r;
  });
  const Space space{std::vector<FuzzyNumber>(3, make_triangular(-2, 0, 3)), {}, {}};
  const Progress progress;
  Asker asker(model, progress, nullptr, 20000);
  (void)optimise(space, asker, make_thrifty_options());
  const auto effects = find_outcomes_of_knowing(space, asker, {}, 2000);
  EXPECT_NEAR(effects[2].classes.at(1).possibility, (3 - .4 - std::sqrt(6.0)) / 3, 1e-3);
}

// Half spaces g·x > d on triangles <-1, 0, 1>: with x_i known 1 - d / Σ |g_k| over the others.
TEST(SensitivityPhysics, OutcomesOfKnowingAnInputHaveClosedForms) {
  for (int n = 2; n <= 6; ++n)
    for (int k = 0; k < 3; ++k) {
      Random random(100 * n + k);
      Point normal;
      double sum = 0;
      for (int i = 0; i < n; ++i) {
        normal.push_back(random.next(.3, 2) * (random.next() < .5 ? -1 : 1));
        sum += std::abs(normal.back());
      }
      const double d = sum * random.next(.35, .6);
      const Evaluate model = make_evaluate([&](const Point& x) {
        Result r;
        r.state = Result::State::Done;
        double at = 0;
        for (int i = 0; i < n; ++i) at += normal[i] * x[i];
        r.outcome = at > d ? 1 : 0;
        r.values = {x[0]};
        return r;
      });
      const Space space{std::vector<FuzzyNumber>(n, make_triangular(-1, 0, 1)), {}, {}};
      const Progress progress;
      Asker asker(model, progress, nullptr, 8000);
      (void)optimise(space, asker, {});
      asker.set_limit(100000);
      (void)find_possibilities(space, asker, {});
      for (const int limit : {250, 1500}) {
        const auto effects = find_outcomes_of_knowing(space, asker, {}, limit);
        ASSERT_EQ(effects.size(), static_cast<std::size_t>(n));
        for (const Fixed& f : effects) {
          double found = 0;
          bool is_converged = true;
          for (const Possibility& c : f.classes)
            if (c.outcome == 1) found = c.possibility, is_converged = c.converged;
          const double want = std::max(0.0, 1 - d / (sum - std::abs(normal[f.input])));
          EXPECT_NEAR(found, want, 1e-3) << n << " inputs, case " << k << ", known " << f.input;
          EXPECT_TRUE(is_converged == (found > 0) || limit < 1500);
        }
      }
    }
}

// No search asks for a point that breaks a constraint, beside a failure as little as with an input known.
TEST(Sensitivity, ModelIsNeverRunBeyondAConstraint) {
  const Space space{
      std::vector<FuzzyNumber>(3, make_triangular(0, 1, 2)),
      {[](const Point& x) { return x[0] + x[1] + x[2] - 3.3; }, [](const Point& x) { return 0.5 - x[0] * x[1]; }},
      {}};
  int asked = 0, broken = 0;
  const Evaluate model = make_evaluate([&](const Point& x) {
    ++asked;
    broken += !is_allowed(space, x);
    Result r;
    r.state = x[0] + x[1] - x[2] > 1.9 ? Result::State::Failed : Result::State::Done;
    r.outcome = x[0] - x[2] > 0.7 ? 1 : 0;
    r.values = {x[0] * x[1] + x[2] - (r.outcome == 1 ? 2 : 0)};
    return r;
  });
  const Progress progress;
  Asker asker(model, progress, nullptr, 6000);
  AlphaOptions options;
  options.limit = 3000;
  asker.set_limit(3000);
  (void)optimise(space, asker, options);
  asker.set_limit(6000);
  (void)find_possibilities(space, asker, {});
  (void)find_outcomes_of_knowing(space, asker, {}, 500, {});
  EXPECT_GT(asked, 2000);
  EXPECT_EQ(broken, 0) << "of " << asked;
}

TEST(Sensitivity, RefusesInteraction) {
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const Space disc{{f, f}, {[](const Point& x) { return x[0] * x[0] + x[1] * x[1] - 1; }}, {}};
  const Progress progress;
  Asker asker(make_evaluate_values([](const Point& x) { return x; }), progress);
  EXPECT_THROW(find_drivers(disc, asker, {}), InputError);
}

}  // namespace
}  // namespace topple::uncertainty
