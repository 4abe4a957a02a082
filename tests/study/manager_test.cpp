#include "study/manager.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "base/error.h"
#include "server.h"
#include "small_study.h"
#include "study/results.h"

namespace topple::study {
namespace {

StudyOptions make_options(const std::string& store, int jobs = 2) {
  StudyOptions o;
  o.store = store;
  o.pool.jobs = jobs;
  o.pool.batch = 8;
  return o;
}

StudyResult run(const Problem& p, const StudyOptions& o, const RunnerFactories& factories = make_small_factories()) {
  return run_study(p, factories, o, {}, {});
}

TEST(StudyReference, FindsBoundsAndPossibilityOfTheJump) {
  // the intervals of the jump without its failing corner, computed independently
  const Folder folder;
  Problem p = make_small_problem(10000);
  p.limit = 10000;
  RunnerFactories factories = {
      {"small", [](const std::string&) -> Runner {
         return [](auto points, const auto& give, const auto&) {
           for (std::size_t i = 0; i < points.size(); ++i) {
             const double R = points[i][0] * points[i][1] / 100;
             give(i, {Answer::Kind::Done, {{"z", R - 8 - (R < 8 ? 10 : 0)}}, R < 8 ? "falls" : "stands", {}, "", 0});
           }
         };
       }}};
  const StudyResult r = run(p, make_options(folder / "s"), factories);
  EXPECT_TRUE(r.is_finished);
  const double expected[4][2] = {{-14.64, 31.6}, {-12.335, 24.8}, {.54, 18.6}, {3.985, 13}};
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(r.alpha.outputs[0].levels[k].lower.value, expected[k][0], 1e-4 * 46.24) << k;
    EXPECT_NEAR(r.alpha.outputs[0].levels[k].upper.value, expected[k][1], 1e-4 * 46.24) << k;
  }
  ASSERT_EQ(r.outcomes, (std::vector<std::string>{"stands", "falls"}));
  EXPECT_NEAR(r.possibilities.classes[1].possibility, .456598936, 1e-3);
  EXPECT_EQ(r.possibilities.classes[0].possibility, 1);
  EXPECT_LE(r.alpha.archive.size(), 10000u);
}

/// A problem of the inputs x0, x1 ... whose runs `make_factories` makes.
Problem make_problem(std::vector<uncertainty::FuzzyNumber> inputs, int limit) {
  Problem p;
  p.kind = "small";
  for (std::size_t i = 0; i < inputs.size(); ++i) p.inputs.push_back({"x" + std::to_string(i), "", 1});
  p.space.inputs = std::move(inputs);
  p.limit = limit;
  return p;
}

double calc_sum(const Point& x) { return std::accumulate(x.begin(), x.end(), 0.0); }

/// Runs of a mapping of all inputs: a value, and whether an outcome happens.
RunnerFactories make_factories(std::function<double(const Point&)> calc, std::function<bool(const Point&)> happens) {
  return {{"small", [calc = std::move(calc), happens = std::move(happens)](const std::string&) -> Runner {
             return [calc, happens](auto points, const auto& give, const auto&) {
               for (std::size_t i = 0; i < points.size(); ++i)
                 give(i, {Answer::Kind::Done, {{"y", calc(points[i])}}, happens(points[i]) ? "in" : "out", {}, "", 0});
             };
           }}};
}

double find_possibility(const StudyResult& r, const std::string& outcome) {
  for (const auto& c : r.possibilities.classes)
    if (c.outcome >= 0 && r.outcomes.at(c.outcome) == outcome) return c.possibility;
  return -1;
}

TEST(StudyReference, FindsThePossibilityBeforeBoundsOfOutcomesTakeAllRuns) {
  // the box is touched at its corner x0 = -s, all others 2 s, with s = 1 - alpha
  const Folder folder;
  const Problem p =
      make_problem(std::vector<uncertainty::FuzzyNumber>(8, uncertainty::make_triangular(-1, 0, 2)), 10000);
  const StudyResult r = run(p, make_options(folder / "s"), make_factories(calc_sum, [](const Point& x) {
                              return std::inner_product(x.begin(), x.end(), x.begin(), 0.0) - x[0] > 6;
                            }));
  const double s = (-1 + std::sqrt(1 + 4 * 29 * 6.0)) / (2 * 29);  // 29 s^2 + s = 6
  EXPECT_NEAR(find_possibility(r, "in"), 1 - s, 1e-3);
}

TEST(StudyReference, SpreadsWhatSearchesLeaveForSmallIslands) {
  // three discs; the most possible one takes 0.3 % of the support
  const Folder folder;
  Problem p = make_problem({uncertainty::make_triangular(0, 3, 10), uncertainty::make_triangular(0, 6, 10)}, 10000);
  for (const std::uint64_t seed : {1, 2}) {
    p.seed = seed;
    const StudyResult r =
        run(p, make_options(folder / std::to_string(seed)), make_factories(calc_sum, [](const Point& x) {
              const auto is_near = [&x](double a, double b, double radius) {
                return std::hypot(x[0] - a, x[1] - b) <= radius;
              };
              return is_near(9, 9, 0.3) || is_near(8, 2, 0.3) || is_near(1, 1, 0.4);
            }));
    EXPECT_NEAR(find_possibility(r, "in"), 2.3 / 7, 1e-3) << seed;
    EXPECT_GE(r.alpha.coverage[0].space_points, 3000) << seed;
    EXPECT_LE(r.alpha.coverage[0].space_points, 5000 + 100) << seed;
    EXPECT_LE(r.alpha.archive.size(), 10000u) << seed;
  }
}

TEST(Study, SpreadsAsMuchWhereConstraintsLeaveLittle) {
  const Folder folder;
  Problem p = make_small_problem(1500);
  const int all = run(p, make_options(folder / "free")).alpha.coverage[0].space_points;
  p.space.constraints = {[](const Point& x) { return x[0] - 26; }, [](const Point& x) { return 62 - x[1]; },
                         [](const Point& x) { return x[1] - 70; }};
  const StudyResult r = run(p, make_options(folder / "s"));
  EXPECT_GE(all, 250);
  EXPECT_GE(r.alpha.coverage[0].space_points, 0.9 * all);
}

// Inputs that leave nothing to choose from: a study of them ends, also with room for more runs.
TEST(Study, EndsWhereNothingIsLeftToSpread) {
  const Folder folder;
  const auto happens = [](const Point&) { return true; };
  const StudyResult crisp =
      run(make_problem({uncertainty::make_triangular(2, 2, 2), uncertainty::make_triangular(3, 3, 3)}, 20),
          make_options(folder / "crisp"), make_factories(calc_sum, happens));
  EXPECT_EQ(crisp.alpha.archive.size(), 1u);
  EXPECT_EQ(crisp.ending, uncertainty::Ending::Complete);
  EXPECT_EQ(crisp.alpha.outputs[0].levels[0].upper.value, 5);

  // x0 + x1 = 3, as two constraints that leave round-off
  Problem p = make_problem({uncertainty::make_triangular(1, 2, 4), uncertainty::make_triangular(0, 1, 2)}, 300);
  const auto calc_excess = [](double a, double b) { return a - b - 1e-12 * std::max(a, b); };
  p.space.constraints = {[=](const Point& x) { return calc_excess(x[0] + x[1], 3); },
                         [=](const Point& x) { return calc_excess(3, x[0] + x[1]); }};
  const StudyResult line =
      run(p, make_options(folder / "line"), make_factories([](const Point& x) { return x[0]; }, happens));
  EXPECT_NEAR(line.alpha.outputs[0].levels[0].lower.value, 1, 1e-8);
  EXPECT_NEAR(line.alpha.outputs[0].levels[0].upper.value, 3, 1e-8);
}

TEST(StudyReplay, IsTheSameForAnyNumberOfWorkersAndBatches) {
  const Folder folder;
  const Problem p = make_small_problem();
  const std::string one = write_bits(run(p, make_options(folder / "a", 1)));
  StudyOptions many = make_options(folder / "b", 4);
  many.pool.batch = 3;
  EXPECT_EQ(write_bits(run(p, many, make_small_factories(1e-4))), one);
  EXPECT_NE(one.find("too strong"), std::string::npos);
}

TEST(StudyReplay, GoesOnWhereItWasInterrupted) {
  const Folder folder;
  const Problem p = make_small_problem();
  const std::string whole = write_bits(run(p, make_options(folder / "a")));
  const StudyOptions o = make_options(folder / "b");
  std::atomic<long> runs = 0;
  RunnerFactories factories = {{"small", [&runs](const std::string&) -> Runner {
                                  return [&runs](auto points, const auto& give, const auto& cancel) {
                                    for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                                      std::this_thread::sleep_for(std::chrono::milliseconds(1));
                                      give(i, calc_small(points[i]));
                                      ++runs;
                                    }
                                  };
                                }}};
  for (const int stop : {200, 300, 1 << 30}) {
    std::atomic<bool> cancel = false;
    Progress progress;
    progress.cancel = &cancel;
    const StudyResult r = run_study(p, factories, o, progress, [&](const StudyState& s) {
      if (s.run_here > stop) cancel = true;
    });
    if (stop == 200) { EXPECT_LT(runs, 1000) << "it was interrupted"; }
    EXPECT_EQ(r.is_finished, stop == 1 << 30);
    if (r.is_finished) { EXPECT_EQ(write_bits(r), whole); }
  }
  Store store(folder / "b");
  const Counts counts = store.count(calc_model_hash(p));
  EXPECT_EQ(counts.done + counts.failed, runs) << "nothing was run twice";
  EXPECT_EQ(counts.waiting + counts.running, 0);
}

// A clock that jumps lets every lease run out, again and again.
TEST(StudyReplay, RunsNothingTwiceWhenTheClockJumps) {
  const Folder folder;
  const Problem p = make_small_problem(150);
  const std::string whole = write_bits(run(p, make_options(folder / "a")));
  std::atomic<long> runs = 0;
  const RunnerFactories factories = {{"small", [&runs](const std::string&) -> Runner {
                                        return [&runs](auto points, const auto& give, const auto& cancel) {
                                          for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                                            std::this_thread::sleep_for(std::chrono::milliseconds(10));
                                            ++runs;
                                            give(i, calc_small(points[i]));
                                          }
                                        };
                                      }}};
  std::atomic<bool> is_over = false;
  Store(folder / "b").count_studies();
  std::thread clock([&] {
    const auto db = open_database(folder / "b");
    while (!is_over) {
      db->run("UPDATE job SET lease_until = 1 WHERE state = 'running'");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  StudyOptions o = make_options(folder / "b", 4);
  o.pool.batch = 1;
  const StudyResult r = run(p, o, factories);
  is_over = true;
  clock.join();
  EXPECT_EQ(write_bits(r), whole);
  EXPECT_EQ(runs, static_cast<long>(r.alpha.archive.size()));
}

TEST(StudyReplay, ReadsBackWhatItFound) {
  const Folder folder;
  const Problem p = make_small_problem();
  const StudyResult r = run(p, make_options(folder / "a"));
  Store store(folder / "a");
  const StudyResult again = read_study(p, store, store.find_study("main").value());
  EXPECT_EQ(write_bits(again), write_bits(r));
  EXPECT_TRUE(again.is_finished);
  EXPECT_EQ(again.ending, r.ending);
  for (std::size_t k = 0; k < r.alpha.outputs[0].levels.size(); ++k)
    EXPECT_EQ(again.alpha.outputs[0].levels[k].upper.converged, r.alpha.outputs[0].levels[k].upper.converged);
}

// What was run for other formulas, numbers or constraints stays in the store, but is not shown as found for these.
TEST(StudyReplay, ShowsOnlyRunsOfItsOwnProblemWhileItIsOpen) {
  const Folder folder;
  const auto make = [](double factor) {
    Problem p = make_small_problem(200);
    p.derived = {{"d", "", 1}};
    p.calc_derived = [factor](const Point& x) { return std::vector{x[0] < 12 ? std::nan("") : factor * x[0]}; };
    return p;
  };
  const auto reopen = [](Store& store) {
    StudyRow row = *store.find_study("main");
    row.state = "open", row.summary = "";
    store.put_study(row);
    return row;
  };
  const auto is_new = [](const uncertainty::Sample& s) { return s.x[0] >= 12; };
  run(make(1), make_options(folder / "a"));
  const StudyResult r = run(make(2), make_options(folder / "a"));
  Store store(folder / "a");
  const StudyRow row = reopen(store);
  EXPECT_GT(store.load_results(row.model).size(), r.alpha.archive.size()) << "the store keeps both";
  const StudyResult seen = read_study(make(2), store, row);
  EXPECT_EQ(seen.alpha.archive.size(), r.alpha.archive.size());
  EXPECT_EQ(seen.alpha.failed, r.alpha.failed);
  // of a third formula nothing is there but where none has a value
  const StudyResult none = read_study(make(3), store, row);
  EXPECT_GT(none.alpha.archive.size(), 0u);
  EXPECT_TRUE(std::none_of(none.alpha.archive.samples().begin(), none.alpha.archive.samples().end(), is_new));
  // narrower numbers, and a constraint
  Problem narrow = make(2);
  narrow.space.inputs[0] = uncertainty::make_triangular(20, 25, 30);
  narrow.space.constraints = {[](const Point& x) { return x[0] + x[1] - 95; }};
  const StudyResult part = read_study(narrow, store, row);
  EXPECT_GT(part.alpha.archive.size(), 0u);
  EXPECT_LT(part.alpha.archive.size(), r.alpha.archive.size());
  for (const uncertainty::Sample& s : part.alpha.archive.samples()) {
    EXPECT_TRUE(s.x[0] >= 20 && s.x[0] <= 30 && s.x[0] + s.x[1] <= 95) << s.x[0] << " " << s.x[1];
  }
  // nothing that was run for an interaction is left out
  for (const bool is_joint : {false, true}) {
    Problem tied = make_small_problem(600);
    if (is_joint)
      tied.space.joint = [](const Point& x) { return std::max(0.0, 1 - std::abs(x[0] - 25) / 8); };
    else
      tied.space.constraints = {[](const Point& x) { return x[0] + x[1] - 95; }};
    const std::string name = folder / (is_joint ? "joint" : "constraint");
    const StudyResult whole = run(tied, make_options(name));
    Store own(name);
    EXPECT_EQ(read_study(tied, own, reopen(own)).alpha.archive.size(), whole.alpha.archive.size()) << is_joint;
  }
}

// y = x1 + x2, which fails at the core: bounds are those at the corners of each cut, but for the core's own.
TEST(StudyReference, MarksBoundsAroundACoreThatFails) {
  const Folder folder;
  Problem p = make_small_problem(3000);
  RunnerFactories factories = {{"small", [](const std::string&) -> Runner {
                                  return [](auto points, const auto& give, const auto&) {
                                    for (std::size_t i = 0; i < points.size(); ++i) {
                                      const Point& x = points[i];
                                      if (std::abs(x[0] - 25) < 0.5)
                                        give(i, {Answer::Kind::Failed, {}, "", {}, "core", 0});
                                      else
                                        give(i, {Answer::Kind::Done, {{"y", x[0] + x[1]}}, "", {}, "", 0});
                                    }
                                  };
                                }}};
  const StudyResult r = run(p, make_options(folder / "a"), factories);
  ASSERT_EQ(r.ending, uncertainty::Ending::Complete);
  ASSERT_EQ(r.alpha.classes.size(), 2u);
  for (const auto* outputs : {&r.alpha.outputs, &r.alpha.classes[1].outputs})
    for (const auto& l : outputs->at(0).levels) {
      const bool is_core = l.alpha == 1;
      EXPECT_EQ(l.lower.converged, !is_core) << l.alpha;
      EXPECT_EQ(l.upper.converged, !is_core) << l.alpha;
      if (is_core) continue;
      EXPECT_NEAR(l.lower.value, 43.6 + 45.4 * l.alpha, 1e-9);
      EXPECT_NEAR(l.upper.value, 133 - 44 * l.alpha, 1e-9);
    }
  // one row for each level: of the only outcome that has numbers there is nothing else to say
  const std::string csv = write_membership_csv(p, r);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 5) << csv;
  Store store(folder / "a");
  EXPECT_EQ(write_results_json(p, read_study(p, store, *store.find_study("main"))), write_results_json(p, r));
}

/// Islands of the class "in" in 2 inputs: valleys of one cross valleys of the other.
RunnerFactories make_island_factories() {
  return {{"small", [](const std::string&) -> Runner {
             return [](auto points, const auto& give, const auto&) {
               for (std::size_t i = 0; i < points.size(); ++i) {
                 const double a = (points[i][0] - 25) / 10, b = (points[i][1] - 64) / 12;
                 const bool in = std::sin(5 * a) + std::cos(3 * b + 1) + 0.2 * b < -1.9;
                 give(i, {Answer::Kind::Done, {{"z", in ? 1.0 : 0.0}}, in ? "in" : "out", {}, "", 0});
               }
             };
           }}};
}

TEST(Study, IsCompleteOnlyWhereSearchesOfPossibilitiesAre) {
  const Folder folder;
  for (const int limit : {200, 1000, 3000, 10000}) {
    const Problem p = make_small_problem(limit);
    const std::string name = folder / std::to_string(limit);
    const StudyResult r = run(p, make_options(name), make_island_factories());
    ASSERT_EQ(r.possibilities.classes.size(), 2u) << limit;
    bool all = true;
    for (const auto& c : r.possibilities.classes) {
      const auto seen = uncertainty::read_possibility(p.space, r.alpha.archive, c.outcome);
      EXPECT_EQ(c.possibility, seen.possibility) << limit;
      EXPECT_EQ(c.sample, seen.sample) << limit;
      EXPECT_EQ(c.above, seen.above) << limit;
      EXPECT_TRUE(c.resolution > 0 || c.possibility >= 1) << limit;
      all = all && c.converged;
    }
    EXPECT_TRUE(all || r.ending != uncertainty::Ending::Complete) << limit;
    EXPECT_TRUE(all || limit < 10000);
    EXPECT_EQ(r.alpha.archive.size() < static_cast<std::size_t>(limit) && !all,
              r.ending == uncertainty::Ending::NotConverged && !all);
    const std::string csv = write_outcomes_csv(p, r);
    EXPECT_NE(csv.find("necessity,possibility_converged,necessity_converged\nout,"), std::string::npos) << csv;
    EXPECT_EQ(csv.ends_with(all ? ",1,1\n" : ",0,1\n"), true) << csv;
    Store store(name);
    EXPECT_EQ(write_results_json(p, read_study(p, store, *store.find_study("main"))), write_results_json(p, r));
  }
}

/// Many basins of like depth: no limit is enough for a proper search.
RunnerFactories make_wavy_factories(bool has_outcomes) {
  return {{"small", [has_outcomes](const std::string&) -> Runner {
             return [has_outcomes](auto points, const auto& give, const auto& cancel) {
               for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                 const double a = points[i][0], b = points[i][1];
                 const double z = std::cos(3 * a) * std::cos(2 * b) + 1e-3 * (a - b);
                 give(i, {Answer::Kind::Done, {{"z", z}}, has_outcomes && a + b > 110 ? "far" : "", {}, "", 0});
               }
             };
           }}};
}

TEST(Study, SpendsAllRunsBeforeItSaysThatTheyAreUsedUp) {
  const Folder folder;
  int number = 0;
  for (const bool has_outcomes : {false, true})
    for (const bool has_drivers : {false, true})
      for (const int limit : {30, 100, 700}) {
        Problem p = make_small_problem(limit);
        p.has_drivers = has_drivers;
        const StudyResult r =
            run(p, make_options(folder / std::to_string(number++)), make_wavy_factories(has_outcomes));
        EXPECT_EQ(r.ending, uncertainty::Ending::LimitReached) << limit << has_outcomes << has_drivers;
        EXPECT_EQ(r.alpha.archive.size(), static_cast<std::size_t>(limit)) << has_outcomes << has_drivers;
      }
}

TEST(StudyReplay, GoesOnInTheRunsThatOthersLeft) {
  const Folder folder;
  const Problem p = make_small_problem(400);
  const std::string whole = write_bits(run(p, make_options(folder / "a", 1), make_wavy_factories(true)));
  const StudyOptions o = make_options(folder / "b", 3);
  for (const int stop : {150, 370, 1 << 30}) {
    std::atomic<bool> cancel = false;
    Progress progress;
    progress.cancel = &cancel;
    RunnerFactories slow = {{"small", [&](const std::string&) -> Runner {
                               return [&, inner = make_wavy_factories(true).at("small")("")](
                                          auto points, const auto& give, const auto& stopped) {
                                 std::this_thread::sleep_for(std::chrono::milliseconds(points.size()));
                                 inner(points, give, stopped);
                               };
                             }}};
    const StudyResult r = run_study(p, slow, o, progress, [&](const StudyState& s) {
      if (s.done > stop) cancel = true;
    });
    if (stop == 1 << 30) { EXPECT_EQ(write_bits(r), whole); }
  }
}

TEST(Study, RunsFailedOnesAgainWhenAsked) {
  const Folder folder;
  const Problem p = make_small_problem(300);
  StudyOptions o = make_options(folder / "a");
  const StudyResult r = run(p, o);
  ASSERT_GT(r.alpha.failed, 0);
  EXPECT_EQ(r.failures.at(0), std::to_string(r.alpha.failed) + " x too strong");
  long again = 0;
  const auto watch = [&](const StudyState& s) { again = s.run_here; };
  run_study(p, make_small_factories(), o, {}, watch);
  EXPECT_EQ(again, 0);
  o.rerun_failed = true;
  EXPECT_EQ(write_bits(run_study(p, make_small_factories(), o, {}, watch)), write_bits(r));
  EXPECT_EQ(again, r.alpha.failed);
}

TEST(Study, IsOpenOnceAnotherOneRunsItsFailedPointsAgain) {
  const Folder folder;
  Problem p = make_small_problem(300);
  StudyOptions a = make_options(folder / "s"), b = a;
  b.name = "other";
  run(p, a);
  p.seed = 7;
  const StudyResult r = run(p, b);
  ASSERT_GT(r.alpha.failed, 0);
  Store store(folder / "s");
  ASSERT_EQ(store.find_study("other")->state, "finished");
  ASSERT_GT(store.rerun_failed(store.find_study("main")->model), 0);
  EXPECT_EQ(store.find_study("other")->state, "open");
  EXPECT_FALSE(read_study(p, store, *store.find_study("other")).is_finished);
  EXPECT_EQ(write_bits(run(p, b)), write_bits(r));
  EXPECT_EQ(store.find_study("other")->state, "finished");
}

TEST(Study, IsNotReadAsFinishedWithoutAllOfItsRuns) {
  const Folder folder;
  const Problem p = make_small_problem(300);
  run(p, make_options(folder / "s"));
  Store store(folder / "s");
  const StudyRow row = *store.find_study("main");
  ASSERT_TRUE(read_study(p, store, row).is_finished);
  const std::string some = store.load_results(row.model).front().hash;
  store.rerun({some});
  const StudyResult r = read_study(p, store, row);
  EXPECT_FALSE(r.is_finished);
  for (const auto& output : r.alpha.outputs)
    for (const auto& level : output.levels) EXPECT_FALSE(level.lower.converged || level.upper.converged);
}

TEST(Study, BegunElsewhereIsNotReplacedByAnotherOneOfItsName) {
  const Folder folder;
  const Problem p = make_small_problem(200);
  StudyOptions o = make_options(folder / "s");
  o.source = "house X";
  const StudyResult r = run(p, o);
  Store store(folder / "s");
  const std::string was = store.find_study("main")->definition;
  StudyOptions other = o;
  other.source = "house Y";
  other.is_new = true;
  try {
    run(p, other);
    FAIL() << "was taken";
  } catch (const InputError& e) { EXPECT_EQ(e.first_error().code, "E822"); }
  EXPECT_EQ(store.find_study("main")->definition, was);
  // the same one, from a folder of another machine
  o.is_new = true;
  o.source_name = "elsewhere.toml";
  EXPECT_EQ(write_bits(run(p, o)), write_bits(r));
}

TEST(Study, KeepsPointsWithoutAFormulaAsFailed) {
  const Folder folder;
  Problem p = make_small_problem(300);
  p.derived = {{"d", "", 1}};
  p.calc_derived = [](const Point& x) { return std::vector{std::sqrt(40 - x[0])}; };
  const StudyResult r = run(p, make_options(folder / "a"));
  EXPECT_GT(r.alpha.failed, 0);
  EXPECT_EQ(r.failures.at(0), std::to_string(r.alpha.failed) + " x d: the formula has no value there");
  Store store(folder / "a");
  EXPECT_EQ(write_bits(read_study(p, store, store.find_study("main").value())), write_bits(r));
}

TEST(Study, StaysFinishedWhenACommandIsRefused) {
  const Folder folder;
  const Problem p = make_small_problem(200);
  const StudyResult r = run(p, make_options(folder / "a"));
  Store store(folder / "a");
  const StudyRow row = *store.find_study("main");
  ASSERT_EQ(row.state, "finished");
  Problem no_such_output = p, no_such_level = p, broken = p;
  no_such_output.permissible = "zz <= 3";
  no_such_level.levels = {0, 2};
  broken.limit = 400;  // it comes to new points, whose answers cannot be understood
  const RunnerFactories refusing = {{"small", [](const std::string&) -> Runner {
                                       return [](auto points, const auto& give, const auto&) {
                                         for (std::size_t i = 0; i < points.size(); ++i)
                                           give(i, {Answer::Kind::Done, {{"other", 1}}, "", {}, "", 0});
                                       };
                                     }}};
  for (const Problem& asked : {no_such_output, no_such_level, broken}) {
    EXPECT_THROW(run(asked, make_options(folder / "a"), refusing), InputError);
    const StudyRow now = *store.find_study("main");
    EXPECT_EQ(now.state, "finished");
    EXPECT_EQ(now.summary, row.summary);
    EXPECT_EQ(now.definition, row.definition);
    EXPECT_EQ(write_bits(read_study(p, store, now)), write_bits(r));
  }
}

TEST(Study, RefusesAnotherModelInItsPlace) {
  const Folder folder;
  Problem p = make_small_problem(100);
  run(p, make_options(folder / "a"));
  p.identity = R"({"command": "other"})";
  EXPECT_THROW(run(p, make_options(folder / "a")), InputError);
}

TEST(Study, RefusesOutputsThatChange) {
  const Folder folder;
  RunnerFactories factories = {
      {"small", [](const std::string&) -> Runner {
         return [](auto points, const auto& give, const auto&) {
           for (std::size_t i = 0; i < points.size(); ++i)
             give(i, {Answer::Kind::Done, {{points[i][0] < 20 ? "a" : "b", 1}}, "", {}, "", 0});
         };
       }}};
  try {
    run(make_small_problem(100), make_options(folder / "a"), factories);
    FAIL() << "accepted";
  } catch (const InputError& e) { EXPECT_EQ(e.diagnostics().front().code, "E823"); }
}

/// y everywhere, and z too at the run of that number.
RunnerFactories make_strange_factories(int at, std::atomic<int>& runs) {
  return {{"small", [at, &runs](const std::string&) -> Runner {
             return [at, &runs](auto points, const auto& give, const auto&) {
               for (std::size_t i = 0; i < points.size(); ++i) {
                 Answer a{Answer::Kind::Done, {{"y", points[i][0] + points[i][1]}}, "", {}, "", 0};
                 if (++runs == at) a.outputs.emplace_back("z", 1);
                 a.line = nlohmann::json{{"outputs", {{"y", 1}, {"z", 1}}}}.dump();
                 give(i, a);
               }
             };
           }}};
}

TEST(Study, KeepsAStrangeAnswerOutAndGoesOnBehindIt) {
  const Folder folder;
  const Problem p = make_small_problem(200);
  std::atomic<int> runs = 0;
  const StudyResult whole = run(p, make_options(folder / "a"), make_strange_factories(0, runs));
  runs = 0;
  try {
    run(p, make_options(folder / "b"), make_strange_factories(40, runs));
    FAIL() << "accepted";
  } catch (const InputError& e) {
    const Diagnostic& d = e.diagnostics().front();
    EXPECT_EQ(d.code, "E823");
    EXPECT_EQ(d.where.column, 19) << "at the name that is new";
    EXPECT_EQ(d.message, "the model gave the outputs y, z at this point and y at others");
    EXPECT_FALSE(d.help.empty());
  }
  Store store(folder / "b");
  EXPECT_GE(store.load_results(calc_model_hash(p)).size(), 30u) << "what was run before is kept";
  for (const StoredResult& r : store.load_results(calc_model_hash(p))) EXPECT_EQ(r.answer.outputs.size(), 1u);
  EXPECT_NO_THROW(read_study(p, store, *store.find_study("main")));
  runs = 1000;
  EXPECT_EQ(write_bits(run(p, make_options(folder / "b"), make_strange_factories(0, runs))), write_bits(whole));
}

/// Trajectories of two values, or none, and one of three at the run of that number.
RunnerFactories make_curved_factories(int at, std::atomic<int>& runs) {
  return {{"small", [at, &runs](const std::string&) -> Runner {
             return [at, &runs](auto points, const auto& give, const auto&) {
               for (std::size_t i = 0; i < points.size(); ++i) {
                 Answer a{Answer::Kind::Done, {{"y", points[i][0]}}, "", {}, "", 0};
                 if (points[i][1] > 40) a.trajectory = {1, 2};
                 if (++runs == at) a.trajectory = {1, 2, 3};
                 a.line = R"({"y": 1, "trajectory": [1, 2, 3]})";
                 give(i, a);
               }
             };
           }}};
}

TEST(Study, RefusesTrajectoriesThatChangeTheirLength) {
  const Folder folder;
  const Problem p = make_small_problem(100);
  std::atomic<int> runs = 0;
  const StudyResult whole = run(p, make_options(folder / "a"), make_curved_factories(0, runs));
  runs = 0;
  try {
    run(p, make_options(folder / "b"), make_curved_factories(40, runs));
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics().front().code, "E823");
    EXPECT_EQ(e.diagnostics().front().where.column, 10);
  }
  EXPECT_EQ(write_bits(run(p, make_options(folder / "b"), make_curved_factories(0, runs))), write_bits(whole));
  // an older version kept them
  Store store(folder / "a");
  StudyRow row = *store.find_study("main");
  row.state = "open", row.summary = "";
  store.put_study(row);
  store.rerun({store.load_results(row.model).at(40).hash});
  const std::vector<Job> jobs = store.claim("w", 1, 100, row.model);
  ASSERT_EQ(jobs.size(), 1u);
  ASSERT_TRUE(store.finish(jobs[0], "w", {Answer::Kind::Done, {{"y", jobs[0].inputs[0]}}, "", {1, 2, 3}, "", 0}));
  EXPECT_EQ(read_study(p, store, row).alpha.archive.size() + 1, whole.alpha.archive.size());
  EXPECT_EQ(write_bits(run(p, make_options(folder / "a"), make_curved_factories(0, runs))), write_bits(whole));
}

TEST(Study, TakesAStrangeAnswerOutOfAnOldStore) {
  const Folder folder;
  const Problem p = make_small_problem(200);
  std::atomic<int> runs = 0;
  const StudyResult whole = run(p, make_options(folder / "a"), make_strange_factories(0, runs));
  const std::string model = calc_model_hash(p);
  {
    Store store(folder / "a");
    StudyRow row = *store.find_study("main");
    row.state = "open", row.summary = "";
    store.put_study(row);
    const StoredResult some = store.load_results(model).at(40);
    store.rerun({some.hash});
    const std::vector<Job> jobs = store.claim("w", 1, 100, model);
    ASSERT_EQ(jobs.size(), 1u);
    ASSERT_TRUE(store.finish(jobs[0], "w", {Answer::Kind::Done, {{"y", 1}, {"z", 2}}, "", {}, "", 0}));
    const StudyResult seen = read_study(p, store, row);
    EXPECT_EQ(seen.alpha.archive.size() + 1, whole.alpha.archive.size()) << "all but that one can be shown";
  }
  EXPECT_EQ(write_bits(run(p, make_options(folder / "a"), make_strange_factories(0, runs))), write_bits(whole));
}

TEST(Study, TellsWhatEndedAWorker) {
  const Folder folder;
  RunnerFactories factories = {{"small", [](const std::string&) -> Runner { throw std::runtime_error("no model"); }}};
  EXPECT_THROW(run(make_small_problem(100), make_options(folder / "a"), factories), std::runtime_error);
  // nothing is held by a worker that does not exist
  Store store(folder / "a");
  EXPECT_EQ(store.count(calc_model_hash(make_small_problem(100))).running, 0);
}

}  // namespace
}  // namespace topple::study
