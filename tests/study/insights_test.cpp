#include "study/insights.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "../uncertainty/reference_cases.h"
#include "base/error.h"
#include "server.h"
#include "small_study.h"
#include "study/fans.h"
#include "study/page.h"
#include "study/permissible.h"
#include "study/randomness.h"
#include "study/results.h"
#include "study/story.h"

namespace topple::study {
namespace {

using json = nlohmann::json;
using uncertainty::make_triangular;

StudyResult run(const Problem& p, const Folder& folder, const char* name, const RunnerFactories& factories) {
  StudyOptions o;
  o.store = folder / name;
  o.pool.jobs = 2;
  o.pool.batch = 16;
  return run_study(p, factories, o, {}, {});
}

/// The reference case "jump" without its failing corner.
Answer calc_jump(const Point& x) {
  const double R = x[0] * x[1] / 100;
  return done({{"z", R - 8 - (R < 8 ? 10 : 0)}}, R < 8 ? "falls" : "stands", {0, R});
}

TEST(Budget, SharesRunsOutAndNeverPassesTheLimit) {
  for (const int limit : {10, 100, 300, 3000, 10000})
    for (const bool has_boxes : {false, true})
      for (const bool has_drivers : {false, true}) {
        Problem p = make_small_problem(limit);
        p.permissible = has_boxes ? "stands" : "";
        p.has_drivers = has_drivers;
        EXPECT_EQ(calc_budget(p, limit).of_limit, 0);
        p.limits.resize(3);
        const Budget b = calc_budget(p, limit);
        EXPECT_LE(3 * b.of_limit, b.outcomes / 8) << limit;
        EXPECT_EQ(b.of_limit > 0, limit >= 100) << limit;
        EXPECT_LE(4 * b.rows + b.spread, b.bounds) << limit;
        EXPECT_LE(b.bounds, b.possibilities);
        EXPECT_EQ(b.possibilities + b.knowing, b.outcomes);
        EXPECT_LE(b.outcomes, b.limit);
        EXPECT_EQ(b.outcomes == b.limit, !has_boxes);
        EXPECT_LE(b.outcomes + 3 * b.requirement, b.limit) << "boxes keep most of theirs";
        EXPECT_EQ(b.in_boxes > 0, has_boxes && limit >= 3000) << limit;
        EXPECT_LE(b.outcomes + 6 * b.in_boxes, b.limit);
        EXPECT_EQ(b.rows + b.spread + b.knowing > 0, has_drivers);
        EXPECT_GT(b.bounds, limit / 4);
      }
}

// Ishigami & Homma (1990), a = 7, b = 0.1: first shares 0.3139, 0.4424, 0 in closed form.
TEST(InsightsReference, DriversOfIshigamiWithTheirErrors) {
  const Folder folder;
  Problem p = make_problem(uncertainty::cases::make_all()[2].inputs, 4000);
  const RunnerFactories model = make_factories([](const Point& x) {
    return done({{"y", std::sin(x[0]) + 7 * std::pow(std::sin(x[1]), 2) + 0.1 * std::pow(x[2], 4) * std::sin(x[0])}},
                "");
  });
  const double want[] = {0.3139, 0.4424, 0};
  for (const int limit : {4000, 400}) {
    p.limit = limit;
    const StudyResult r = run(p, folder, ("s" + std::to_string(limit)).c_str(), model);
    EXPECT_EQ(r.insights.source, limit == 4000 ? Insights::Source::Design : Insights::Source::Spread);
    ASSERT_EQ(r.insights.drivers.outputs.size(), 1u);
    for (int i = 0; i < 3; ++i) {
      const uncertainty::Driver& d = r.insights.drivers.outputs[0][i];
      // three standard errors
      EXPECT_NEAR(d.first, want[i], 3 * d.first_error) << limit << " input " << i;
      EXPECT_LT(d.first_error, limit == 4000 ? 0.08 : 0.15);
    }
    EXPECT_FALSE(is_share_known(r.insights.drivers.outputs[0][2])) << "nothing is known of an input that does nothing";
    EXPECT_EQ(std::isfinite(r.insights.drivers.outputs[0][0].total), limit == 4000);
  }
  p.limit = 60;
  EXPECT_EQ(run(p, folder, "few", model).insights.source, Insights::Source::None) << "18 spread runs tell nothing";
}

// y = 3 a + b, uniform over equal supports: shares 0.9 and 0.1.
TEST(InsightsPhysics, DriversOfASumHaveClosedForms) {
  const Folder folder;
  const Problem p = make_problem({make_triangular(0, 1, 2), make_triangular(0, 1, 2)}, 600);
  const StudyResult r = run(p, folder, "s", make_factories([](const Point& x) {
                              return done({{"y", 3 * x[0] + x[1]}}, x[0] > 1.5 ? "far" : "near");
                            }));
  const auto& d = r.insights.drivers.outputs.at(0);
  EXPECT_NEAR(d[0].first, 0.9, 3 * d[0].first_error);
  EXPECT_NEAR(d[1].first, 0.1, 3 * d[1].first_error);
  const std::vector<uncertainty::Rank> ranks = uncertainty::calc_ranks(d);
  EXPECT_EQ(ranks[0].best, 1);
  EXPECT_EQ(ranks[0].worst, 1);
  EXPECT_EQ(ranks[1].best, 2);
  // "far" is possible to 0.5 unless a is known
  ASSERT_EQ(r.insights.knowing.size(), 2u);
  for (const uncertainty::Possibility& c : r.insights.knowing[0].classes)
    EXPECT_EQ(c.possibility, name_of_outcome(r, c.outcome) == "far" ? 0 : 1);
  ASSERT_EQ(r.insights.knowing[1].classes.size(), 2u);
  for (const uncertainty::Possibility& c : r.insights.knowing[1].classes)
    EXPECT_NEAR(c.possibility, name_of_outcome(r, c.outcome) == "far" ? 0.5 : 1, 1e-3);
  // the value that parts both outcomes
  for (const Split& s : find_splits(p.space, r.alpha.archive, r.spread)) {
    EXPECT_EQ(s.input, 0);
    EXPECT_NEAR(s.value, 1.5, 2.0 / 50);  // gaps between spread values of one input
    EXPECT_NEAR(s.gain, 1, 1e-12);
  }
}

TEST(Ranks, LeavePlacesOpenWhereErrorsDo) {
  const auto ranks = uncertainty::calc_ranks({{0.5, 0, 0.1, 0}, {0.4, 0, 0.1, 0}, {0.01, 0, 0.02, 0}});
  EXPECT_EQ(ranks[0].best, 1);
  EXPECT_EQ(ranks[0].worst, 2);
  EXPECT_EQ(ranks[1].best, 1);
  EXPECT_EQ(ranks[1].worst, 2);
  EXPECT_EQ(ranks[2].best, 3);
}

TEST(Permissible, ReadsOutcomesAndLimits) {
  Problem p = make_small_problem();
  p.outputs = {{"tilt_1.7", "deg", 0.01}, {"reach", "m", 1}};
  p.outcomes = {"topple", "wrong direction"};
  const Permissible a = read_permissible(" topple , \"wrong direction\", reach<=20 m, tilt_1.7 > 3", p);
  EXPECT_EQ(a.outcomes, (std::vector<std::string>{"topple", "wrong direction"}));
  ASSERT_EQ(a.limits.size(), 2u);
  EXPECT_TRUE(a.limits[0].is_most);
  EXPECT_EQ(a.limits[0].value, 20);
  EXPECT_FALSE(a.limits[1].is_most);
  EXPECT_FALSE(a.limits[0].is_strict);
  EXPECT_TRUE(a.limits[1].is_strict);
  EXPECT_DOUBLE_EQ(a.limits[1].value, 0.03) << "in what results hold";
  const auto g = make_requirement(a, {"reach", "tilt_1.7"}, {"stands", "topple"});
  const auto margin = [&g](double reach, double tilt, int outcome) {
    return g({uncertainty::Result::State::Done, {reach, tilt}, outcome, {}, ""});
  };
  EXPECT_DOUBLE_EQ(margin(15, 0.06, 1), 0.25);
  EXPECT_LT(margin(21, 0.06, 1), 0);
  EXPECT_LT(margin(15, 0.02, 1), 0);
  EXPECT_EQ(margin(15, 0.06, 0), -1);
  EXPECT_EQ(margin(20, 0.06, 1), 0) << "at most 20 holds at 20";
  EXPECT_LT(margin(15, a.limits[1].value, 1), 0) << "above 3 does not hold at 3";
  EXPECT_GT(margin(15, std::nextafter(a.limits[1].value, 1), 1), 0);
  const auto below = make_requirement(read_permissible("reach < 0", p), {"reach"}, {});
  EXPECT_LT(below({uncertainty::Result::State::Done, {0}, 0, {}, ""}), 0);
  EXPECT_GT(below({uncertainty::Result::State::Done, {-1e-300}, 0, {}, ""}), 0);
}

// n = floor(4 x) on x = <0, 0.5, 1>: n > 1 holds on the half x >= 0.5, n < 2 on the other, n >= 1 on three quarters.
TEST(InsightsReference, BoxesKeepStrictLimits) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.3, 1), make_triangular(0, 0.5, 1)}, 1500);
  const RunnerFactories model = make_factories([](const Point& x) { return done({{"n", std::floor(4 * x[0])}}, ""); });
  struct Case {
    const char* text;
    double part, lower, upper;
  };
  for (const Case& c : {Case{"n > 1", 0.5, 0.5, 1}, Case{"n < 2", 0.5, 0, 0.5}, Case{"n >= 1", 0.75, 0.25, 1}}) {
    p.permissible = c.text;
    const StudyResult r = run(p, folder, c.text, model);
    const uncertainty::DesignResult& d = r.insights.boxes;
    EXPECT_NEAR(d.fraction, c.part, 3 * d.fraction_error) << c.text;
    ASSERT_FALSE(d.boxes.empty());
    const uncertainty::PermissibleBox& b = d.boxes.front();
    ASSERT_TRUE(b.kept) << c.text;
    EXPECT_GE(b.box.lower[0], c.lower) << c.text;
    EXPECT_LE(b.box.upper[0], c.upper) << c.text;
    for (const auto& s : r.alpha.archive.samples()) {
      const double n = s.result.values[0];
      if (c.text == std::string("n > 1") ? n > 1 : c.text == std::string("n < 2") ? n < 2 : n >= 1) continue;
      EXPECT_FALSE(b.box.contains(s.x)) << c.text << " " << s.x[0];
    }
    EXPECT_NEAR(b.volume, c.part, 0.05) << c.text;
    std::string told;
    for (const Sentence& s : tell(p, r)) told += s.text;
    // n = 1 at the core
    EXPECT_NE(
        told.find(std::string("core values ") + (c.lower == 0.5 ? "break" : "keep") + " the requirement " + c.text),
        std::string::npos)
        << told;
  }
}

TEST(Permissible, ComplainsWithTheNamesThatAreThere) {
  Problem p = make_small_problem();
  p.outputs = {{"reach_pos_x", "m", 1}};
  p.outcomes = {"topple", "vertical"};
  const auto message_of = [&p](const std::string& text) -> std::string {
    try {
      (void)read_permissible(text, p);
    } catch (const InputError& e) { return e.diagnostics().front().message + " | " + e.diagnostics().front().help; }
    return "nothing";
  };
  EXPECT_NE(message_of("tople").find("did you mean \"topple\""), std::string::npos);
  EXPECT_NE(message_of("reach_pos_y < 3").find("reach_pos_x"), std::string::npos);
  EXPECT_NE(message_of("reach_pos_x < 3 km").find("shown in m"), std::string::npos);
  EXPECT_NE(message_of("reach_pos_x < many").find("a number is wanted"), std::string::npos);
  EXPECT_NE(message_of("topple,,").find("empty"), std::string::npos);
  EXPECT_NE(message_of("\"topple").find("quote"), std::string::npos);
  EXPECT_NE(message_of("< 3").find("output"), std::string::npos);
  EXPECT_NE(message_of("r=0.3").find("r <= 0.3"), std::string::npos);
  EXPECT_EQ(message_of("reach_pos_x <= 3"), "nothing");
  EXPECT_EQ(message_of("topple"), "nothing");
  p.random = std::make_shared<const Randomness>();
  EXPECT_NE(message_of("topple").find("p(topple) >= 0.95"), std::string::npos);
  p.random = nullptr;
  EXPECT_EQ(read_permissible("\"a=b\"", make_small_problem()).outcomes.at(0), "a=b");
  // what has not happened is kept by nothing
  const auto never = make_requirement(read_permissible("other", make_small_problem()), {"z"}, {"falls"});
  EXPECT_LT(never({uncertainty::Result::State::Done, {1}, 0, {}, ""}), 0);
  EXPECT_THROW(make_requirement(read_permissible("zz < 3", make_small_problem()), {"z"}, {"falls"}), InputError);
}

TEST(Permissible, IsRefusedAfterTheFirstAnswerOrSaysThatItNeverHappened) {
  const Folder folder;
  Problem p = make_small_problem(2000);
  p.permissible = "zz <= 3";
  std::atomic<int> runs = 0;
  const RunnerFactories factories = make_factories([&runs](const Point& x) {
    ++runs;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return calc_small(x);
  });
  try {
    run(p, folder, "a", factories);
    FAIL() << "accepted";
  } catch (const InputError& e) { EXPECT_EQ(e.diagnostics().front().code, "E825"); }
  EXPECT_LT(runs, 200);
  p = make_small_problem(600);
  p.permissible = "flies";
  const StudyResult r = run(p, folder, "b", make_small_factories());
  EXPECT_TRUE(r.is_finished);
  EXPECT_EQ(r.insights.boxes.fraction, 0);
  EXPECT_TRUE(r.insights.boxes.boxes.empty());
  std::string told;
  for (const Sentence& s : tell(p, r)) told += s.text;
  EXPECT_NE(told.find("No run had the outcome \"flies\"."), std::string::npos) << told;
}

TEST(Permissible, LooksForNoBoxWhereAllRunsFailed) {
  const Folder folder;
  const RunnerFactories factories =
      make_factories([](const Point&) { return Answer{Answer::Kind::Failed, {}, "", {}, "broke", 0}; });
  for (const char* text : {"z <= 3", "stands", "stands, z <= 3"}) {
    Problem p = make_small_problem(200);
    p.permissible = text;
    const StudyResult r = run(p, folder, text, factories);
    EXPECT_TRUE(r.is_finished) << text;
    EXPECT_FALSE(r.insights.has_boxes) << text;
    EXPECT_TRUE(r.alpha.archive.size() > 0 && static_cast<std::size_t>(r.alpha.failed) == r.alpha.archive.size());
    ASSERT_EQ(tell(p, r).size(), 2u);
    EXPECT_EQ(tell(p, r)[1].text, fmt::format("No box of permissible values can be looked for: all {} runs failed.",
                                              r.alpha.archive.size()));
    EXPECT_EQ(json::parse(write_results_json(p, r))["boxes"], nullptr);
  }
}

// Reference case "jump": permissible part of R >= 8 is .879201442, the largest box 1200.224726 of 35 x 54.4.
TEST(InsightsReference, BoxOfTheJump) {
  const Folder folder;
  Problem p = make_problem(uncertainty::cases::make_jump_inputs(), 8000);
  p.permissible = "stands";
  const StudyResult r = run(p, folder, "s", make_factories(calc_jump));
  ASSERT_TRUE(r.insights.has_boxes);
  const uncertainty::DesignResult& d = r.insights.boxes;
  EXPECT_NEAR(d.fraction, .879201442, 3 * d.fraction_error);
  ASSERT_FALSE(d.boxes.empty());
  const uncertainty::PermissibleBox& b = d.boxes.front();
  ASSERT_TRUE(b.kept);
  EXPECT_LE(b.volume, 1200.224726 / (35 * 54.4));
  EXPECT_NEAR(b.volume, 1200.224726 / (35 * 54.4), 0.02) << "a margin of 0.5 % of each width on both axes";
  EXPECT_GE(b.box.lower[0] * b.box.lower[1], 800);
  EXPECT_EQ(b.fresh, 149);
  EXPECT_NEAR(b.violating, 1 - std::pow(0.05 * 6 / std::pow(std::numbers::pi * b.tries, 2), 1.0 / 149), 1e-12);
  EXPECT_NE(tell_guarantee(b, d.forbidden).find("not proven"), std::string::npos);
  // the largest value lies where both inputs are largest; what is left of the runs settles bounds inside
  ASSERT_EQ(b.outputs.size(), 1u);
  for (const uncertainty::LevelBounds& l : b.outputs[0].levels) {
    EXPECT_TRUE(l.lower.converged) << l.alpha;
    EXPECT_TRUE(l.upper.converged) << l.alpha;
  }
  EXPECT_NEAR(b.outputs[0].levels[0].lower.value, b.box.lower[0] * b.box.lower[1] / 100 - 8, 1e-9);
}

TEST(InsightsReference, BoundsInTheBoxOfTheJumpEndWithFewRuns) {
  const Folder folder;
  Problem p = make_problem(uncertainty::cases::make_jump_inputs(), 1500);
  p.permissible = "stands";
  for (const int limit : {1500, 3000})
    for (const int seed : {2, 5, 6}) {
      p.limit = limit;
      p.seed = seed;
      const StudyResult r = run(p, folder, fmt::format("{} {}", limit, seed).c_str(), make_factories(calc_jump));
      ASSERT_FALSE(r.insights.boxes.boxes.empty());
      const uncertainty::PermissibleBox& b = r.insights.boxes.boxes.front();
      ASSERT_TRUE(b.kept) << limit << " " << seed;
      ASSERT_EQ(b.outputs.size(), 1u);
      for (const uncertainty::LevelBounds& l : b.outputs[0].levels) {
        // a product of positive numbers is least and largest in corners
        const auto of = [&](auto end) { return end(b.inputs[0]) * end(b.inputs[1]) / 100 - 8; };
        EXPECT_TRUE(l.lower.converged && l.upper.converged) << limit << " " << seed << " " << l.alpha;
        EXPECT_NEAR(l.lower.value, of([&](const auto& x) { return x.cut(l.alpha).left; }), 1e-9);
        EXPECT_NEAR(l.upper.value, of([&](const auto& x) { return x.cut(l.alpha).right; }), 1e-9);
      }
    }
}

TEST(Results, DigitsTellValuesApartThatVaryLittle) {
  EXPECT_EQ(calc_digits(0, 1, 5), 5);
  EXPECT_EQ(calc_digits(-3, 30, 5), 5);
  EXPECT_EQ(calc_digits(2, 3, 5), 5);
  EXPECT_EQ(calc_digits(1e5, 1e5 + 1e-3, 5), 13);
  EXPECT_EQ(calc_digits(-1e9, -1e9 + 1e-6, 5), 17);
  EXPECT_EQ(calc_digits(7, 7, 5), 5);
}

TEST(InsightsReplay, AreReadBackWithTheSameBits) {
  const Folder folder;
  Problem p = make_small_problem(2000);
  p.permissible = "stands, root <= 5";
  const StudyResult r = run(p, folder, "s", make_small_factories());
  ASSERT_TRUE(r.insights.has_boxes);
  Store store(folder / "s");
  const StudyResult again = read_study(p, store, *store.find_study("main"));
  EXPECT_EQ(write_results_json(p, again), write_results_json(p, r));
  EXPECT_EQ(write_drivers_csv(p, again), write_drivers_csv(p, r));
  EXPECT_EQ(write_boxes_csv(p, again), write_boxes_csv(p, r));
  EXPECT_EQ(write_samples_csv(p, again), write_samples_csv(p, r));
  EXPECT_EQ(to_page_json(p, again, {}), to_page_json(p, r, {}));
}

TEST(InsightsReplay, AreTheSameAfterAnInterruptionAmongTheBoxes) {
  const Folder folder;
  Problem p = make_small_problem(1500);
  p.permissible = "stands";
  const StudyResult whole = run(p, folder, "a", make_small_factories());
  StudyOptions o;
  o.store = folder / "b";
  o.pool.batch = 8;
  for (const long stop : {300L, 900L, 100000L}) {
    std::atomic<bool> cancel = false;
    std::atomic<long> runs = 0;
    Progress progress;
    progress.cancel = &cancel;
    const StudyResult part = run_study(p, make_factories([&](const Point& x) {
                                         if (++runs >= stop) cancel = true;
                                         return calc_small(x);
                                       }),
                                       o, progress, {});
    EXPECT_EQ(part.is_finished, stop == 100000L) << stop;
    if (part.is_finished) { EXPECT_EQ(write_results_json(p, part), write_results_json(p, whole)); }
  }
}

TEST(Fans, PartTrajectoriesByCurveAndOutcome) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 1, 2)}, 60);
  p.curves = {{"tilt", "deg", 0.5, "time", "s", {0, 1}, false},
              {"outline", "m", 1, "direction", "deg", {0, 90, 180, 270}, true}};
  const StudyResult r = run(p, folder, "s", make_factories([](const Point& x) {
                              const double a = x[0];
                              return done({{"y", a}}, a > 1 ? "far" : "near", {a, 2 * a, a, 1, 1, 2});
                            }));
  const std::vector<CurveFan> fans = calc_fans(p, r);
  ASSERT_EQ(fans.size(), 6u) << "two curves for all runs and two outcomes";
  EXPECT_EQ(fans[0].levels.front().lower, (std::vector<double>{0, 0}));
  EXPECT_EQ(fans[0].levels.front().upper, (std::vector<double>{2, 4}));
  EXPECT_EQ(fans[0].levels.back().upper, (std::vector<double>{1, 2}));
  // support of the outline at degree 0: 2 towards x, 1, 1 and 2
  const std::vector<DebrisLevel> debris = calc_debris(p.curves[1], fans[1]);
  ASSERT_EQ(debris.front().corners.size(), 4u);
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &a = debris.front().corners[i], &b = debris.front().corners[(i + 1) % 4];
    area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
  }
  EXPECT_NEAR(area, 9, 1e-9) << "3 x 3, counter-clockwise";
  EXPECT_NE(write_fans_csv(p, r).find("tilt [deg],,0,1,0,8"), std::string::npos) << write_fans_csv(p, r).substr(0, 300);
  EXPECT_NE(write_debris_csv(p, r).find("outcome,alpha,x [m],y [m]"), std::string::npos);
  // a run's own curves in the same units: 1, 2, 1 and 1, 1, 2 at the core
  const std::string own = write_trajectories_csv(p, r);
  EXPECT_NE(own.find(",2,4,1,1,1,2\n"), std::string::npos) << own.substr(0, 200);
}

TEST(Fans, ReachFromTheSupportToTheCoreWithoutOutputs) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 1, 2)}, 200);
  p.levels = {0.5};  // 0 and 1 are always there
  const StudyResult r = run(p, folder, "f", make_factories([](const Point& x) {
                              return done({}, "falls", {x[0], 2 * x[0]});
                            }));
  ASSERT_TRUE(r.alpha.outputs.empty());
  const std::vector<CurveFan> fans = calc_fans(p, r);
  ASSERT_EQ(fans.size(), 1u);
  ASSERT_EQ(fans[0].levels.size(), 3u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(fans[0].levels[static_cast<std::size_t>(k)].alpha, 0.5 * k);
  EXPECT_EQ(fans[0].levels[2].upper, (std::vector<double>{1, 2})) << "the core's own";
  EXPECT_GT(fans[0].levels[0].upper[1], 3);
}

TEST(Results, KeepAnOutcomeWithoutANameApartFromAll) {
  const Folder folder;
  const Problem p = make_problem({make_triangular(0, 1, 2)}, 200);
  const StudyResult r = run(p, folder, "n", make_factories([](const Point& x) {
                              return done({{"y", x[0]}}, x[0] > 1.2 ? "falls" : "", {x[0]});
                            }));
  // any, and each by itself
  const std::string membership = write_membership_csv(p, r), fans = write_fans_csv(p, r);
  EXPECT_NE(membership.find("y,(no name),0,"), std::string::npos) << membership;
  EXPECT_NE(fans.find("trajectory,(no name),0,"), std::string::npos) << fans.substr(0, 300);
  const std::string all = "\ny,,0,";
  EXPECT_EQ(membership.find(all), membership.rfind(all)) << "one row for any";
}

TEST(Story, RoundsDegreesSoThatTheyStayTrue) {
  EXPECT_EQ(words_of_least(.456598936), "0.45");
  EXPECT_EQ(words_of_most(1 - .456598936), "0.55");
  EXPECT_EQ(words_of_least(0.999), "0.99");
  EXPECT_EQ(words_of_most(1e-4), "0.01");
  EXPECT_EQ(words_of_least(1), "1.00");
  EXPECT_EQ(words_of_most(0), "0.00");
  EXPECT_EQ(words_of_most(13.81, 1), "13.9");
  // what has two digits keeps them, though no double is that number
  for (int k = 0; k <= 100; ++k) {
    const std::string text = fmt::format("{}.{:02}", k / 100, k % 100);
    for (const double x : {k / 100.0, 1 - (1 - k / 100.0)}) {
      EXPECT_EQ(words_of_least(x), text);
      EXPECT_EQ(words_of_most(x), text);
    }
  }
  const Folder folder;
  const Problem p = make_problem(uncertainty::cases::make_jump_inputs(), 2000);
  const StudyResult r = run(p, folder, "a", make_factories(calc_jump));
  double falls = 0;
  for (const auto& c : r.possibilities.classes)
    if (name_of_outcome(r, c.outcome) == "falls") falls = c.possibility;
  ASSERT_GT(falls, 0.455);
  std::string told;
  for (const Sentence& s : tell(p, r)) told += s.text + " ";
  EXPECT_NE(told.find("another outcome is possible (possibility at least 0.45), so its necessity is at most 0.55."),
            std::string::npos)
      << told;
  EXPECT_NE(told.find("possibility at least 0.45, necessity at most 0.00."), std::string::npos) << told;
  EXPECT_NE(told.find("possibility 1.00, necessity at most 0.55."), std::string::npos) << told;
}

TEST(Story, UsesShortNamesAndRoundNumbers) {
  EXPECT_EQ(make_short_names({{"concrete.a.fc", "", 1}, {"concrete.b.fc", "", 1}, {"fy", "", 1}, {"x.Ec", "", 1}}),
            (std::vector<std::string>{"a.fc", "b.fc", "fy", "Ec"}));
  EXPECT_EQ(make_short_names({{"a", "", 1}, {"a", "", 1}}), (std::vector<std::string>{"a", "a"}));
  EXPECT_EQ(words_of_number(27187.4), "27190");
  EXPECT_EQ(words_of_number(-3.14159), "-3.142");
  EXPECT_EQ(words_of_number(2e8), "2e+08");
}

TEST(Story, WritesAsManyDigitsAsASupportNeeds) {
  EXPECT_EQ(words_of_number(1000001.8534, 2), "1000001.853");
  EXPECT_EQ(words_of_number(27187.4, 30000), "27190");
  EXPECT_EQ(words_of_number(27187.43, 300), "27187.4");
  EXPECT_EQ(words_of_number(-2.00000123456, 1e-6), "-2.000001235");
  EXPECT_EQ(words_of_value({"a", "mm", 1e-3}, 1000.0018534, 0.002), "1000001.853 mm");
  Problem p;
  p.inputs = {{"a", "", 1}};
  p.space.inputs = {uncertainty::make_triangular(1000000, 1000001, 1000002)};
  EXPECT_EQ(words_of_point(p, {1000001.75}), "a 1000001.75 (core 1000001)");
}

TEST(Insights, SaysWhichOutcomesWithAnInputKnownAreNotSettled) {
  Problem p;
  p.inputs = {{"a", "", 1}};
  p.space.inputs = {uncertainty::make_triangular(-1, 0, 1)};
  StudyResult r;
  r.outcomes = {"stands", "falls", "tilts"};
  r.insights.knowing = {{0, {}, {}, {{0, 1, 0, 0, 0, true}, {1, 0.25, 0.1, 1, 0, false}}}};
  for (int outcome = 0; outcome < 3; ++outcome) r.alpha.classes.push_back({outcome, 1, 0, 0, {}});
  const auto known = nlohmann::json::parse(write_results_json(p, r)).at("known").at(0).at("outcomes");
  EXPECT_TRUE(known.at(0).at("converged"));
  EXPECT_FALSE(known.at(1).at("converged"));
  EXPECT_FALSE(known.at(2).at("converged")) << "nothing was found from which a search could begin";
  const std::string csv = write_drivers_csv(p, r);
  EXPECT_NE(csv.find("possibility_known,known_converged\n"), std::string::npos) << csv;
  for (const char* end : {",1,1\n", ",0.25,0\n", ",0,0\n"}) EXPECT_NE(csv.find(end), std::string::npos) << csv;
}

TEST(Story, SaysWhatIsPossibleAndWhatTurnsIt) {
  const Folder folder;
  Problem p = make_small_problem(2000);
  p.asked = "stands";
  const StudyResult r = run(p, folder, "s", make_small_factories());
  std::map<std::string, Sentence> by_id;
  for (const Sentence& s : tell(p, r)) by_id[s.id] = s;
  EXPECT_NE(by_id["verdict"].text.find("\"stands\", as planned"), std::string::npos) << by_id["verdict"].text;
  EXPECT_EQ(by_id["verdict"].status, record::Status::Warning) << "another outcome is possible to less than a half";
  EXPECT_NE(by_id["outcome.falls"].text.find("possibility at least 0.4"), std::string::npos);
  EXPECT_NE(by_id["outcome.falls"].text.find("x1"), std::string::npos) << "the values that it takes";
  EXPECT_NE(by_id["failed"].text.find("failed"), std::string::npos);
  EXPECT_EQ(by_id["failed"].status, record::Status::Warning);
}

// Only x acts on the outcome, in a hundredth of its range, and on the wave; bins are wider than both.
TEST(InsightsReference, AnInputExplainsAtLeastWhatNoOtherHasAPartIn) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1), make_triangular(0, 0.5, 1), make_triangular(0, 0.5, 1)}, 6000);
  constexpr double pi = 3.14159265358979323846;
  const StudyResult r =
      run(p, folder, "s", make_factories([](const Point& x) {
            return done({{"wave", std::sin(20 * pi * x[0])}}, x[0] > 0.3 && x[0] < 0.33 ? "window" : "other");
          }));
  ASSERT_EQ(r.insights.source, Insights::Source::Design);
  const uncertainty::Driver& wave = r.insights.drivers.outputs.at(0).at(0);
  EXPECT_NEAR(wave.first, 1, 0.05 + 2 * wave.first_error);
  for (const auto& c : r.insights.drivers.outcomes) {
    EXPECT_NEAR(c.inputs[0].first, 1, 0.05 + 2 * c.inputs[0].first_error) << c.outcome;
    EXPECT_LT(c.inputs[0].first_error, 0.2);
    EXPECT_LT(c.inputs[1].first, 0.1);
  }
}

// Boxes are ranked by an output that the requirement names, wherever it stands.
TEST(Insights, RobustnessIsThatOfWhatTheRequirementLimits) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1), make_triangular(0, 0.5, 1)}, 3000);
  p.permissible = "v <= 1";
  const auto run_with = [&](bool is_first) {
    return run(p, folder, is_first ? "a" : "b", make_factories([is_first](const Point& x) {
                 const double v = x[0] + x[1], junk = 1e3 * std::exp(-20 * x[0]);
                 return is_first ? done({{"v", v}, {"junk", junk}}, "") : done({{"junk", junk}, {"v", v}}, "");
               }));
  };
  const auto boxes = [](const StudyResult& r) { return r.insights.boxes.boxes; };
  const auto a = boxes(run_with(true)), b = boxes(run_with(false));
  ASSERT_FALSE(a.empty());
  ASSERT_FALSE(b.empty());
  ASSERT_TRUE(a[0].kept && b[0].kept);
  EXPECT_NEAR(a[0].robustness / b[0].robustness, 1, 0.2);
}

TEST(Story, WeighsARequirementOnNumbers) {
  const Folder folder;
  Problem p = make_problem(uncertainty::cases::make_jump_inputs(), 2000);
  const auto find = [](const std::vector<Sentence>& all) {
    return *std::find_if(all.begin(), all.end(), [](const Sentence& s) { return s.id == "requirement"; });
  };
  // z = R - 8, less 10 where R < 8: it is below 0 to the degree of R < 8, .456598936
  p.permissible = "z >= 0";
  const Sentence some = find(tell(p, run(p, folder, "a", make_factories(calc_jump))));
  EXPECT_EQ(some.status, record::Status::Warning);
  EXPECT_NE(some.text.find("keep the requirement z >= 0. Breaking it is possible: possibility at least 0.4"),
            std::string::npos)
      << some.text;
  // R = 16 at the core, so that z = 8
  p.permissible = "z > 9";
  const Sentence broken = find(tell(p, run(p, folder, "b", make_factories(calc_jump))));
  EXPECT_EQ(broken.status, record::Status::Bad);
  EXPECT_NE(broken.text.find("break the requirement z > 9"), std::string::npos) << broken.text;
  p.permissible = "z <= 40";
  const Sentence none = find(tell(p, run(p, folder, "c", make_factories(calc_jump))));
  EXPECT_EQ(none.status, record::Status::Good);
  EXPECT_NE(none.text.find("runs broke it"), std::string::npos) << none.text;
}

TEST(Story, WeighsARequirementByWholeRunsToo) {
  const Folder folder;
  Problem p = make_problem(uncertainty::cases::make_jump_inputs(), 500);
  p.permissible = "z <= 40";
  StudyResult r = run(p, folder, "a", make_factories(calc_jump));
  const auto ask = [&] {
    const std::vector<Sentence> all = tell(p, r);
    return *std::find_if(all.begin(), all.end(), [](const Sentence& s) { return s.id == "requirement"; });
  };
  ASSERT_EQ(ask().status, record::Status::Good);
  const auto add = [&](double membership, double z) {
    Confirmation::Run whole{0, membership, r.alpha.archive[0].result};
    whole.whole.values = {z};
    r.confirmation.runs.push_back(whole);
  };
  add(1, 39);
  EXPECT_EQ(ask().status, record::Status::Good);
  add(0.3, 41);
  EXPECT_EQ(ask().status, record::Status::Warning);
  add(0.8, 42);
  EXPECT_EQ(ask().status, record::Status::Bad);
  EXPECT_NE(ask().text.find("2 of 3 whole runs break the requirement, which is possible to at least 0.80."),
            std::string::npos)
      << ask().text;
}

std::map<std::string, Sentence> tell_by_id(const Problem& p, const StudyResult& r) {
  std::map<std::string, Sentence> by_id;
  for (const Sentence& s : tell(p, r)) by_id[s.id] = s;
  return by_id;
}

TEST(Story, DoubtsWhatRunsSayThatEndedInTheMiddle) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1)}, 200);
  p.asked = "topple";
  p.permissible = "topple, reach <= 5";
  p.not_judged = {"the reach of debris", "the clearance of \"Shed\""};
  p.horizon = {"touchdown", "stands", 1.7, ""};
  // lands in time, or not, or never
  const auto factories = make_factories([](const Point& x) {
    return done({{"reach", 1}, {"touchdown", x[0] < 0.4 ? 0.5 : 1.7}}, "topple");
  });
  const StudyResult r = run(p, folder, "s", factories);
  std::map<std::string, Sentence> by_id = tell_by_id(p, r);
  EXPECT_NE(by_id["unfinished"].text.find("nothing of the upper block had touched down when they ended, 1.7 s after"),
            std::string::npos);
  EXPECT_EQ(by_id["unfinished"].status, record::Status::Warning);
  EXPECT_EQ(by_id["clock"].text,
            "Times count from the last stage. Runs end at rest or 1.7 s behind it, when parts may "
            "still move: reaches are those of that time.");
  EXPECT_EQ(by_id["clock"].status, record::Status::Info);
  EXPECT_EQ(by_id["requirement"].status, record::Status::Warning);
  EXPECT_NE(by_id["requirement"].text.find("ended before anything had touched down"), std::string::npos);
  EXPECT_EQ(by_id["not_judged"].text,
            "Not judged here, but by topple run: the reach of debris, the clearance of \"Shed\".");
  p.horizon->unless = "topple";  // what is meant to stay up
  by_id = tell_by_id(p, r);
  EXPECT_EQ(by_id.count("unfinished"), 0u);
  EXPECT_EQ(by_id["requirement"].status, record::Status::Good);
}

TEST(Story, DoubtsOutcomesThatMayBecomeOthers) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1)}, 200);
  p.asked = "vertical";
  p.permissible = "vertical";
  p.horizon = {"touchdown", "stands", 1.7, "open"};
  for (const double ends_below : {0.9, 0.3}) {
    SCOPED_TRACE(ends_below);
    const StudyResult r = run(p, folder, std::to_string(ends_below).c_str(), make_factories([=](const Point& x) {
                                return done({{"touchdown", 0.5}, {"open", x[0] < ends_below ? 0 : 1}}, "vertical");
                              }));
    const auto& all = r.alpha.archive.samples();
    const long open = std::ranges::count_if(all, [=](const auto& s) { return s.x[0] >= ends_below; });
    ASSERT_GT(open, 0);
    std::map<std::string, Sentence> by_id = tell_by_id(p, r);
    const bool is_core_open = ends_below < 0.5;
    EXPECT_EQ(by_id["verdict"].status, is_core_open ? record::Status::Warning : record::Status::Good);
    EXPECT_EQ(by_id["verdict"].text.find("may become another") != std::string::npos, is_core_open);
    EXPECT_EQ(by_id["requirement"].status, record::Status::Warning);
    EXPECT_NE(by_id["requirement"].text.find(
                  fmt::format("But in {} of the runs the outcome could still become another one", open)),
              std::string::npos);
    EXPECT_NE(by_id["clock"].text.find(
                  fmt::format("In {} of {} runs the outcome could still become another", open, all.size())),
              std::string::npos);
  }
}

// Another outcome, failure, violation or limit at the very end of the support, at x1 = 1: possible to 0, but not
// unseen.
TEST(Story, NamesWhatWasFoundOnlyAtInputsThatAreNotPossible) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1), make_triangular(0, 0.5, 1)}, 2500);
  p.permissible = "stands, f <= 1.7";
  p.limits = {{"x", "House", 1, 1, "a table"}};
  const RunnerFactories model = make_factories([](const Point& x) {
    return done({{"f", x[0] >= 1 ? 2 : 1}, {"x", x[0]}}, x[0] >= 1 ? "collapse" : "stands");
  });
  const StudyResult r = run(p, folder, "a", model);
  int edge = 0;
  for (const auto& s : r.alpha.archive.samples()) edge += s.x[0] >= 1;
  ASSERT_GT(edge, 0);
  const std::string only = fmt::format(
      " was found only where the inputs are not possible (membership 0): {} of {} runs.", edge, r.alpha.archive.size());
  auto told = tell_by_id(p, r);
  EXPECT_EQ(told["verdict"].text, "With the core values the outcome is \"stands\". Another outcome" + only);
  EXPECT_EQ(told["outcome.collapse"].text, "\"collapse\"" + only);
  EXPECT_NE(told["requirement"].text.find("Breaking it" + only), std::string::npos) << told["requirement"].text;
  EXPECT_EQ(told["requirement"].status, record::Status::Warning);
  EXPECT_NE(told["limit.x"].text.find("Reaching the limit" + only), std::string::npos) << told["limit.x"].text;
  // a failure instead
  const StudyResult failing = run(p, folder, "b", make_factories([](const Point& x) {
                                    if (x[0] >= 1) return Answer{Answer::Kind::Failed, {}, "", {}, "broke", 0};
                                    return done({{"f", 1}, {"x", x[0]}}, "stands");
                                  }));
  told = tell_by_id(p, failing);
  EXPECT_NE(told["verdict"].text.find("Another outcome was found only"), std::string::npos) << told["verdict"].text;
  EXPECT_NE(told["requirement"].text.find("Breaking it was found only"), std::string::npos);
}

// x1 >= 0.9 is possible to 0.2, but runs came to an end when all that were seen there were possible to 0.
TEST(Story, GivesALowerBoundWhereThePossibilityWasNotSearched) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 0.5, 1), make_triangular(0, 0.5, 1)}, 10);
  p.asked = "stands";
  p.has_drivers = false;
  const StudyResult r = run(p, folder, "a", make_factories([](const Point& x) {
                              return done({{"f", x[0]}}, x[0] >= 0.9 ? "collapse" : "stands");
                            }));
  ASSERT_EQ(r.alpha.classes.size(), 2u);
  ASSERT_EQ(r.possibilities.classes[1].possibility, 0);
  auto told = tell_by_id(p, r);
  for (const char* id : {"verdict", "outcome.collapse"}) {
    EXPECT_NE(told[id].text.find("not searched to the end: it is at least 0.00."), std::string::npos) << told[id].text;
    EXPECT_EQ(told[id].status, record::Status::Warning);
  }
}

TEST(Story, OfNothingOfFailuresAndOfOneOutcome) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 1, 2)}, 40);
  EXPECT_EQ(tell(p, {}).front().text, "Nothing has been run so far.");
  const StudyResult failed =
      run(p, folder, "f",
          make_factories([](const Point&) { return Answer{Answer::Kind::Failed, {}, "", {}, "broke", 0}; }));
  EXPECT_NE(tell(p, failed).front().text.find("All"), std::string::npos);
  EXPECT_EQ(tell(p, failed).front().status, record::Status::Bad);
  for (const StudyResult& r : {StudyResult{}, failed}) {
    EXPECT_FALSE(write_results_json(p, r).empty());
    EXPECT_NO_THROW((void)to_page_json(p, r, {}));
  }
  const StudyResult one = run(p, folder, "o", make_factories([](const Point& x) {
                                return done({{"y", x[0]}}, "stands");
                              }));
  const std::string text = tell(p, one).front().text;
  EXPECT_NE(text.find("No other outcome was found"), std::string::npos) << text;
  EXPECT_NE(text.find("5 %"), std::string::npos) << "and how large one may be";
}

TEST(Story, TellsOutputsWhereThereAreNoOutcomes) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 1, 2)}, 40);
  p.outputs = {{"z", "mm", 1e-3}};
  const StudyResult r = run(p, folder, "s", make_factories([](const Point& x) {
                              if (x[0] > 1.9) return Answer{Answer::Kind::Failed, {}, "", {}, "broke", 0};
                              return done({{"y", x[0] < 1 ? x[0] : 1}, {"z", -x[0]}}, "");
                            }));
  const std::vector<Sentence> told = tell(p, r);
  EXPECT_EQ(told.front().id, "verdict");
  EXPECT_TRUE(
      told.front().text.starts_with("With the core values y is 1; over the whole support it lies between 0 "
                                    "and 1, as far as found."))
      << told.front().text;
  EXPECT_NE(told.front().text.find("z is -1000 mm"), std::string::npos) << told.front().text;
  p.limit = 1000;
  const StudyResult more = run(p, folder, "more", make_factories([](const Point& x) {
                                 return done({{"y", x[0]}}, "");
                               }));
  EXPECT_TRUE(tell(p, more).front().text.ends_with("over the whole support it lies between 0 and 2."))
      << tell(p, more).front().text;
}

TEST(Story, TellsOfUsedUpRunsWhatTheyLeftOpen) {
  const Folder folder;
  const Problem p = make_small_problem();
  StudyResult r = run(p, folder, "a", make_factories([](const Point& x) { return done({{"z", x[0]}}, ""); }));
  const auto find_limit = [&]() -> Sentence {
    for (Sentence& s : tell(p, r))
      if (s.id == "limit") return std::move(s);
    return {};
  };
  r.ending = uncertainty::Ending::Complete;
  EXPECT_EQ(find_limit().text, "");
  r.ending = uncertainty::Ending::LimitReached;
  EXPECT_EQ(find_limit().status, record::Status::Info);
  EXPECT_NE(find_limit().text.find("converged for all bounds and possibilities"), std::string::npos);
  r.alpha.outputs[0].levels[0].upper.converged = false;
  EXPECT_EQ(find_limit().status, record::Status::Warning);
  EXPECT_NE(find_limit().text.find(": 1 of "), std::string::npos) << find_limit().text;
  // those within boxes count, too
  uncertainty::PermissibleBox box;
  box.kept = true;
  box.outputs = r.alpha.outputs;
  r.insights.has_boxes = true, r.insights.boxes.boxes = {box};
  EXPECT_NE(find_limit().text.find(": 2 of "), std::string::npos) << find_limit().text;
  // of the number that is usual where none is asked for
  Problem q = p;
  q.limit = 0;
  for (const Sentence& s : tell(q, r))
    if (s.id == "limit") { EXPECT_TRUE(s.text.starts_with("Of the runs that were allowed ")) << s.text; }
}

TEST(Story, GuaranteesNothingOfABoxThatIsBroken) {
  uncertainty::PermissibleBox b;
  b.volume = 0.3, b.samples = 3135, b.broken = 3, b.fresh = 149, b.tries = 4, b.violating = 0.03;
  EXPECT_EQ(tell_guarantee(b, 1),
            "This box was dropped: 3 of the 3135 runs inside violate the requirement. More runs may find a box.");
  b.broken = 0;
  EXPECT_NE(tell_guarantee(b, 1).find("not finished"), std::string::npos);
  b.volume = 0;
  EXPECT_NE(tell_guarantee(b, 1).find("too little room"), std::string::npos);
  EXPECT_EQ(tell_guarantee(b, 0),  // nothing violates
            "This box was dropped: the runs were used up before it could be checked. More runs may find a box.");
  b.volume = 0.3, b.kept = true;
  EXPECT_NE(tell_guarantee(b, 1).find("No run violated the requirement in 3135 inside, 149 of them"),
            std::string::npos);
  EXPECT_NE(tell_guarantee(b, 1, true).find("constraints"), std::string::npos);
}

TEST(StudyPage, ThinsRunsAndSaysWhichAreThere) {
  const Folder folder;
  Problem p = make_small_problem(1500);
  p.title = "</script> \xff";
  const StudyResult r = run(p, folder, "s", make_small_factories());
  const json page = json::parse(to_page_json(p, r, {"0", "now", "text", "in.toml"}, 100));
  EXPECT_EQ(page["runs"].get<std::size_t>(), r.alpha.archive.size());
  const auto shown = page["run_table"]["sample"].get<std::vector<int>>();
  EXPECT_GE(shown.size(), 100u);
  EXPECT_LT(shown.size(), 120u);
  for (const NotableRun& n : list_notable_runs(p, r))
    EXPECT_NE(std::find(shown.begin(), shown.end(), n.sample), shown.end()) << n.why;
  for (const char* key : {"inputs", "outputs", "membership", "outcome"})
    EXPECT_EQ(page["run_table"][key].size(), shown.size());
}

// A class that was met beyond a constraint only, or in a support that has been made smaller, is none of the results'.
TEST(StudyPage, LeavesRunsOutThatDoNotCount) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 1, 2)}, 60);
  StudyResult r = run(p, folder, "s", make_factories([](const Point& x) {
                        return done({{"y", x[0]}}, x[0] > 1.5 ? "far" : "near");
                      }));
  const auto narrow = [&](Problem smaller) {
    StudyResult s = r;
    s.alpha = uncertainty::read_archive(smaller.space, r.alpha.archive, {0, 1}, {});
    s.alpha.archive = r.alpha.archive;
    s.possibilities = {};
    ASSERT_EQ(s.alpha.classes.size(), 1u);
    const json table = json::parse(to_page_json(smaller, s, {}))["run_table"];
    std::size_t inside = 0;
    for (const auto& one : r.alpha.archive.samples()) inside += one.x[0] <= 1.2;
    EXPECT_EQ(table["sample"].size(), inside);
    for (const json& outcome : table["outcome"]) EXPECT_EQ(outcome, 0);
  };
  Problem tied = p, small = p;
  tied.space.constraints = {[](const Point& x) { return x[0] - 1.2; }};
  narrow(tied);
  small.space.inputs = {make_triangular(0, 1, 1.2)};
  narrow(small);
}

TEST(Results, ReplaceThoseOfEarlierSettings) {
  const Folder folder;
  Problem p = make_small_problem(400);
  p.permissible = "stands";
  const std::string there = folder / "out";
  const auto exists = [&](const char* name) { return std::filesystem::exists(there + "/" + name); };
  const auto list_written = [&](const char* store) {
    return write_results(there, p, run(p, folder, store, make_small_factories()));
  };
  EXPECT_EQ(list_written("a").size(), 7u);
  EXPECT_TRUE(exists("boxes.csv") && exists("drivers.csv") && exists("requirement.csv"));
  std::ofstream(there + "/mine.csv") << "1\n";
  p.permissible.clear();
  p.has_drivers = false;
  EXPECT_EQ(list_written("b").size(), 4u);
  EXPECT_FALSE(exists("boxes.csv") || exists("drivers.csv") || exists("requirement.csv"));
  EXPECT_TRUE(exists("mine.csv") && exists("results.json"));
}

TEST(Results, NameEveryColumnAndOutcomeOnce) {
  const Folder folder;
  const Problem p = make_problem({make_triangular(0, 1, 2)}, 60);
  const StudyResult r = run(p, folder, "a", make_factories([](const Point& x) {
                              if (x[0] > 1.5) return Answer{Answer::Kind::Failed, {}, "", {}, "broke", 0};
                              return done({{"membership", 1}, {"x1", x[0]}, {"y", 1}}, x[0] < 0.5 ? "failed" : "good");
                            }));
  const std::string csv = write_samples_csv(p, r);
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "sample,x1,membership,outcome,membership (output),x1 (output),y,failure");
  const std::string outcomes = write_outcomes_csv(p, r);
  EXPECT_NE(outcomes.find("\nfailed,"), std::string::npos) << outcomes;
  EXPECT_NE(outcomes.find("\nfailed run,"), std::string::npos) << outcomes;
}

TEST(Results, RobustnessComparesRelativeUncertainty) {
  // y = 2 a of a triangle: as uncertain as its input; without a size where the core is 0
  const Folder folder;
  Problem p = make_problem({make_triangular(0.5, 1, 2)}, 200);
  const StudyResult r = run(p, folder, "s", make_factories([](const Point& x) {
                              return done({{"y", 2 * x[0]}, {"zero", x[0] - 1}}, "");
                            }));
  EXPECT_NEAR(calc_robustness_of(p, r, 0), 1, 1e-9);
  EXPECT_TRUE(std::isnan(calc_robustness_of(p, r, 1)));
}

TEST(Story, TellsHowPossibleItIsThatALimitIsReached) {
  // y = x1 over the triangle (0, 2, 10): the limit at 6 lies on its right branch at 0.5, at 12 outside
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 2, 10)}, 300);
  p.outputs = {{"y", "mm/s", 1e-3}};
  p.limits = {{"y", "House", 6, 8, "a table"}, {"y", "Works", 12, 12, "of the plan"}, {"z", "Nobody", 1, 1, ""}};
  const StudyResult r = run(p, folder, "limits", make_factories([](const Point& x) {
                              return done({{"y", x[0]}}, "falls");
                            }));
  std::vector<Sentence> told;
  for (const Sentence& s : tell(p, r))
    if (s.id == "limit.y") told.push_back(s);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told[0].text.find("\"House\": the upper end of the band lies between 0 and 10000 mm/s"), std::string::npos)
      << told[0].text;
  EXPECT_NE(told[0].text.find("limit 6000 mm/s to 8000 mm/s, by frequency (a table)"), std::string::npos)
      << told[0].text;
  const size_t at = told[0].text.find("possibility at least ");
  ASSERT_NE(at, std::string::npos) << told[0].text;
  const double possibility = std::stod(told[0].text.substr(at + 21));
  EXPECT_LE(possibility, 0.5 + 1e-9);  // the exact degree; runs find it from below, printed with two digits
  EXPECT_GT(possibility, 0.4);
  EXPECT_NE(told[0].status, record::Status::Good);
  EXPECT_NE(told[1].text.find("No run reaches the limit."), std::string::npos);
  EXPECT_EQ(told[1].status, record::Status::Good);
}

TEST(Story, CallsNoVerdictGoodWhereLimitsAreBroken) {
  // y = x1 over the triangle (0, 2, 10), always "falls" as planned: more than 1 at the core, more than 6 to 0.5, more
  // than 8 to 0.25, more than 12 nowhere
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 2, 10)}, 300);
  p.outputs = {{"y", "m", 1}, {"left", "m", 1}};
  p.asked = "falls";
  const StudyResult r = run(p, folder, "verdict", make_factories([](const Point& x) {
                              return done({{"y", x[0]}, {"left", x[0] > 9 ? 5 : 0}}, "falls");
                            }));
  using record::Status;
  const auto verdict = [&](const std::vector<double>& most, const std::string& left = "") {
    p.limits.clear();
    for (const double m : most) p.limits.push_back({"y", "", m, m, "of the plan", Limit::Kind::Reach, left});
    const Sentence s = tell(p, r).front();
    EXPECT_EQ(s.id, "verdict");
    EXPECT_NE(s.text.find("\"falls\", as planned"), std::string::npos) << s.text;
    return s;
  };
  const auto says = [](const Sentence& s, const char* text) { return s.text.find(text) != std::string::npos; };
  EXPECT_EQ(verdict({}).status, Status::Good);
  EXPECT_EQ(verdict({12}).status, Status::Good);
  EXPECT_FALSE(says(verdict({12}), "Limits"));
  const Sentence broken = verdict({1, 12});
  EXPECT_EQ(broken.status, Status::Bad);
  EXPECT_TRUE(says(broken, " Limits of the plan that are broken with the core values: 1 of 2.")) << broken.text;
  EXPECT_EQ(verdict({5}).status, Status::Bad) << "well possible";
  const Sentence possible = verdict({8});
  EXPECT_EQ(possible.status, Status::Warning);
  EXPECT_TRUE(says(possible, "that other values break, possible to at least 0.2")) << possible.text;
  const Sentence open = verdict({12}, "left");
  EXPECT_EQ(open.status, Status::Warning);
  EXPECT_TRUE(says(open, " Limits of the plan that parts may break which still moved: 1 of 1.")) << open.text;
  // a screening's band reaches its limit, which is no more than a warning unless all of it lies above
  const auto screen = [&](double limit, double above) {
    p.limits = {{"y", "House", limit, limit, "of the plan"}};
    p.limits.front().above = above;
    return tell(p, r);
  };
  const std::vector<Sentence> reached = screen(1, 4);
  EXPECT_EQ(reached.front().status, Status::Warning);
  EXPECT_TRUE(
      says(reached.front(), " Screenings of vibration whose band reaches the limit with the core values: 1 of 1."))
      << reached.front().text;
  EXPECT_FALSE(says(reached.front(), "broken"));
  const auto own = [](const std::vector<Sentence>& all) {
    return std::find_if(all.begin(), all.end(), [](const Sentence& s) { return s.id == "limit.y"; })->status;
  };
  EXPECT_EQ(own(screen(1, 9)), Status::Warning);
  EXPECT_EQ(own(screen(1, 4)), Status::Bad) << "well possible";
  EXPECT_EQ(screen(1, 1.5).front().status, Status::Bad) << "the whole band lies above";
  const Sentence may_reach = screen(8, 100).front();
  EXPECT_EQ(may_reach.status, Status::Warning);
  EXPECT_TRUE(says(may_reach, "reaches the limit with other values, possible to at least 0.2")) << may_reach.text;
  p.not_judged = {"debris_reach"};
  const Sentence not_judged = verdict({12});
  EXPECT_EQ(not_judged.status, Status::Info);
  EXPECT_TRUE(says(not_judged, " Limits of the plan that are not judged here: 1.")) << not_judged.text;
  EXPECT_EQ(verdict({1}).status, Status::Bad);
}

TEST(Story, TellsHowManyRunsKeepALimitOfTheDebris) {
  // as above: more than 6 is possible to 0.5, less than 1 to 0.5 on the left branch, and less than 6 is the core's
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 2, 10)}, 300);
  p.outputs = {{"y", "m", 1}, {"left", "m", 1}};
  using Kind = Limit::Kind;
  p.limits = {{"y", "", 6, 6, "of the plan", Kind::Reach, "left"},
              {"y", "House", 1, 1, "of the plan", Kind::Clearance, "left"},
              {"y", "Works", 6, 6, "of the plan", Kind::Clearance, "left"},
              {"y", "", 12, 12, "of the plan", Kind::Reach, ""},
              {"y", "", 12, 12, "of the plan", Kind::Reach, "left"}};
  p.horizon = {"y", "falls", 1e3, ""};
  const StudyResult r = run(p, folder, "debris", make_factories([](const Point& x) {
                              return done({{"y", x[0]}, {"left", x[0] > 9 ? 5 : 0}}, "falls");
                            }));
  std::vector<Sentence> told;
  for (const Sentence& s : tell(p, r))
    if (s.id == "limit.y") told.push_back(s);
  ASSERT_EQ(told.size(), 5u);
  const long all = static_cast<long>(r.alpha.archive.size());
  const auto count = [&](const auto& is) {
    const auto& samples = r.alpha.archive.samples();
    return std::count_if(samples.begin(), samples.end(), [&](const auto& s) { return is(s.result.values[0]); });
  };
  const auto possibility = [&](const Sentence& s) {
    const size_t at = s.text.find("possibility at least ");
    return at == std::string::npos ? -1 : std::stod(s.text.substr(at + 21));
  };
  EXPECT_EQ(
      told[0].text.find(fmt::format("Reach of the debris: between 0 and 10 m; {} of {} runs keep the limit of 6 m "
                                    "(of the plan). It is ",
                                    count([](double y) { return y <= 6; }), all)),
      0u)
      << told[0].text;
  EXPECT_NEAR(possibility(told[0]), 0.5, 0.05);
  EXPECT_EQ(
      told[1].text.find(fmt::format("Clearance of \"House\": between 0 and 10 m; {} of {} runs keep the limit of 1 m",
                                    count([](double y) { return y >= 1; }), all)),
      0u)
      << told[1].text;
  EXPECT_NEAR(possibility(told[1]), 0.5, 0.05);
  EXPECT_EQ(possibility(told[2]), 1) << "the core breaks it";
  EXPECT_EQ(told[2].status, record::Status::Bad);
  EXPECT_NE(told[3].text.find("No run breaks the limit."), std::string::npos);
  EXPECT_EQ(told[3].status, record::Status::Good);
  EXPECT_NE(
      told[4].text.find(fmt::format("No run breaks the limit. In {} of the runs that keep it parts still moved when "
                                    "they ended, and may break it.",
                                    count([](double y) { return y > 9; }))),
      std::string::npos)
      << told[4].text;
  EXPECT_EQ(told[4].status, record::Status::Warning);
  // nothing had touched down: nothing is good
  p.horizon = {"y", "stands", 1, ""};
  for (const Sentence& s : tell(p, r)) EXPECT_FALSE(s.id == "limit.y" && s.status == record::Status::Good) << s.text;
}

TEST(Study, SpendsNoRunsOnBoundsThatAreNotSearched) {
  const Folder folder;
  Problem p = make_problem({make_triangular(0, 2, 10), make_triangular(0, 1, 3)}, 200);
  p.outputs = {{"y", "", 1}};
  const auto y = [](const Point& x) { return x[0] + x[1]; };
  const auto z = [](const Point& x) { return std::hypot(x[0] - 3.3, x[1] - 1.7); };
  const StudyResult alone = run(p, folder, "alone", make_factories([&](const Point& x) {
                                  return done({{"y", y(x)}}, "");
                                }));
  p.outputs.push_back({"z", "", 1, false});
  const StudyResult both = run(p, folder, "both", make_factories([&](const Point& x) {
                                 return done({{"y", y(x)}, {"z", z(x)}}, "");
                               }));
  ASSERT_EQ(alone.alpha.archive.size(), both.alpha.archive.size());
  for (int i = 0; i < static_cast<int>(alone.alpha.archive.size()); ++i)
    EXPECT_EQ(alone.alpha.archive[i].x, both.alpha.archive[i].x);
  // its bounds are those of these runs
  double least = 1e9;
  for (const auto& s : both.alpha.archive.samples()) least = std::min(least, s.result.values[1]);
  EXPECT_EQ(both.alpha.outputs[1].levels[0].lower.value, least);
  p.outputs[1].is_searched = true;
  const StudyResult searched = run(p, folder, "searched", make_factories([&](const Point& x) {
                                     return done({{"y", y(x)}, {"z", z(x)}}, "");
                                   }));
  EXPECT_LT(searched.alpha.outputs[1].levels[0].lower.value, least);
}

}  // namespace
}  // namespace topple::study
