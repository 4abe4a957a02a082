// Plans with random values: statistics of their runs.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../collapse/plans.h"
#include "small_fuzzy_plan.h"
#include "study/plan_model.h"
#include "study/randomness.h"
#include "uncertainty/randomness.h"
#include "wrong_inputs.h"

namespace topple::study {
namespace {

double value_of(const Answer& a, const std::string& name) {
  for (const auto& [given, value] : a.outputs)
    if (given == name) return value;
  ADD_FAILURE() << name << " is not among the outputs: " << a.text;
  return std::nan("");
}

const std::string random_strengths = R"toml([fuzzy]
stage.1.charge.1.destroyed_length = { triangular = ["1 m", "1.2 m", "2 m"] }
concrete.C25.fct = { formula = "1.4 * ((fc - 8) / 10)^(2/3)" }
[fuzzy.parameters]
fc_mean = { triangular = ["24 N/mm2", "25 N/mm2", "28 N/mm2"] }
[fuzzy.random]
concrete.C25.fc = { lognormal = ["fc_mean", "2 N/mm2"] }
[fuzzy.randomness]
runs = 4
statistics = ["mean(tilt_0.2)", "p(stands)", "p(tilt_0.2 > 0.1)"]
)toml";

// The statistics of a point are those of the mapping's own runs at the quantiles (k - 1/2)/4 of the strength.
TEST(RandomPlan, GivesTheStatisticsOfItsMapping) {
  const product::Plan plan = read_small(random_strengths);
  const Problem p = make_plan_problem(plan, quick());
  ASSERT_EQ(p.inputs.size(), 2u);
  EXPECT_EQ(p.inputs[0].name, "stage.1.charge.1.destroyed_length");
  EXPECT_EQ(p.inputs[1].name, "fc_mean");
  EXPECT_EQ(p.inputs[1].unit, "N/mm2");
  EXPECT_TRUE(p.derived.empty()) << "it follows from a random value";
  ASSERT_EQ(p.outputs.size(), 3u);
  EXPECT_EQ(p.outputs[0].unit, "deg");
  EXPECT_EQ(p.outputs[1].unit, "");

  const Point x{1.4, 26e6};
  const Runner runner = make_random_runner(make_model_definition(p), {{"plan", make_plan_runner}});
  Answer a;
  const std::atomic<bool> cancel = false;
  runner(
      {&x, 1}, [&](std::size_t, Answer given) { a = std::move(given); }, cancel);
  ASSERT_EQ(a.kind, Answer::Kind::Done) << a.text;

  const PlanMapping mapping(plan, collapse::default_knowledge(), quick());
  std::vector<Point> points;
  for (int k = 0; k < 4; ++k)
    points.push_back({1.4, 26e6, uncertainty::make_lognormal()((k + 0.5) / 4, std::array{26e6, 2e6})});
  std::vector<uncertainty::Result> runs(4);
  mapping.evaluate(points, runs);
  double mean = 0, stands = 0, above = 0;
  for (const auto& r : runs) {
    ASSERT_EQ(r.state, uncertainty::Result::State::Done) << r.text;
    mean += r.values[0] / 4;
    stands += plan_outcomes()[static_cast<std::size_t>(r.outcome)] == "stands" ? 0.25 : 0;
    above += r.values[0] > 0.1 * std::numbers::pi / 180 ? 0.25 : 0;
  }
  EXPECT_NEAR(value_of(a, "mean(tilt_0.2)"), mean, 1e-15);
  EXPECT_GT(mean, 0);
  EXPECT_EQ(value_of(a, "p(stands)"), stands);
  EXPECT_EQ(value_of(a, "p(tilt_0.2 > 0.1)"), above);

  // and the problem comes back from its definition
  const Problem again = read_plan_problem(make_model_definition(p));
  EXPECT_EQ(calc_model_hash(again), calc_model_hash(p));
  EXPECT_NE(calc_model_hash(
                make_plan_problem(read_small(product::replaced(random_strengths, "runs = 4", "runs = 5")), quick())),
            calc_model_hash(p));
}

TEST(RandomPlan, PointsAtEveryMistake) {
  const int first = read_small(random_strengths).fuzzy.random[0].place.line - 6;  // of [fuzzy]
  for (const Wrong& w : {
           Wrong{"[\"fc_mean\", \"2 N/mm2\"]", "[\"fc_men\", \"2 N/mm2\"]", 6, 34, "E207", "no parameter \"fc_men\""},
           {"[\"fc_mean\", \"2 N/mm2\"]", "[\"25 N/mm2\", \"2 N/mm2\"]", 4, 1, "E207",
            "no random value has the parameter"},
           {"[\"fc_mean\", \"2 N/mm2\"]", "[\"fc_mean\", \"-2 N/mm2\"]", 6, 45, "E207", "below 0"},
           {"[\"fc_mean\", \"2 N/mm2\"]", "[\"fc_mean\", \"2 m\"]", 6, 45, "E204", "a stress is wanted"},
           {"concrete.C25.fc = { lognormal", "concrete.C25.fcc = { lognormal", 6, 14, "E203", "is no value"},
           {"concrete.C25.fc = { lognormal = [\"fc_mean\", \"2 N/mm2\"]",
            "concrete.C25.fc = { normal = [\"fc_mean\", \"30 N/mm2\"]", 6, 14, "E205",
            "among 4 runs, which is not possible"},
           {"concrete.C25.fct = { formula = \"1.4 * ((fc - 8) / 10)^(2/3)\" }",
            "concrete.C25.fc = { triangular = [\"20 N/mm2\", \"25 N/mm2\", \"30 N/mm2\"] }", 6, 14, "E207",
            "given a second time"},
           {"mean(tilt_0.2)", "mean(tilt_0.3)", 9, 21, "E825", "no output \"tilt_0.3\""},
           {"p(stands)", "p(standing)", 9, 36, "E825", "no outcome \"standing\""},
           {"p(tilt_0.2 > 0.1)", "p(tilt_0.2 > 0.1 m)", 9, 60, "E825", "shown in deg"},
           {"[fuzzy.randomness]", "[fuzzy.interaction]\nconstraints = [\"fct <= 5\"]\n[fuzzy.randomness]", 8, 16,
            "E207", "fct is random"},
       }) {
    const std::string text = product::replaced(random_strengths, w.from, w.to);
    try {
      (void)make_plan_problem(read_small(text), quick());
      ADD_FAILURE() << w.to << " was taken";
    } catch (const InputError& e) {
      const Diagnostic d = find(e, w.words);
      EXPECT_EQ(d.code, w.code) << w.to << ": " << d.message;
      EXPECT_EQ(d.where.line, w.line + first) << w.to << ": " << d.message;
      EXPECT_EQ(d.where.column, w.column) << w.to << ": " << d.message;
      EXPECT_NE((d.message + d.help).find(w.words), std::string::npos) << w.to << ": " << d.message << " " << d.help;
    }
  }
}

TEST(RandomPlan, IsCondensedAsOthersAre) {
  PlanMappingOptions o = quick();
  o.condensed = true;
  std::vector<Diagnostic> warnings;
  const Problem p = make_plan_problem(
      product::read_plan(collapse::house(collapse::charge("C-A*-0") + collapse::charge("C-B*-0", "0.2 s") +
                                         "[fuzzy.parameters]\nm = { triangular = [\"24 N/mm2\", \"25 N/mm2\", \"28 "
                                         "N/mm2\"] }\n[fuzzy.random]\nconcrete.C25.fc = { lognormal = [\"m\", \"2 "
                                         "N/mm2\"] }\n[fuzzy.randomness]\nruns = 4\nstatistics = [\"p(topple)\"]\n"),
                         "plan.toml", warnings),
      o);
  ASSERT_TRUE(p.whole);
  EXPECT_EQ(p.kind, random_kind);
  EXPECT_EQ(p.whole->kind, random_kind);
  EXPECT_NE(calc_model_hash(p), calc_model_hash(*p.whole));
  EXPECT_NE(p.whole->identity.find("\"random\""), std::string::npos);
  EXPECT_EQ(p.whole->identity.find("\"condensed\""), std::string::npos);
  EXPECT_EQ(calc_model_hash(read_plan_problem(make_model_definition(p))), calc_model_hash(p));
  EXPECT_NE(tell_random_cost(p).find("whole runs beside them 240 more"), std::string::npos) << tell_random_cost(p);
}

}  // namespace
}  // namespace topple::study
