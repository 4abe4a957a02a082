#include "study/randomness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "../product/plan_text.h"
#include "server.h"
#include "small_study.h"
#include "study/evaluator.h"
#include "study/inputs_file.h"
#include "study/results.h"
#include "study/store.h"
#include "uncertainty/randomness.h"
#include "wrong_inputs.h"

namespace topple::study {
namespace {

double calc_phi(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

/// A model in this process that gets points by their names.
using Model = std::function<Answer(const std::map<std::string, double>&)>;

struct Calls {
  std::mutex mutex;
  std::vector<std::size_t> sizes;  // of batches
};

RunnerFactories make_models(const Model& model, Calls* calls = nullptr) {
  return {{"evaluator", [=](const std::string& definition) -> Runner {
             const auto names = nlohmann::json::parse(definition).at("inputs").get<std::vector<std::string>>();
             return [=](std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                        const std::atomic<bool>&) {
               if (calls) {
                 const std::lock_guard lock(calls->mutex);
                 calls->sizes.push_back(points.size());
               }
               for (std::size_t i = 0; i < points.size(); ++i) {
                 std::map<std::string, double> x;
                 for (std::size_t k = 0; k < names.size(); ++k) x[names[k]] = points[i][k];
                 Answer a = model(x);
                 // as an evaluator whose program has ended: nothing more comes
                 if (a.kind == Answer::Kind::Crashed) {
                   for (std::size_t j = i; j < points.size(); ++j) give(j, a);
                   return;
                 }
                 give(i, std::move(a));
               }
             };
           }}};
}

RunnerFactories make_all(const RunnerFactories& models) {
  return {{random_kind, [models](const std::string& definition) { return make_random_runner(definition, models); }}};
}

Problem read(const std::string& text) {
  Problem p = read_inputs_text(text, "in.toml");
  set_evaluator(p, "model", 0, false);
  return p;
}

StudyResult run(const Problem& p, const Model& model, int jobs = 2, Calls* calls = nullptr) {
  const Folder folder;
  StudyOptions o;
  o.store = folder / "s";
  o.pool.jobs = jobs;
  return run_study(p, make_all(make_models(model, calls)), o, {}, {});
}

/// The statistics at one point.
Answer ask(const Problem& p, const Model& model, const Point& x, Calls* calls = nullptr) {
  const Runner runner = make_random_runner(make_model_definition(p), make_models(model, calls));
  Answer out;
  const std::atomic<bool> cancel = false;
  Point all = x;
  if (p.calc_derived)
    for (const double v : p.calc_derived(x)) all.push_back(v);
  runner(
      {&all, 1}, [&](std::size_t, Answer a) { out = std::move(a); }, cancel);
  return out;
}

double value_of(const Answer& a, const std::string& name) {
  for (const auto& [given, value] : a.outputs)
    if (given == name) return value;
  ADD_FAILURE() << name << " is not among the outputs: " << a.text;
  return std::nan("");
}

const std::string linear = R"toml(title = "Linear"
[inputs]
m = { triangular = [3, 4, 5] }
s = { triangular = [0.5, 1, 2] }
[random]
x = { normal = ["m", "s"], unit = "m" }
[randomness]
runs = 200
seed = 7
statistics = ["mean(y)", "sd(y)", "q95(y)", "p(high)", "p(y > 12.5)", "p( y<=12.5 )"]
[search]
samples = 600
levels = [0, 0.5, 1]
)toml";

const Model line = [](const std::map<std::string, double>& x) {
  const double y = 2 * x.at("x") + 3;
  return done({{"y", y}, {"z", 0}}, y > 12.5 ? "high" : "low");
};

/// Errors of strata of a normal variable, in its deviation (theory, section 8); n = 200.
constexpr double of_mean = 1e-14, of_deviation = 7.1e-4, of_q95 = 4.9e-4, of_share = 0.5 / 200;

// y = 2 x + 3, x ~ N(m, s): all statistics are monotone in m and s, so bounds are those of the ends of each cut.
TEST(RandomInputsPhysics, NormalOnALineHasClosedFormsAtEveryLevel) {
  const Problem p = read(linear);
  const StudyResult r = run(p, line);
  ASSERT_TRUE(r.is_finished);
  ASSERT_EQ(r.outputs,
            (std::vector<std::string>{"mean(y)", "sd(y)", "q95(y)", "p(high)", "p(y > 12.5)", "p(y <= 12.5)"}));
  EXPECT_EQ(count_outcomes(r.alpha), 1) << "outcomes are of inner runs";
  const double z = uncertainty::calc_normal_quantile(0.95);
  for (const auto& [k, m0, m1, s0, s1] :
       {std::tuple{0, 3.0, 5.0, 0.5, 2.0}, {1, 3.5, 4.5, 0.75, 1.5}, {2, 4.0, 4.0, 1.0, 1.0}}) {
    const auto bounds = [&, level = k](int o) { return r.alpha.outputs[o].levels[level]; };
    EXPECT_NEAR(bounds(0).lower.value, 2 * m0 + 3, of_mean * 2 * 13);
    EXPECT_NEAR(bounds(0).upper.value, 2 * m1 + 3, of_mean * 2 * 13);
    EXPECT_NEAR(bounds(1).lower.value, 2 * s0, of_deviation * 2 * s0);
    EXPECT_NEAR(bounds(1).upper.value, 2 * s1, of_deviation * 2 * s1);
    EXPECT_NEAR(bounds(2).lower.value, 2 * (m0 + z * s0) + 3, of_q95 * 2 * s0);
    EXPECT_NEAR(bounds(2).upper.value, 2 * (m1 + z * s1) + 3, of_q95 * 2 * s1);
    // P(x > 4.75): largest at the ends with m, where it is below 1/2 with s too
    const double high = m1 < 4.75 ? s1 : s0;
    EXPECT_NEAR(bounds(3).lower.value, 1 - calc_phi((4.75 - m0) / s0), of_share);
    EXPECT_NEAR(bounds(3).upper.value, 1 - calc_phi((4.75 - m1) / high), of_share);
    EXPECT_EQ(bounds(4).upper.value, bounds(3).upper.value);
    EXPECT_EQ(bounds(4).lower.value, bounds(3).lower.value);
    EXPECT_NEAR(bounds(5).lower.value, 1 - bounds(4).upper.value, 1e-15);
  }
}

// x1 ~ N(m, 0.3), x2 ~ N(2, 0.4): the sum is N(m + 2, 0.5). The mean is exact; strata leave a correlation below
// 1.1/n, from which the deviation's error follows; quantiles and shares are as good as the standard error of
// independent points, at least.
TEST(RandomInputsPhysics, SumOfTwoIndependentOnesIsNormal) {
  for (const int seed : {1, 2, 3}) {
    const Problem p = read(
        "[inputs]\nm = { triangular = [9, 10, 12] }\n[random]\nx1 = { normal = [\"m\", 0.3] }\nx2 "
        "= { normal = [2, 0.4] }\n[randomness]\nruns = 400\nseed = " +
        std::to_string(seed) + "\nstatistics = [\"mean(y)\", \"sd(y)\", \"q95(y)\", \"p(y > 12.5)\"]\n");
    const Model sum = [](const auto& x) { return done({{"y", x.at("x1") + x.at("x2")}}); };
    for (const double m : {9.0, 10.0, 12.0}) {
      const Answer a = ask(p, sum, {m});
      EXPECT_NEAR(value_of(a, "mean(y)"), m + 2, 1e-12);
      EXPECT_NEAR(value_of(a, "sd(y)"), 0.5, 3.7e-4 * 0.5 + 1.1 / 400 * 0.3 * 0.4 / 0.5);
      EXPECT_NEAR(value_of(a, "q95(y)"), m + 2 + 0.5 * 1.6448536, std::sqrt(0.95 * 0.05 / 400) / 0.10313564 * 0.5);
      const double share = 1 - calc_phi((12.5 - m - 2) / 0.5);
      EXPECT_NEAR(value_of(a, "p(y > 12.5)"), share, std::sqrt(share * (1 - share) / 400) + 0.5 / 400);
    }
  }
}

// Each distribution, its parameters fuzzy or numbers, against its own quantile function.
TEST(RandomInputsPhysics, EveryDistributionHasItsQuantiles) {
  const double euler = 0.57721566490153286;
  const auto lognormal = [](double mean, double deviation, double z) {
    const double v = std::log(1 + deviation * deviation / mean / mean);
    return mean * std::exp(-v / 2 + std::sqrt(v) * z);
  };
  struct Case {
    const char* distribution;
    double q5, median, q95;
  };
  const double scale = 2 * std::sqrt(6.0) / std::numbers::pi;
  for (const Case& c :
       {Case{"lognormal = [\"m\", 2]", lognormal(8, 2, -1.6448536), lognormal(8, 2, 0), lognormal(8, 2, 1.6448536)},
        {"gumbel = [\"m\", 2]", 8 - scale * (euler + std::log(-std::log(0.05))),
         8 - scale * (euler + std::log(-std::log(0.5))), 8 - scale * (euler + std::log(-std::log(0.95)))},
        {"uniform = [2, \"m\"]", 2.3, 5, 7.7},
        {"weibull = [\"m\", 1.5]", 8 * std::pow(-std::log(0.95), 1 / 1.5), 8 * std::pow(std::log(2.0), 1 / 1.5),
         8 * std::pow(-std::log(0.05), 1 / 1.5)},
        {"normal = [1, \"m\"]", 1 - 8 * 1.6448536, 1, 1 + 8 * 1.6448536}}) {
    const Problem p = read("[inputs]\nm = { triangular = [7, 8, 9] }\n[random]\nx = { " + std::string(c.distribution) +
                           " }\n[randomness]\nruns = 1000\nstatistics = [\"q5(x)\", \"q50(x)\", \"q95(x)\"]\n");
    const Answer a = ask(p, [](const auto& x) { return done({{"x", x.at("x")}}); }, {8});
    EXPECT_NEAR(value_of(a, "q5(x)"), c.q5, 2e-4 * 8) << c.distribution;
    EXPECT_NEAR(value_of(a, "q50(x)"), c.median, 2e-4 * 8) << c.distribution;
    EXPECT_NEAR(value_of(a, "q95(x)"), c.q95, 2e-4 * 8) << c.distribution;
  }
}

// s = m / 10 by a formula; z = x^2 by another one, which the model sees.
TEST(RandomInputs, TakeParametersFromFormulasAndGiveFormulasToTheModel) {
  const Problem p = read(R"toml([inputs]
m = { triangular = [9, 10, 12] }
[random]
x = { normal = ["m", "s"] }
w = { uniform = [0, 1] }
[derived]
z = "x^2"
s = "m / 10"
both = "z + s"
[interaction]
constraints = ["s <= 1.1"]
[randomness]
runs = 50
statistics = ["mean(y)"]
)toml");
  ASSERT_EQ(p.derived.size(), 1u) << "what follows from random inputs belongs to inner runs";
  EXPECT_EQ(p.derived[0].name, "s");
  EXPECT_EQ(p.calc_derived({10}), std::vector{1.0});
  EXPECT_TRUE(uncertainty::is_allowed(p.space, {11}));
  EXPECT_FALSE(uncertainty::is_allowed(p.space, {11.5}));
  std::set<std::string> seen;
  const Answer a = ask(p,
                       [&](const auto& x) {
                         for (const auto& [name, value] : x) seen.insert(name);
                         EXPECT_EQ(x.at("z"), x.at("x") * x.at("x"));
                         EXPECT_EQ(x.at("s"), 1.2);
                         EXPECT_EQ(x.at("both"), x.at("z") + x.at("s"));
                         return done({{"y", x.at("x")}});
                       },
                       {12});
  EXPECT_EQ(seen, (std::set<std::string>{"m", "s", "x", "w", "z", "both"}));
  EXPECT_NEAR(value_of(a, "mean(y)"), 12, 1e-12);
}

TEST(RandomInputs, AskForAllRunsOfAPointAtOnce) {
  Calls calls;
  const StudyResult r = run(read(linear), line, 2, &calls);
  EXPECT_EQ(calls.sizes.size(), r.alpha.archive.size());
  for (const std::size_t size : calls.sizes) EXPECT_EQ(size, 200u);
}

TEST(RandomInputsReplay, HaveTheSameBitsForAnyNumberOfWorkers) {
  const Problem p = read(linear);
  EXPECT_EQ(write_bits(run(p, line, 1)), write_bits(run(p, line, 4)));
}

TEST(RandomInputs, BelongToTheIdentityOfAStudy) {
  std::set<std::string> hashes{calc_model_hash(read(linear))};
  for (const auto& [from, to] : {std::pair{"normal = [\"m\", \"s\"]", "normal = [\"m\", 1]"},
                                 {"normal = [\"m\", \"s\"]", "lognormal = [\"m\", \"s\"]"},
                                 {"normal = [\"m\", \"s\"]", "normal = [\"m\", \"m\"]"},
                                 {"runs = 200", "runs = 201"},
                                 {"seed = 7", "seed = 8"},
                                 {"seed = 7", "seed = 7\nmost_failed = 0.1"},
                                 {"q95(y)", "q94(y)"},
                                 {"y > 12.5", "y >= 12.5"}})
    EXPECT_TRUE(hashes.insert(calc_model_hash(read(product::replaced(linear, from, to)))).second) << to;
  // what is searched, and how, does not: runs are shared
  for (const auto& [from, to] :
       {std::pair{"Linear", "Other"}, {"[3, 4, 5]", "[3, 4, 6]"}, {"samples = 600", "samples = 700"}})
    EXPECT_TRUE(hashes.contains(calc_model_hash(read(product::replaced(linear, from, to))))) << to;
}

TEST(RandomInputs, FailWhereInnerRunsDoAndSayHowMany) {
  // x > 6 fails: of N(5, 1) the 32 of 200 with u > .8413
  const Model failing = [](const auto& x) {
    if (x.at("x") <= 6) return done({{"y", x.at("x")}}, "ok");
    Answer a;
    a.kind = Answer::Kind::Failed;
    a.text = "too strong";
    return a;
  };
  const std::string text = product::replaced(linear, "\"p(high)\"", "\"p(ok)\"");
  const Answer strict = ask(read(text), failing, {5, 1});
  EXPECT_EQ(strict.kind, Answer::Kind::Failed);
  EXPECT_EQ(strict.text, "32 of 200 inner runs failed: too strong");
  EXPECT_EQ(ask(read(text), failing, {3, 0.5}).kind, Answer::Kind::Done);

  const Problem lenient = read(product::replaced(text, "seed = 7", "seed = 7\nmost_failed = 0.16"));
  ASSERT_EQ(lenient.outputs.back().name, "p(failed)") << "told where runs may fail";
  const Answer a = ask(lenient, failing, {5, 1});
  EXPECT_EQ(value_of(a, "p(failed)"), 0.16);
  EXPECT_EQ(value_of(a, "p(ok)"), 0.84) << "of all runs";
  EXPECT_EQ(value_of(a, "p(y <= 12.5)"), 0.84);
  EXPECT_LT(value_of(a, "mean(y)"), 5) << "of those that are done";
  EXPECT_EQ(ask(read(product::replaced(text, "seed = 7", "seed = 7\nmost_failed = 0.155")), failing, {5, 1}).kind,
            Answer::Kind::Failed);
}

TEST(RandomInputs, TryCrashedRunsAgainAlone) {
  Calls calls;
  int crashes = 0;
  const Model crashing = [&](const auto& x) {
    if (x.at("x") > 6 && crashes++ < 2) {
      Answer a;
      a.kind = Answer::Kind::Crashed;
      a.text = "ended without an answer";
      return a;
    }
    return line(x);
  };
  const Answer a = ask(read(linear), crashing, {5, 1}, &calls);
  ASSERT_EQ(a.kind, Answer::Kind::Done) << a.text;
  EXPECT_EQ(a.outputs, ask(read(linear), line, {5, 1}).outputs);
  EXPECT_EQ(calls.sizes[0], 200u);
  EXPECT_EQ(calls.sizes[1], 1u);
  // three times is a failed run
  const Model broken = [&](const auto& x) {
    Answer b;
    b.kind = x.at("x") > 6 ? Answer::Kind::Crashed : Answer::Kind::Done;
    b.text = "signal 11", b.outputs = {{"y", 1}};
    return b;
  };
  EXPECT_EQ(ask(read(linear), broken, {5, 1}).text, "32 of 200 inner runs failed: signal 11");
}

TEST(RandomInputs, RunsThatCrashFirstCountAsThoseThatCrashLater) {
  // a program that has not answered yet is refused after some crashes, one that has is not
  const auto crashing = [](double beyond, bool is_fresh) -> Model {
    return [=](const auto& x) {
      if (x.at("x") <= beyond) return done({{"y", x.at("x")}}, "ok");
      Refusal r;
      r.diagnostic = {Severity::Error, no_answer_code, {}, 1, "was started 10 times", ""};
      r.line = "signal 11";
      Answer a;
      a.kind = is_fresh ? Answer::Kind::Refused : Answer::Kind::Crashed;
      a.text = is_fresh ? write_refusal(r) : r.line;
      return a;
    };
  };
  const std::string text = product::replaced(linear, "\"p(high)\"", "\"p(ok)\"");
  const Problem lenient = read(product::replaced(text, "seed = 7", "seed = 7\nmost_failed = 0.2"));
  const Answer fresh = ask(lenient, crashing(6, true), {5, 1}), later = ask(lenient, crashing(6, false), {5, 1});
  ASSERT_EQ(fresh.kind, Answer::Kind::Done) << fresh.text;
  EXPECT_EQ(value_of(fresh, "p(failed)"), 0.16);
  EXPECT_EQ(fresh.outputs, later.outputs);
  // none has answered: refused, and where other points have had answers a failed point as any
  const Answer none = ask(lenient, crashing(-100, true), {5, 1});
  ASSERT_EQ(none.kind, Answer::Kind::Refused);
  EXPECT_EQ(read_refusal(none.text).diagnostic.code, no_answer_code);
  EXPECT_EQ(read_refusal(none.text).line, ask(lenient, crashing(-100, false), {5, 1}).text);
}

TEST(RandomInputs, RefuseAModelWithoutTheOutputs) {
  const Answer a = ask(read(linear), [](const auto&) { return done({{"tilt", 1}, {"reach", 2}}); }, {4, 1});
  ASSERT_EQ(a.kind, Answer::Kind::Refused);
  EXPECT_NE(a.text.find("E825"), std::string::npos);
  EXPECT_NE(a.text.find("no output \\\"y\\\""), std::string::npos) << a.text;
  EXPECT_NE(a.text.find("reach, tilt"), std::string::npos) << a.text;
}

TEST(RandomInputs, PointAtEveryMistake) {
  const std::string text =
      product::replaced(linear, "[randomness]", "[derived]\nd = \"x + m\"\nk = \"m - 6\"\n[randomness]");
  EXPECT_NO_THROW(read(text));
  for (const Wrong& w : {
           Wrong{"[0.5, 1, 2]", "[-0.5, 1, 2]", 6, 22, "E207", "standard deviation is below 0 somewhere within \"s\""},
           {"[\"m\", \"s\"]", "[\"m\", -1]", 6, 22, "E207", "standard deviation is below 0"},
           {"[\"m\", \"s\"]", "[\"m\", \"k\"]", 6, 22, "E207", "standard deviation is below 0"},
           {"[\"m\", \"s\"]", "[\"m\", \"t\"]", 6, 22, "E207", "no input \"t\""},
           {"[\"m\", \"s\"]", "[\"m\", \"d\"]", 6, 22, "E207", "\"d\" is random itself"},
           {"[\"m\", \"s\"]", "[\"m\"]", 6, 16, "E202", "a list of two"},
           {"normal = [\"m\", \"s\"]", "lognormal = [0, \"s\"]", 6, 20, "E207", "mean is not above 0"},
           {"normal = [\"m\", \"s\"]", "uniform = [\"m\", 4.5]", 6, 23, "E207", "lower end lies above the upper end"},
           {"normal = [\"m\", \"s\"]", "weibull = [\"m\", 0]", 6, 23, "E207", "shape is not above 0"},
           {"normal = [\"m\", \"s\"]", "norml = [\"m\", \"s\"]", 6, 5, "E207", "a distribution is wanted"},
           {"x = { normal", "m = { normal", 6, 1, "E203", "is an input already"},
           {"runs = 200", "runs = 1", 11, 8, "E205", "between 2"},
           {"runs = 200", "", 10, 1, "E201", "runs"},
           {"q95(y)", "q100(y)", 13, 37, "E825", "between 0 and 100 %"},
           {"q95(y)", "q0(y)", 13, 37, "E825", "between 0 and 100 %"},
           {"q95(y)", "q99.9(y)", 13, 37, "E825", "beyond the 200 runs"},
           {"q95(y)", "median(y)", 13, 36, "E825", "is no statistic"},
           {"q95(y)", "sd(y)", 13, 36, "E825", "asked for twice"},
           {"y > 12.5", "y > high", 13, 63, "E825", "a number is wanted"},
           {"[search]", "[interaction]\nconstraints = [\"d <= 100\"]\n[search]", 15, 16, "E207", "d is random"},
           {"x = { normal = [\"m\", \"s\"], unit = \"m\" }", "", 5, 1, "E203", "no random input"},
       }) {
    try {
      read(product::replaced(text, w.from, w.to));
      ADD_FAILURE() << w.to << " was taken";
    } catch (const InputError& e) {
      const Diagnostic d = find(e, w.words);
      EXPECT_EQ(d.code, w.code) << w.to << ": " << d.message;
      EXPECT_EQ(d.where.line, w.line) << w.to << ": " << d.message;
      EXPECT_EQ(d.where.column, w.column) << w.to << ": " << d.message;
      EXPECT_NE((d.message + d.help).find(w.words), std::string::npos) << w.to << ": " << d.message << " " << d.help;
    }
  }
  // one table without the other
  for (const char* table : {"[random]\nx = { normal = [\"m\", \"s\"], unit = \"m\" }\n",
                            "[randomness]\nruns = 200\nseed = 7\nstatistics = [\"mean(y)\", \"sd(y)\", \"q95(y)\", "
                            "\"p(high)\", \"p(y > 12.5)\", \"p( y<=12.5 )\"]\n"})
    EXPECT_THROW(read(product::replaced(linear, table, "")), InputError) << table;
}

TEST(RandomInputs, StandInResultsWithTheirDistributions) {
  const Problem p = read(linear);
  const StudyResult r = run(p, line);
  const auto j = make_results_json(p, r);
  EXPECT_EQ(j["random"]["runs"], 200);
  EXPECT_EQ(j["random"]["seed"], 7);
  EXPECT_EQ(j["random"]["inputs"][0]["distribution"], "normal");
  EXPECT_EQ(j["random"]["inputs"][0]["parameters"][1]["input"], "s");
  EXPECT_NE(tell_randomness(p).find("x is distributed normally with the mean m and the standard deviation s."),
            std::string::npos);
  EXPECT_EQ(tell_random_cost(p),
            "Random inputs: each point takes 200 runs of the model, 600 points take at most 120000 runs.");
}

}  // namespace
}  // namespace topple::study
