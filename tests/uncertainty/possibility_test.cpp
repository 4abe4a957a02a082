#include "uncertainty/possibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "reference_cases.h"

namespace topple::uncertainty {
namespace {

struct Found {
  AlphaResult bounds;
  PossibilityResult possibilities;
  int asked = 0;
};

Found find(const Space& space, const Evaluate& model, std::uint64_t seed = 1, const PossibilityOptions& given = {}) {
  const Progress progress;
  Asker asker(model, progress, nullptr, 20000);
  AlphaOptions options;
  options.patience = 1;
  options.seed = seed;
  PossibilityOptions own = given;
  own.seed = seed;
  Found f;
  f.bounds = optimise(space, asker, options);
  f.possibilities = find_possibilities(space, asker, own);
  f.asked = asker.asked();
  EXPECT_EQ(f.possibilities.ending, Ending::Complete);
  return f;
}

Evaluate make_classes(std::function<int(const Point&)> outcome) {
  return make_evaluate([outcome](const Point& x) {
    Result r;
    r.outcome = outcome(x);
    r.state = r.outcome == failed_outcome ? Result::State::Failed : Result::State::Done;
    r.values = {x[0]};
    return r;
  });
}

// x1 x2 / 100 < 8 is possible to .456598936: both inputs at the left ends of that cut.
TEST(PossibilityReference, OfTheJump) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Found f = find(Space{cases::make_jump_inputs(), {}, {}}, make_evaluate(cases::calc_jump), seed);
    ASSERT_EQ(f.possibilities.classes.size(), 2u);
    EXPECT_EQ(f.possibilities.classes[0].possibility, 1);
    const Possibility& p = f.possibilities.classes[1];
    EXPECT_NEAR(p.possibility, .456598936, 1e-3);
    EXPECT_LE(p.possibility, .456598936 + 1e-9) << "a run has it, so it is never too high";
    EXPECT_TRUE(p.converged);
    EXPECT_NEAR(calc_necessity(f.possibilities, 0), 1 - .456598936, 1e-3);
    EXPECT_EQ(calc_necessity(f.possibilities, 1), 0);
    EXPECT_LE(f.asked, 10000);
  }
}

// A plane a·v >= b in n symmetric triangles is touched first by the corner of the cut at t = b / Σ|a_i|.
TEST(PossibilityPhysics, OfAHalfSpaceHasAClosedForm) {
  for (const int n : {1, 2, 3, 5, 8}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Point a;
      double sum = 0;
      for (int i = 0; i < n; ++i) a.push_back(std::cos(2.0 * i + static_cast<double>(seed))), sum += std::abs(a[i]);
      const double b = 0.43 * sum;
      const Space space{std::vector<FuzzyNumber>(n, make_triangular(-1, 0, 1)), {}, {}};
      const Found f = find(space, make_classes([&](const Point& x) {
                             double s = 0;
                             for (int i = 0; i < n; ++i) s += a[i] * x[i];
                             return s >= b ? 7 : 2;
                           }),
                           seed);
      ASSERT_EQ(f.possibilities.classes.size(), 2u);
      EXPECT_EQ(f.possibilities.classes[1].outcome, 7);
      EXPECT_NEAR(f.possibilities.classes[1].possibility, 0.57, 1e-3) << n << " inputs";
    }
  }
}

// A ball around a point off all axes and corners: its highest μ is at the place of the ball that is nearest to the core
// in the largest norm; here along the first axis.
// A cut of trapezoids does not grow evenly from its middle; the corner nearest to the core reaches the half space at
// (5.37898 - limit) / 4.06132.
TEST(PossibilityPhysics, OfAHalfSpaceOverTrapezoids) {
  const Space space{{make_trapezoidal(-1.899, -0.711, 0.191, 1.005), make_trapezoidal(-1.879, -1.508, -0.511, 1.869),
                     make_trapezoidal(-0.287, 0.095, 0.631, 1.491), make_trapezoidal(-0.623, -0.578, 0.361, 0.735)},
                    {},
                    {}};
  for (const double limit : {1.9536, 3.0, 4.2}) {
    const Evaluate model = [limit](std::span<const Point> batch, std::span<Result> out) {
      for (std::size_t k = 0; k < batch.size(); ++k) {
        const Point& x = batch[k];
        const double s = 0.08 * x[0] + 1.06 * x[1] + 1.64 * x[2] - 1.4 * x[3];
        out[k] = {Result::State::Done, {s}, s > limit ? 1 : 0, {}, ""};
      }
    };
    const Progress progress;
    Asker asker(model, progress, nullptr, 100000);
    std::vector<Point> points;
    for (const auto& u : make_sobol_points(4, 1, 320, 1)) points.push_back(place_in(make_box(space, 0), u));
    asker.ask(points);
    const int before = asker.asked();
    const PossibilityResult r = find_possibilities(space, asker, {});
    EXPECT_NEAR(calc_possibility_of(r, {1}), (5.37898 - limit) / 4.06132, 2e-4) << limit;
    EXPECT_LT(asker.asked() - before, 3000) << limit;
  }
}

TEST(PossibilityPhysics, OfABall) {
  const Space space{std::vector<FuzzyNumber>(3, make_triangular(-1, 0, 1)), {}, {}};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Found f = find(space, make_classes([](const Point& x) {
                           const double d = std::hypot(x[0] - 0.7, x[1] + 0.2, x[2] - 0.1);
                           return d < 0.25 ? 1 : 0;
                         }),
                         seed);
    ASSERT_EQ(f.possibilities.classes.size(), 2u);
    EXPECT_NEAR(f.possibilities.classes[1].possibility, 1 - 0.45, 1e-3) << "seed " << seed;
  }
}

// ... and where the surface is curved: |x - c| <= r with c = (0.6, 0.5): the cut's corner (t, t) with
// (0.6 - t)² + (0.5 - t)² = r².
TEST(PossibilityPhysics, OfADiscAtACorner) {
  const Space space{std::vector<FuzzyNumber>(2, make_triangular(-1, 0, 1)), {}, {}};
  const double r = 0.3, t = 0.55 - std::sqrt(0.55 * 0.55 - (0.36 + 0.25 - r * r) / 2);
  const Found f =
      find(space, make_classes([&](const Point& x) { return std::hypot(x[0] - 0.6, x[1] - 0.5) <= r ? 1 : 0; }));
  EXPECT_NEAR(f.possibilities.classes[1].possibility, 1 - t, 1e-3);
}

// Classes by the value of a run instead of its outcome: a half space, a ball, either of two half spaces and both.
TEST(PossibilityPhysics, OfOtherClassesThanOutcomes) {
  const Space space{std::vector<FuzzyNumber>(3, make_triangular(-1, 0, 1)), {}, {}};
  const auto judge = [&](const std::function<double(const Point&)>& value, const char* what, double possibility) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      PossibilityOptions options;
      options.classify = [](const Result& r) { return r.values[0] > 0 ? 5 : 3; };
      options.skipped = {3};
      const Found f = find(space, make_evaluate_values([&](const Point& x) { return std::vector<double>{value(x)}; }),
                           seed, options);
      ASSERT_EQ(f.possibilities.classes.size(), 1u) << "the other class is left out";
      EXPECT_EQ(f.possibilities.classes[0].outcome, 5);
      EXPECT_NEAR(f.possibilities.classes[0].possibility, possibility, 1e-3) << what << ", seed " << seed;
      EXPECT_TRUE(f.possibilities.classes[0].converged);
    }
  };
  judge([](const Point& x) { return x[0] - 0.5 * x[1] + 0.3 * x[2] - 1.2798; }, "half space", 0.289);
  judge([](const Point& x) { return 0.25 - std::hypot(x[0] - 0.7, x[1] + 0.2, x[2] - 0.1); }, "ball", 0.55);
  judge([](const Point& x) { return std::max(x[0] + x[1] + x[2] - 1.2, x[0] - x[1] - 0.9); }, "one of two", 0.6);
  // t + (t - 0.2) + t >= 1.2
  judge([](const Point& x) { return std::min(x[0] + x[1] + x[2] - 1.2, x[0] - x[1] - 0.2); }, "both", 1 - 1.4 / 3);
}

// Valleys of every input cross in islands; the highest one, at .8210, is not that of the best spread run.
TEST(PossibilityPhysics, OfTheHighestOfManyIslands) {
  const Space space{std::vector<FuzzyNumber>(4, make_triangular(-2, 0, 3)), {}, {}};
  const Evaluate model = make_classes([](const Point& x) {
    return std::sin(5 * x[0]) + std::cos(3 * x[1] + 1) + .2 * x[1] + std::sin(4 * x[2] + 2) + .3 * x[3] * x[3] <= -2.6;
  });
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Found f = find(space, model, seed);
    ASSERT_EQ(f.possibilities.classes.size(), 2u);
    EXPECT_NEAR(f.possibilities.classes[1].possibility, 0.821002, 1e-3) << "seed " << seed;
    EXPECT_TRUE(f.possibilities.classes[1].converged);
  }
}

// Thin plates that lean, most possible where x1 = .45: a run of one leaves it when it is pulled towards the middle of
// the inputs, as those of the half space beside it do not, which is less possible.
TEST(PossibilityPhysics, OfAThinIslandBesideALargeOne) {
  const Space space{std::vector<FuzzyNumber>(3, make_triangular(-1, 0, 1)), {}, {}};
  const struct {
    Point slope;
    double middle;
    Point known;
  } all[] = {{{1, 1, -.3}, .9, {.95, .02, .23}}, {{1, 1, 1}, 1, {.95, -.3, .35}}};
  for (const auto& plate : all) {
    const Evaluate model = make_classes([&plate](const Point& x) {
      const double along = std::inner_product(x.begin(), x.end(), plate.slope.begin(), -plate.middle);
      return x[0] < -.5 || (x[0] > .45 && std::abs(along) < .02) ? 1 : 0;
    });
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Progress progress;
      Asker asker(model, progress, nullptr, 5000);
      asker.ask({calc_centre(space), {-.9, .3, .2}, plate.known});
      PossibilityOptions o;
      o.seed = seed;
      const PossibilityResult r = find_possibilities(space, asker, o);
      ASSERT_EQ(r.classes.size(), 2u);
      const Possibility& p = r.classes[1];
      EXPECT_NEAR(p.possibility, .55, 1e-3) << "seed " << seed;
      EXPECT_TRUE(p.converged);
      ASSERT_FALSE(p.summits.empty());
      for (const int at : p.summits) EXPECT_NEAR(asker.archive()[at].x[0], -.5, 1e-3) << "the half space's";
    }
  }
}

// Wedges and corners of two and three half spaces; linear programmes give the level at which the cut touches them.
TEST(PossibilityPhysics, OfAWedgeOfHalfSpaces) {
  struct Case {
    std::vector<Point> rows;
    Point ends;
    double possibility;
  };
  const Case all[] = {
      {{{.12, .13, -.66, .73}, {-.75, -.05, .64, -.17}}, {0, -.29}, .550887},
      {{{.122778, .130496, -.656849, .732425}, {-.748323, -.047672, .638204, -.17446}}, {.00089, -.287237}, .550310},
      {{{-.171022, .388073, .514021, .745609},
        {.117542, -.27265, .81314, .500649},
        {-.181211, -.912223, -.153697, -.333749}},
       {.892534, .74939, -1.045029},
       .634027},
  };
  const Space space{std::vector<FuzzyNumber>(4, make_triangular(0, .5, 1)), {}, {}};
  for (const Case& c : all) {
    const Evaluate model = make_classes([&c](const Point& x) {
      for (std::size_t j = 0; j < c.rows.size(); ++j)
        if (std::inner_product(x.begin(), x.end(), c.rows[j].begin(), 0.0) > c.ends[j]) return 0;
      return 1;
    });
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Found f = find(space, model, seed);
      ASSERT_EQ(f.possibilities.classes.size(), 2u);
      EXPECT_NEAR(f.possibilities.classes[1].possibility, c.possibility, 2e-4) << "seed " << seed;
    }
  }
}

TEST(Possibility, KeepsWhatIsKnownUntilARunIsMorePossible) {
  const Space space{{make_triangular(-1, 0, 1), make_triangular(-1, 0, 1)}, {}, {}};
  const Evaluate model = make_classes([](const Point& x) { return x[0] > 0.6 || x[1] < -0.7; });
  const Progress progress;
  Asker asker(model, progress, nullptr, 20000);
  asker.ask({{0, 0}, {0.9, 0.1}});
  PossibilityOptions o;
  o.known = find_possibilities(space, asker, o).classes;
  EXPECT_NEAR(o.known.at(1).possibility, 0.4, 1e-3);
  const int before = asker.asked();
  const PossibilityResult same = find_possibilities(space, asker, o);
  EXPECT_EQ(asker.asked(), before);
  EXPECT_EQ(same.classes.at(1).sample, o.known[1].sample);
  EXPECT_EQ(same.classes[1].resolution, o.known[1].resolution);
  EXPECT_TRUE(same.classes[1].converged);
  o.known[1].possibility = 0.3;  // less than its runs show
  (void)find_possibilities(space, asker, o);
  EXPECT_GT(asker.asked(), before);
}

TEST(Possibility, ReadsWhatRunsShowWithoutASearch) {
  const Space space{{make_triangular(-1, 0, 1)}, {}, {}};
  Archive archive;
  for (const double x : {0.0, 0.2, 0.5, 0.75}) archive.add({{x}, {Result::State::Done, {x}, x > 0.4 ? 1 : 0, {}, ""}});
  const Possibility p = read_possibility(space, archive, 1);
  EXPECT_EQ(p.possibility, 0.5);
  EXPECT_EQ(p.above, 2);
  EXPECT_EQ(p.sample, 2);
  EXPECT_EQ(p.resolution, 0.5) << "only the core is known to be of another class";
  EXPECT_FALSE(p.converged);
  PossibilityResult r;
  r.classes = {read_possibility(space, archive, 0), p};
  EXPECT_TRUE(r.classes[0].converged);
  EXPECT_FALSE(is_necessity_converged(r, 0));
  EXPECT_TRUE(is_necessity_converged(r, 1)) << "it is 0";
}

TEST(Possibility, CountsFailedRunsAsAClass) {
  const Space space{std::vector<FuzzyNumber>(2, make_triangular(0, 1, 2)), {}, {}};
  const Found f = find(space, make_classes([](const Point& x) {
                         if (x[0] > 1.6) return failed_outcome;
                         return x[1] < 0.3 ? 1 : 0;
                       }));
  ASSERT_EQ(f.possibilities.classes.size(), 3u);
  EXPECT_EQ(f.possibilities.classes[0].outcome, failed_outcome);
  EXPECT_NEAR(f.possibilities.classes[0].possibility, 0.4, 1e-3);
  EXPECT_EQ(f.possibilities.classes[1].possibility, 1);
  EXPECT_NEAR(f.possibilities.classes[2].possibility, 0.3, 1e-3);
  EXPECT_NEAR(calc_possibility_of(f.possibilities, {failed_outcome, 1}), 0.4, 1e-3);
  EXPECT_EQ(calc_possibility_of(f.possibilities, {}), 0);
}

TEST(Possibility, OfTrapezoidsWhoseCoreHoldsTwoClasses) {
  const Space space{{make_trapezoidal(0, 1, 2, 3)}, {}, {}};
  const Found f = find(space, make_classes([](const Point& x) { return x[0] > 1.7 ? 1 : 0; }));
  EXPECT_EQ(f.possibilities.classes[0].possibility, 1);
  EXPECT_EQ(f.possibilities.classes[1].possibility, 1);
  EXPECT_EQ(calc_necessity(f.possibilities, 0), 0);
}

TEST(Possibility, RespectsInteraction) {
  // x + y <= 1 keeps the pair out of the corner: the class x + y > 0.9 is touched at (0.45, 0.45) all the same,
  // the class x > 0.8 needs y <= 0.2 and is possible to 0.2
  const FuzzyNumber f = make_triangular(-1, 0, 1);
  const Space space{{f, f}, {[](const Point& x) { return x[0] + x[1] - 1; }}, {}};
  const Found a = find(space, make_classes([](const Point& x) { return x[0] + x[1] > 0.9 ? 1 : 0; }));
  EXPECT_NEAR(a.possibilities.classes[1].possibility, 0.55, 1e-3);
  const Found b = find(space, make_classes([](const Point& x) { return x[0] > 0.8 ? 1 : 0; }));
  EXPECT_NEAR(b.possibilities.classes[1].possibility, 0.2, 1e-3);
}

// A joint membership with kinks: the most possible place lies on edges of cuts that are no boxes.
TEST(PossibilityPhysics, UnderAJointMembershipWithEdges) {
  Space space{
      {make_triangular(0, 3, 10), make_triangular(0, 6, 10), make_triangular(0, 5, 10)}, {}, [](const Point& x) {
        return std::max(0.0, 1 - std::max(std::abs(x[0] - x[1] + 3) / 4, std::abs(x[1] - x[2] - 1) / 3));
      }};
  const auto is_over = [](const Point& x) { return x[0] + 0.5 * x[1] - x[2] > 4 ? 1 : 0; };
  const auto is_in_ball = [](const Point& x) {
    return std::pow(x[0] - 6, 2) + std::pow(x[1] - 8, 2) + std::pow(x[2] - 4, 2) < 1.5 ? 1 : 0;
  };
  EXPECT_NEAR(find(space, make_classes(is_over)).possibilities.classes[1].possibility, 11.0 / 17, 1e-5);
  // found by evolution with adapted covariances from 60 starts
  EXPECT_NEAR(find(space, make_classes(is_in_ball)).possibilities.classes[1].possibility, 0.574146, 1e-5);
  space.constraints.push_back([](const Point& x) { return x[0] + x[1] + x[2] - 17; });
  EXPECT_NEAR(find(space, make_classes(is_over)).possibilities.classes[1].possibility, 26.0 / 41, 1e-5);
}

// Most of the class lies on a plateau at 0.4; what is more possible is a sliver at its edge, up to where x y = 6, x is
// at the end of its cut, x = 3μ, and the joint membership is μ as well.
TEST(PossibilityPhysics, BesideAPlateau) {
  double low = 0.4, high = 0.42;
  while (high - low > 1e-12) {
    const double mu = 0.5 * (low + high);
    (1.6 - std::sqrt(std::pow(3 * mu - 3, 2) + 2 * std::pow(2 / mu - 6, 2)) / 2 > mu ? low : high) = mu;
  }
  const Space space{{make_triangular(0, 3, 10), make_triangular(0, 6, 10)}, {}, [](const Point& x) {
                      const double r = std::sqrt(std::pow(x[0] - 3, 2) + 2 * std::pow(x[1] - 6, 2));
                      return std::min(1.0, std::max(0.4, 1.6 - r / 2));
                    }};
  const Evaluate model = make_classes([](const Point& x) { return x[0] * x[1] < 6 ? 1 : 0; });
  for (const std::uint64_t seed : {1, 2, 3})
    EXPECT_NEAR(find(space, model, seed).possibilities.classes[1].possibility, low, 3e-5) << seed;
}

// x + y + z = 14 as two constraints that leave round-off: x = 10 - 7α and z = 5α differ by 3 at 7/12.
TEST(PossibilityPhysics, OnAPlaneThatConstraintsLeave) {
  const auto calc_excess = [](double a, double b) { return a - b - 1e-12 * std::max(a, b); };
  const Space space{{make_triangular(0, 3, 10), make_triangular(0, 6, 10), make_triangular(0, 5, 10)},
                    {[=](const Point& x) { return calc_excess(x[0] + x[1] + x[2], 14); },
                     [=](const Point& x) { return calc_excess(14, x[0] + x[1] + x[2]); }},
                    {}};
  const Found f = find(space, make_classes([](const Point& x) { return x[0] - x[2] > 3 ? 1 : 0; }));
  EXPECT_NEAR(f.possibilities.classes[1].possibility, 7.0 / 12, 1e-5);
}

TEST(PossibilityReplay, ResumedEqualsUninterrupted) {
  const Space space{cases::make_jump_inputs(), {}, {}};
  const Progress progress;
  const auto run = [&](Asker& asker) {
    optimise(space, asker, make_thrifty_options());
    return find_possibilities(space, asker, {});
  };
  Asker whole(make_evaluate(cases::calc_jump), progress);
  const PossibilityResult want = run(whole);
  // an archive that ends somewhere in the second analysis, as a stored study does
  for (const int kept : {300, whole.asked() - 100}) {
    Archive part;
    for (int i = 0; i < kept; ++i) part.add(whole.archive()[i]);
    Asker resumed(make_evaluate(cases::calc_jump), progress, &part);
    const PossibilityResult got = run(resumed);
    EXPECT_EQ(resumed.run(), whole.asked() - kept) << "nothing is run twice";
    ASSERT_EQ(got.classes.size(), want.classes.size());
    for (std::size_t k = 0; k < got.classes.size(); ++k) {
      EXPECT_EQ(got.classes[k].possibility, want.classes[k].possibility);
      EXPECT_EQ(got.classes[k].resolution, want.classes[k].resolution);
      EXPECT_EQ(got.classes[k].sample, want.classes[k].sample);
    }
  }
}

// A ball far from the core, which rays around a place in it miss: the smallest cut touches it with a corner.
TEST(PossibilityPhysics, SmallBallsAreTouchedByACorner) {
  for (const int n : {4, 6, 8}) {
    const Evaluate model = make_evaluate([](const Point& x) {
      double square = 0;
      for (const double v : x) square += (v - .75) * (v - .75);
      Result r;
      r.state = Result::State::Done;
      r.outcome = square < .04 ? 1 : 0;
      r.values = {x[0]};
      return r;
    });
    const Space space{std::vector<FuzzyNumber>(n, make_triangular(-1, 0, 1)), {}, {}};
    const Progress progress;
    Asker asker(model, progress, nullptr, 600);
    Point x(n, .7);
    x[0] = .85, x[1] = .8;
    asker.ask({calc_centre(space), x});
    const PossibilityResult r = find_possibilities(space, asker, {});
    ASSERT_EQ(r.classes.size(), 2u);
    EXPECT_NEAR(r.classes[1].possibility, 1 - (.75 - .2 / std::sqrt(static_cast<double>(n))), 1e-3) << n << " inputs";
  }
}

TEST(Possibility, StopsAtTheLimitAndSaysSo) {
  const Space space{cases::make_jump_inputs(), {}, {}};
  const Progress progress;
  Asker asker(make_evaluate(cases::calc_jump), progress, nullptr, 520);
  optimise(space, asker, make_thrifty_options());
  const PossibilityResult r = find_possibilities(space, asker, {});
  EXPECT_EQ(r.ending, Ending::LimitReached);
  EXPECT_LE(asker.asked(), 520);
  for (const auto& c : r.classes) EXPECT_EQ(c.converged, c.possibility == 1);
}

}  // namespace
}  // namespace topple::uncertainty
