#include "study/requirement.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "server.h"
#include "small_study.h"
#include "study/results.h"
#include "study/story.h"

namespace topple::study {
namespace {

using json = nlohmann::json;
using uncertainty::make_triangular;

Problem make_asked(int inputs, const std::string& permissible, int limit) {
  Problem p = make_problem(std::vector(static_cast<std::size_t>(inputs), make_triangular(-1, 0, 1)), limit);
  p.permissible = permissible;
  return p;
}

std::map<std::string, RequirementClass> list(const Problem& p, const StudyResult& r) {
  std::map<std::string, RequirementClass> by_name;
  for (const RequirementClass& c : list_requirement(p, r)) by_name[c.name] = c;
  return by_name;
}

Sentence tell_it(const Problem& p, const StudyResult& r) {
  for (const Sentence& s : tell(p, r))
    if (s.id == "requirement") return s;
  return {};
}

struct Case {
  const char* name;
  int inputs;
  const char* permissible;
  double broken, kept, within;
  std::function<Answer(const Point&)> model;
};

std::vector<Case> make_cases() {
  const auto sum = [](const Point& x, const std::vector<double>& a) {
    double s = 0;
    for (std::size_t i = 0; i < a.size(); ++i) s += a[i] * x[i];
    return s;
  };
  // cuts are cubes |x_i| <= t of the possibility 1 - t
  return {// a·x > c from t = c / sum |a_i| on
          {"half space", 3, "z <= 1.2798", 0.289, 1, 1e-4,
           [sum](const Point& x) {
             return done({{"z", sum(x, {1, -0.5, 0.3})}});
           }},
          // its nearest point in this norm lies on its axis, at 0.7 - 0.3
          {"ellipsoid", 3, "d >= 1", 0.6, 1, 1e-3,
           [](const Point& x) {
             return done({{"d", std::hypot((x[0] - .7) / .3, (x[1] + .1) / .2, x[2] / .25)}});
           }},
          // the nearer one of two half spaces, at 0.4 and 0.45
          {"one of two", 3, "a <= 1.2, b <= 0.9", 0.6, 1, 1e-4,
           [sum](const Point& x) {
             return done({{"a", sum(x, {1, 1, 1})}, {"b", sum(x, {1, -1, 0})}});
           }},
          // t + (t - 0.2) >= 0.8
          {"corner", 2, "a >= 0.8, b >= 0.2", 1, 0.5, 1e-4,
           [sum](const Point& x) {
             return done({{"a", sum(x, {1, 1})}, {"b", sum(x, {1, -1})}});
           }},
          // another outcome from 0.3 on, the limit from 0.25 on
          {"outcome and limit", 2, "stands, z <= 0.5", 0.75, 1, 1e-4, [sum](const Point& x) {
             return done({{"z", sum(x, {1, 1})}}, x[0] - x[1] > 0.6 ? "falls" : "stands");
           }}};
}

TEST(RequirementPhysics, PossibilitiesHaveClosedForms) {
  const Folder folder;
  std::uint64_t seed = 0;
  for (const Case& c : make_cases()) {
    Problem p = make_asked(c.inputs, c.permissible, 10000);
    p.seed = ++seed;
    const StudyResult r = run_model(p, folder / c.name, c.model);
    std::map<std::string, RequirementClass> by_name = list(p, r);
    EXPECT_NEAR(by_name["broken"].found.possibility, c.broken, c.within) << c.name;
    EXPECT_NEAR(by_name["kept"].found.possibility, c.kept, c.within) << c.name;
    EXPECT_LE(by_name["broken"].found.possibility, c.broken + 1e-12) << c.name << ": a run has it";
    EXPECT_LE(by_name["kept"].found.possibility, c.kept + 1e-12) << c.name;
    EXPECT_TRUE(by_name["broken"].found.converged && by_name["kept"].found.converged) << c.name;
    EXPECT_DOUBLE_EQ(by_name["kept"].necessity, 1 - by_name["broken"].found.possibility);
    EXPECT_TRUE(by_name["kept"].is_necessity_converged);
    for (const char* which : {"kept", "broken"}) {
      const uncertainty::Possibility& found = by_name[which].found;
      EXPECT_EQ(uncertainty::calc_membership(p.space, r.alpha.archive[found.sample].x), found.possibility);
    }
    const Sentence told = tell_it(p, r);
    EXPECT_NE(told.text.find("A search ended there, and found nothing more possible."), std::string::npos) << told.text;
    EXPECT_LE(r.alpha.archive.size(), 10000u);
  }
}

TEST(Requirement, OfOutcomesAloneIsToldByTheirPossibilities) {
  const Folder folder;
  Problem p = make_small_problem(2000);
  p.permissible = "stands";
  const StudyResult r = run_model(p, folder / "s", calc_small);
  std::map<std::string, RequirementClass> by_name = list(p, r);
  ASSERT_EQ(by_name.size(), 3u);
  for (const uncertainty::Possibility& c : r.possibilities.classes) {
    const std::string name = name_of_outcome(r, c.outcome);
    const uncertainty::Possibility& found = by_name[name == "stands"  ? "kept"
                                                    : name == "falls" ? "broken"
                                                                      : "failed"]
                                                .found;
    EXPECT_EQ(found.possibility, c.possibility) << name;
    EXPECT_EQ(found.sample, c.sample) << name;
    EXPECT_EQ(found.converged, c.converged) << name;
    EXPECT_EQ(found.resolution, c.resolution) << name;
  }
}

TEST(Requirement, IsNotProvenWhereNoRunBreaksIt) {
  const Folder folder;
  const Problem p = make_asked(2, "z <= 7", 600);
  const StudyResult r = run_model(p, folder / "s", [](const Point& x) { return done({{"z", x[0]}}); });
  std::map<std::string, RequirementClass> by_name = list(p, r);
  EXPECT_EQ(by_name["broken"].runs, 0);
  EXPECT_EQ(by_name["broken"].found.possibility, 0);
  EXPECT_FALSE(by_name["broken"].found.converged);
  EXPECT_FALSE(by_name["kept"].is_necessity_converged);
  EXPECT_EQ(by_name.count("failed"), 0u);
  EXPECT_EQ(tell_it(p, r).text, fmt::format("The core values keep the requirement z <= 7. None of {} runs broke it.",
                                            r.alpha.archive.size()));
  const json told = json::parse(write_results_json(p, r))["requirement"];
  EXPECT_EQ(told["classes"][1]["possibility"], 0);
  EXPECT_EQ(told["classes"][1]["converged"], false);
  EXPECT_NE(write_requirement_csv(p, r).find("\nz <= 7,broken,0,0,0,0,"), std::string::npos)
      << write_requirement_csv(p, r);
}

TEST(Requirement, SaysWhatWouldKeepItWhereTheCoreBreaksIt) {
  const Folder folder;
  Problem p = make_asked(2, "z >= 0.5", 2000);
  const auto model = [](const Point& x) { return done({{"z", x[0]}}); };
  const Sentence told = tell_it(p, run_model(p, folder / "a", model));
  EXPECT_EQ(told.status, record::Status::Bad);
  EXPECT_NE(told.text.find("break the requirement z >= 0.5. Keeping it is well possible: possibility at least 0.5"),
            std::string::npos)
      << told.text;
  p.permissible = "z > 3";
  const StudyResult never = run_model(p, folder / "b", model);
  EXPECT_EQ(tell_it(p, never).text, fmt::format("The core values break the requirement z > 3. None of {} runs kept it.",
                                                never.alpha.archive.size()));
}

// x1 > 0.5 fails, x1 < -0.8 breaks the requirement: the failures are the more possible ones.
TEST(Requirement, IsNotKeptByFailedRuns) {
  const Folder folder;
  const Problem p = make_asked(2, "z >= -0.8", 3000);
  const StudyResult r = run_model(p, folder / "s", [](const Point& x) {
    return x[0] > 0.5 ? Answer{Answer::Kind::Failed, {}, "", {}, "broke down", 0} : done({{"z", x[0]}});
  });
  std::map<std::string, RequirementClass> by_name = list(p, r);
  EXPECT_NEAR(by_name["failed"].found.possibility, 0.5, 1e-4);
  EXPECT_NEAR(by_name["broken"].found.possibility, 0.2, 1e-4);
  EXPECT_NEAR(by_name["kept"].necessity, 0.5, 1e-4);
  const Sentence told = tell_it(p, r);
  EXPECT_NE(told.text.find("so the necessity of keeping it is at most 0.5"), std::string::npos) << told.text;
  EXPECT_NE(told.text.find(" The run with this possibility failed. It takes no more than x1 0.5"), std::string::npos)
      << told.text;
}

// "arch" takes a ring that no run meets before the search of boxes.
TEST(Requirement, KnowsOutcomesThatRunsMeetLater) {
  Problem p = make_asked(1, "arch, z <= 1", 100);
  const std::vector<std::string> outputs = {"z"};
  std::vector<std::string> outcomes = {"falls"};
  const uncertainty::Classify classify = make_requirement_classes(p, outputs, outcomes);
  uncertainty::Result result;
  result.state = uncertainty::Result::State::Done;
  result.values = {0};
  EXPECT_EQ(classify(result), broken_class);
  result.outcome = 1;
  outcomes.emplace_back("arch");
  EXPECT_EQ(classify(result), kept_class);
  result.state = uncertainty::Result::State::Failed;
  EXPECT_EQ(classify(result), uncertainty::failed_outcome);
  const std::vector<std::string> others = {"y"};
  EXPECT_FALSE(make_requirement_classes(p, others, outcomes)) << "no run has the output";
}

TEST(RequirementReplay, IsTheSameForAnyThreadsAfterInterruptionsAndInTheStore) {
  const Folder folder;
  Problem p = make_small_problem(1500);
  p.permissible = "stands, root <= 5";
  expect_replays(p, folder / "");
}

}  // namespace
}  // namespace topple::study
