#pragma once
/// A study with a jump and a failure, small enough for tests, and what two of them must have in common.

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "study/manager.h"
#include "study/page.h"
#include "study/results.h"

namespace topple::study {

/// The reference case "jump" with a corner where the model fails: z = R - 8 - 10 [R < 8], R = x1 x2 / 100.
inline Problem make_small_problem(int limit = 1500) {
  Problem p;
  p.kind = "small";
  p.inputs = {{"x1", "", 1}, {"x2", "", 1}};
  p.space.inputs = {uncertainty::make_triangular(10, 25, 45), uncertainty::make_triangular(33.6, 64, 88)};
  p.limit = limit;
  return p;
}

inline Answer calc_small(const Point& x) {
  Answer a;
  const double R = x[0] * x[1] / 100;
  if (x[0] > 44 && x[1] > 86) {
    a.kind = Answer::Kind::Failed;
    a.text = "too strong";
    return a;
  }
  a.kind = Answer::Kind::Done;
  a.outcome = R < 8 ? "falls" : "stands";
  a.outputs = {{"z", R - 8 - (R < 8 ? 10 : 0)}, {"root", std::sqrt(R)}};
  return a;
}

/// Runs of the given length [s].
inline RunnerFactories make_small_factories(double seconds = 0) {
  return {{"small", [seconds](const std::string&) -> Runner {
             return [seconds](std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                              const std::atomic<bool>& cancel) {
               for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                 if (seconds > 0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
                 give(i, calc_small(points[i]));
               }
             };
           }}};
}

inline Answer done(std::vector<std::pair<std::string, double>> outputs, const std::string& outcome = "",
                   std::vector<double> trajectory = {}) {
  return {Answer::Kind::Done, std::move(outputs), outcome, std::move(trajectory), "", 0};
}

/// Of any model; its problems are of the kind "small".
inline RunnerFactories make_factories(const std::function<Answer(const Point&)>& model) {
  return {{"small", [model](const std::string&) -> Runner {
             return [model](auto points, const auto& give, const auto&) {
               for (std::size_t i = 0; i < points.size(); ++i) give(i, model(points[i]));
             };
           }}};
}

inline StudyResult run_model(const Problem& p, const std::string& store,
                             const std::function<Answer(const Point&)>& model, int jobs = 2) {
  StudyOptions o;
  o.store = store;
  o.pool.jobs = jobs;
  o.pool.batch = 16;
  return run_study(p, make_factories(model), o, {}, {});
}

/// In four parts: interrupted after so many runs, and gone on with.
inline StudyResult run_in_parts(const Problem& p, const std::string& store,
                                const std::function<Answer(const Point&)>& model) {
  StudyOptions o;
  o.store = store;
  o.pool.batch = 8;
  StudyResult part;
  for (const long stop : {400L, 300L, 200L, 100000L}) {
    std::atomic<bool> cancel = false;
    std::atomic<long> runs = 0;
    Progress progress;
    progress.cancel = &cancel;
    part = run_study(p, make_factories([&](const Point& x) {
                       if (++runs >= stop) cancel = true;
                       return model(x);
                     }),
                     o, progress, {});
    EXPECT_EQ(part.is_finished, stop == 100000L) << stop;
  }
  return part;
}

inline Problem make_problem(std::vector<uncertainty::FuzzyNumber> inputs, int limit) {
  Problem p;
  p.kind = "small";
  for (std::size_t i = 0; i < inputs.size(); ++i) p.inputs.push_back({"x" + std::to_string(i + 1), "", 1});
  p.space.inputs = std::move(inputs);
  p.limit = limit;
  return p;
}

/// Every bit that a study found.
inline std::string write_bits(const StudyResult& r) {
  std::string text;
  const auto add = [&text](double x) { text += std::to_string(std::bit_cast<std::uint64_t>(x)) + " "; };
  for (const std::string& name : r.outputs) text += name + " ";
  for (const std::string& name : r.outcomes) text += name + " ";
  const auto add_bounds = [&](const std::vector<uncertainty::OutputBounds>& outputs) {
    for (const auto& o : outputs)
      for (const auto& l : o.levels) add(l.alpha), add(l.lower.value), add(l.upper.value);
    text += "\n";
  };
  add_bounds(r.alpha.outputs);
  for (const auto& c : r.alpha.classes) {
    text += std::to_string(c.outcome) + " " + std::to_string(c.count) + " ";
    add(c.possibility), add_bounds(c.outputs);
  }
  for (const auto& p : r.possibilities.classes) add(p.possibility);
  for (const auto* found : {&r.requirement, &r.limits})
    for (const auto& p : *found) add(p.possibility), add(p.resolution), text += p.converged ? "c" : "o";
  for (const auto& s : r.alpha.archive.samples()) {
    for (const double x : s.x) add(x);
    for (const double y : s.result.values) add(y);
    text += s.result.text + "\n";
  }
  return text;
}

/// The same bits and texts for any threads, after interruptions and out of the store.
///   folder  of the stores, with a slash at its end
inline StudyResult expect_replays(const Problem& p, const std::string& folder) {
  StudyResult whole = run_model(p, folder + "a", calc_small, 1);
  EXPECT_EQ(write_bits(run_model(p, folder + "b", calc_small, 4)), write_bits(whole));
  Store store(folder + "a");
  for (const StudyResult& r :
       {run_in_parts(p, folder + "c", calc_small), read_study(p, store, *store.find_study("main"))}) {
    EXPECT_EQ(write_results_json(p, r), write_results_json(p, whole));
    EXPECT_EQ(write_requirement_csv(p, r), write_requirement_csv(p, whole));
    EXPECT_EQ(write_limits_csv(p, r), write_limits_csv(p, whole));
    EXPECT_EQ(to_page_json(p, r, {}), to_page_json(p, whole, {}));
  }
  return whole;
}

}  // namespace topple::study
