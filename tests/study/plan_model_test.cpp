#include "study/plan_model.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "small_fuzzy_plan.h"
#include "study/permissible.h"
#include "study/results.h"
#include "uncertainty/alpha.h"

namespace topple::study {
namespace {

std::vector<Answer> run(const Runner& runner, const std::vector<Point>& points) {
  std::vector<Answer> out(points.size());
  const std::atomic<bool> cancel = false;
  runner(
      points, [&](std::size_t i, Answer a) { out[i] = std::move(a); }, cancel);
  return out;
}

TEST(PlanModel, AnswersAsTheMappingDoes) {
  const product::Plan plan = read_small(strengths);
  const Problem problem = make_plan_problem(plan, quick());
  ASSERT_EQ(problem.inputs.size(), 3u);
  ASSERT_EQ(problem.derived.size(), 1u);
  EXPECT_EQ(problem.inputs[0].name, "concrete.C25.fc");
  EXPECT_EQ(problem.inputs[0].unit, "N/mm2");
  EXPECT_EQ(problem.inputs[0].unit_value, 1e6);
  EXPECT_EQ(problem.derived[0].name, "concrete.C25.fct");

  const PlanMapping mapping(plan, collapse::default_knowledge(), quick());
  std::vector<Point> points{{25e6, 1.2, 1e3}, {5e6, 1.2, 1e3}};
  std::vector<uncertainty::Result> wanted(2);
  mapping.evaluate(points, wanted);
  EXPECT_NEAR(problem.calc_derived(points[0])[0], 1.994e6, 1e3);  // Table 1, to its digits
  points[0].push_back(problem.calc_derived(points[0])[0]);
  points[1].push_back(0);
  const std::vector<Answer> found = run(make_plan_runner(make_model_definition(problem)), points);
  ASSERT_EQ(found[0].kind, Answer::Kind::Done);
  ASSERT_EQ(found[0].outputs.size(), wanted[0].values.size());
  for (std::size_t i = 0; i < wanted[0].values.size(); ++i) {
    EXPECT_EQ(found[0].outputs[i].first, mapping.outputs()[i].name);
    EXPECT_EQ(found[0].outputs[i].second, wanted[0].values[i]);
  }
  EXPECT_EQ(found[0].trajectory, wanted[0].trajectory);
  EXPECT_EQ(found[0].outcome, plan_outcomes()[static_cast<std::size_t>(wanted[0].outcome)]);
  EXPECT_GT(found[0].seconds, 0);
  EXPECT_EQ(found[1].kind, Answer::Kind::Failed);
  EXPECT_EQ(found[1].text, wanted[1].text);
}

TEST(PlanModel, IsAnotherModelForAnotherPlanOrAnotherQuestion) {
  const Problem a = make_plan_problem(read_small(strengths), quick());
  PlanMappingOptions longer = quick();
  longer.after = 0.5;
  EXPECT_NE(calc_model_hash(a), calc_model_hash(make_plan_problem(read_small(strengths), longer)));
  EXPECT_NE(calc_model_hash(a),
            calc_model_hash(make_plan_problem(read_small(std::string(strengths) + "# x\n"), quick())));
  PlanMappingOptions threads = quick();
  threads.threads = 7;
  EXPECT_EQ(calc_model_hash(a), calc_model_hash(make_plan_problem(read_small(strengths), threads)));
}

TEST(PlanModel, NamesClassesThatNoRunHasHad) {
  const Problem problem = make_plan_problem(read_small(strengths), quick());
  StudyResult r;
  r.outcomes = {"early", "topple", "vertical"};  // the last by whole runs of a condensed study alone
  for (const int outcome : {0, 1}) {
    uncertainty::ClassBounds c;
    c.outcome = outcome, c.count = 3;
    r.alpha.classes.push_back(c);
  }
  const std::vector<std::string> unmet = list_unmet_outcomes(problem, r);
  EXPECT_EQ(unmet.size(), plan_outcomes().size() - 2);
  EXPECT_THAT(unmet, testing::IsSupersetOf({"vertical", "partial", "aborted", "stands"}));
  EXPECT_TRUE(list_unmet_outcomes(Problem{}, r).empty()) << "a program says no classes beforehand";
}

TEST(PlanModel, ComesBackFromItsDefinition) {
  const Problem a = make_plan_problem(read_small(strengths), quick());
  const Problem b = read_plan_problem(make_model_definition(a));
  EXPECT_EQ(make_model_definition(a), make_model_definition(b));
  EXPECT_EQ(a.title, b.title);
  EXPECT_EQ(a.space.inputs[0].cuts(), b.space.inputs[0].cuts());
}

TEST(PlanModel, TakesTheAnalysisFromThePlan) {
  const Problem p = make_plan_problem(
      read_small(std::string(strengths) + "[fuzzy.search]\nlevels = [0, 0.5, 1]\nsamples = 500\nseed = 7\n"), quick());
  EXPECT_THAT(p.levels, testing::ElementsAre(0, 0.5, 1));
  EXPECT_EQ(p.limit, 500);
  EXPECT_EQ(p.seed, 7u);
}

constexpr const char* tied = R"toml([fuzzy]
concrete.C25.fc = { triangular = ["10 N/mm2", "25 N/mm2", "45 N/mm2"] }
stage.1.charge.1.destroyed_length = { triangular = ["1 m", "1.2 m", "1.4 m"] }
[fuzzy.interaction]
constraints = ["fc / 20 + destroyed_length / 1000 <= 3"]
)toml";

// y = fc / 20 + L is at most 3 where the cut passes the constraint, fc at most 40 (at the least L), and least where it
// was; at 0.75 the whole cut keeps it.
TEST(PlanModelPhysics, ConstraintCutsACornerOff) {
  const Problem p = make_plan_problem(read_small(tied), quick());
  ASSERT_EQ(p.space.constraints.size(), 1u);
  EXPECT_NE(calc_model_hash(p),
            calc_model_hash(make_plan_problem(read_small(product::replaced(tied, "<= 3", "<= 3.01")), quick())));
  int runs = 0;
  const uncertainty::Evaluate model = uncertainty::make_evaluate_values([&](const Point& x) {
    ++runs;
    const double y = x[0] / 20e6 + x[1];
    EXPECT_LE(y, 3 + 1e-10);
    return std::vector{y, x[0] / 1e6};
  });
  uncertainty::AlphaOptions options;
  options.levels = {0, 0.5, 0.75, 1};
  const uncertainty::AlphaResult r = uncertainty::optimise(p.space, model, options, {});
  EXPECT_GT(runs, 100);
  const auto& y = r.outputs[0].levels;
  const double lower[] = {1.5, 1.975, 2.2125, 2.45}, upper[] = {3, 3, 2.75, 2.45};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(y[i].lower.value, lower[i], 1e-6) << i;
    EXPECT_NEAR(y[i].upper.value, upper[i], 1e-6) << i;
  }
  EXPECT_NEAR(r.outputs[1].levels[0].upper.value, 40, 1e-4);
}

TEST(PlanModel, TakesTheJointMembershipOfThePlan) {
  const std::string joint = product::replaced(tied, "constraints = [\"fc / 20 + destroyed_length / 1000 <= 3\"]",
                                              "membership = \"max(0, 1 - abs(destroyed_length - 1200) / 100)\"");
  const Problem p = make_plan_problem(read_small(joint), quick());
  EXPECT_EQ(uncertainty::calc_membership(p.space, {25e6, 1.2}), 1);
  EXPECT_NEAR(uncertainty::calc_membership(p.space, {25e6, 1.25}), 0.5, 1e-12);
  EXPECT_EQ(uncertainty::calc_membership(p.space, {25e6, 1.35}), 0) << "0.25 without the joint membership";
}

product::Plan read_limited(const std::string& clearance) {
  std::string text = product::small_plan() + strengths;
  text = product::replaced(text, "time = \"2 s\"", "time = \"0.1 s\"");
  text = product::replaced(text, "clearance = \"3 m\"", "clearance = \"" + clearance + "\"");
  text = product::replaced(text, "azimuth_tolerance", "debris_reach = \"12 m\"\nazimuth_tolerance");
  std::vector<Diagnostic> warnings;
  return product::read_plan(text, "plan.toml", warnings);
}

TEST(PlanModel, OutlinesTheBuildingAsItIs) {
  // of 5 x 8 m, without the bay at B3: a slab of 5 x 4 m with beams of 0.3 m and columns of 0.4 x 0.5 m on its edges,
  // and the row's last bay as a strip of a beam
  product::Plan plan = read_small(strengths);
  const std::size_t whole = make_plan_problem(plan, quick()).site.outlines.size();
  EXPECT_EQ(whole, 1u);
  for (product::Member& m : plan.members)
    m.removed = m.removed || (m.row_b == 1 && m.frame_b == 2) || m.kind == product::MemberKind::Wall;
  const Site site = make_plan_problem(plan, quick()).site;
  ASSERT_EQ(site.outlines.size(), 1u);
  double area = 0;
  const auto& loop = site.outlines[0];
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const auto &a = loop[i], &b = loop[(i + 1) % loop.size()];
    area += 0.5 * (a[0] * b[1] - b[0] * a[1]);
  }
  // slab; beams on its four edges and along the strip; what columns cover beside both
  const double beams = 2 * 5 * 0.15 + 2 * 4 * 0.15 + 4 * 0.3;
  EXPECT_GT(area, 5 * 4 + beams - 0.3);
  EXPECT_LT(area, 5 * 4 + beams + 5 * 0.4 * 0.5);
  for (const auto& p : loop) EXPECT_TRUE(p[0] < 0.21 || p[1] < 4.26) << p[0] << ", " << p[1];
}

TEST(PlanModel, JudgesReachAndClearances) {
  const Problem p = make_plan_problem(read_limited("3 m"), quick());
  ASSERT_EQ(p.limits.size(), 3u);
  EXPECT_EQ(p.limits[0].output, "debris_reach");
  EXPECT_EQ(p.limits[0].least, 12);
  EXPECT_EQ(p.limits[0].kind, Limit::Kind::Reach);
  EXPECT_EQ(p.limits[1].output, "clearance_house");
  EXPECT_EQ(p.limits[1].least, 3);
  EXPECT_EQ(p.limits[1].kind, Limit::Kind::Clearance);
  EXPECT_EQ(p.limits[2].output, "azimuth_deviation");
  EXPECT_EQ(p.limits[2].kind, Limit::Kind::Direction);
  EXPECT_TRUE(p.limits[2].left.empty());
  EXPECT_THAT(p.not_judged, testing::IsEmpty());
  for (const Limit& limit : p.limits)
    for (const std::string& output : {limit.output, limit.left.empty() ? limit.output : limit.left})
      EXPECT_EQ(std::count_if(p.outputs.begin(), p.outputs.end(), [&](const Quantity& q) { return q.name == output; }),
                1)
          << output;
  // whether something lands there is not in the number
  const Problem zero = make_plan_problem(read_limited("0 m"), quick());
  EXPECT_EQ(zero.limits.size(), 2u);
  EXPECT_THAT(zero.not_judged, testing::ElementsAre("clearance: \"House\""));
  // runs that know nothing across the frames
  PlanMappingOptions in_plane = quick();
  in_plane.sideways = false;
  const Problem slice = make_plan_problem(read_limited("3 m"), in_plane);
  EXPECT_THAT(slice.limits, testing::IsEmpty());
  EXPECT_THAT(slice.not_judged, testing::ElementsAre("debris_reach", "clearance: \"House\"", "azimuth"));
}

TEST(PlanModel, TakesLimitsOfClearances) {
  const Problem p = make_plan_problem(read_limited("3 m"), quick());
  std::vector<std::string> names;
  for (const Quantity& q : p.outputs) names.push_back(q.name);
  const uncertainty::Requirement keeps =
      make_requirement(read_permissible("topple, clearance_house >= 3", p), names, p.outcomes);
  uncertainty::Result r;
  r.state = uncertainty::Result::State::Done;
  r.values.assign(names.size(), 0);
  double& clearance =
      r.values[static_cast<std::size_t>(std::find(names.begin(), names.end(), "clearance_house") - names.begin())];
  clearance = 3;
  EXPECT_GE(keeps(r), 0);
  clearance = 2.9;
  EXPECT_LT(keeps(r), 0);
}

TEST(PlanModel, ReadsDefinitionsOfEarlierVersions) {
  Problem p = make_plan_problem(read_limited("3 m"), quick());
  auto identity = nlohmann::json::parse(p.identity);
  ASSERT_EQ(identity.erase("class_open"), 1u);
  p.identity = identity.dump();
  const Problem before = read_plan_problem(make_model_definition(p));
  for (const Quantity& q : before.outputs) EXPECT_NE(q.name, "class_open");
  EXPECT_EQ(before.horizon->open, "way_left");
  ASSERT_EQ(identity.erase("findings"), 1u);
  p.identity = identity.dump();
  const Problem old = read_plan_problem(make_model_definition(p));
  for (const Quantity& q : old.outputs) EXPECT_NE(q.name, "heap_height");
  EXPECT_THAT(old.limits, testing::IsEmpty());
  EXPECT_THAT(old.not_judged, testing::SizeIs(3));
}

TEST(PlanModel, StopsAtACancellation) {
  const Runner runner = make_plan_runner(make_model_definition(make_plan_problem(read_small(strengths), quick())));
  const std::atomic<bool> cancel = true;
  int given = 0;
  const std::vector<Point> points{{25e6, 1.2, 1e3, 2e6}};
  runner(
      points, [&](std::size_t, const Answer&) { ++given; }, cancel);
  EXPECT_EQ(given, 0);
}

}  // namespace
}  // namespace topple::study
