#include "study/limits.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "server.h"
#include "small_study.h"
#include "study/insights.h"
#include "study/results.h"
#include "study/story.h"

namespace topple::study {
namespace {

using json = nlohmann::json;
using uncertainty::make_triangular;
using Kind = Limit::Kind;

Limit make_limit(const std::string& output, double value, Kind kind) {
  Limit l;
  l.output = output, l.place = kind == Kind::Reach ? "" : "House", l.source = "of the plan", l.kind = kind;
  l.least = l.most = value;
  return l;
}

/// Cuts are cubes |x_i| <= t of the possibility 1 - t.
Problem make_limited(int inputs, std::vector<Limit> limits, int runs) {
  Problem p = make_problem(std::vector(static_cast<std::size_t>(inputs), make_triangular(-1, 0, 1)), runs);
  p.limits = std::move(limits);
  for (const Limit& l : p.limits) p.outputs.push_back({l.output, "m", 1, false});
  return p;
}

Answer calc_three(const Point& x) {
  return done({{"reach", x[0] - 0.5 * x[1] + 0.3 * x[2]},
               {"clearance", std::hypot((x[0] - .7) / .3, (x[1] + .1) / .2, x[2] / .25)},
               {"shaking", x[0] + x[1] + x[2]}},
              x[0] > 0.9 ? "vertical" : "topple");
}

std::vector<Limit> make_three() {
  return {make_limit("reach", 1.2798, Kind::Reach), make_limit("clearance", 1, Kind::Clearance),
          make_limit("shaking", 2.25, Kind::Screening)};
}

// A half space from t = c / sum |a_i| on, an ellipsoid whose nearest point in this norm lies on its axis at 0.7 - 0.3,
// and again a half space; nobody looks for bounds of these outputs.
TEST(LimitsPhysics, PossibilitiesHaveClosedForms) {
  const double want[] = {0.289, 0.6, 0.25}, within[] = {1e-4, 1e-3, 1e-4};
  const Folder folder;
  for (const int seed : {1, 2, 3}) {
    Problem p = make_limited(3, make_three(), 10000);
    p.seed = static_cast<std::uint64_t>(seed);
    const StudyResult r = run_model(p, folder / std::to_string(seed), calc_three);
    const std::vector<LimitFinding> all = list_limits(p, r);
    ASSERT_EQ(all.size(), 3u);
    for (int k = 0; k < 3; ++k) {
      const uncertainty::Possibility& found = all[k].found;
      EXPECT_NEAR(found.possibility, want[k], within[k]) << k << " seed " << seed;
      EXPECT_LE(found.possibility, want[k] + 1e-12) << "a run has it";
      EXPECT_TRUE(found.converged) << k << " seed " << seed;
      const uncertainty::Sample& s = r.alpha.archive[found.sample];
      EXPECT_EQ(uncertainty::calc_membership(p.space, s.x), found.possibility);
      EXPECT_TRUE(is_broken(p.limits[k], s.result.values[k]));
    }
    const json told = json::parse(write_results_json(p, r))["limits"];
    EXPECT_EQ(told[1]["kind"], "clearance");
    EXPECT_EQ(told[1]["possibility"], all[1].found.possibility);
    EXPECT_EQ(told[1]["converged"], true);
    EXPECT_EQ(told[1]["broken"], all[1].broken);
    EXPECT_NE(write_limits_csv(p, r).find(
                  fmt::format("\nshaking,screening,House,m,2.25,{},{},0,", r.alpha.archive.size(), all[2].broken)),
              std::string::npos)
        << write_limits_csv(p, r);
  }
}

// Of 700 runs each limit gets some; before, what the others happened to meet was all.
TEST(LimitsPhysics, ShortStudiesComeNearer) {
  const Folder folder;
  for (const bool has_boxes : {false, true}) {
    double searched = 0, met = 0;
    for (const int seed : {1, 2, 3, 4, 5}) {
      Problem p = make_limited(3, make_three(), 700);
      p.seed = static_cast<std::uint64_t>(seed);
      if (has_boxes) p.permissible = "topple";
      const auto add_error = [&p](double& sum, const StudyResult& r) {
        const std::vector<LimitFinding> all = list_limits(p, r);
        sum += 0.289 - all[0].found.possibility + 0.6 - all[1].found.possibility + 0.25 - all[2].found.possibility;
      };
      const std::string name = std::to_string(seed) + (has_boxes ? "b" : "");
      add_error(searched, run_model(p, folder / name, calc_three));
      Problem without = p;
      without.limits.clear();
      add_error(met, run_model(without, folder / ("w" + name), calc_three));
    }
    EXPECT_LT(searched, 0.5 * met) << has_boxes << " " << searched / 15 << " " << met / 15;
  }
}

TEST(Limits, AreNotSearchedForWhereTheCoreOrNoRunBreaksThem) {
  const Folder folder;
  const auto model = [](const Point& x) { return done({{"reach", 10 + x[0]}, {"other", x[1]}}); };
  const Problem p = make_limited(
      2,
      {make_limit("reach", 9.5, Kind::Reach), make_limit("reach", 12, Kind::Reach), make_limit("way", 1, Kind::Reach)},
      600);
  Problem without = p;
  without.limits.clear();
  const StudyResult r = run_model(p, folder / "a", model), plain = run_model(without, folder / "b", model);
  EXPECT_EQ(r.alpha.archive.size(), plain.alpha.archive.size());
  const std::vector<LimitFinding> all = list_limits(p, r);
  ASSERT_EQ(all.size(), 2u) << "no run has the third output";
  EXPECT_TRUE(all[0].is_core_broken && all[0].found.converged);
  EXPECT_EQ(all[0].found.possibility, 1);
  EXPECT_EQ(all[1].broken, 0);
  EXPECT_EQ(all[1].found.sample, -1);
  EXPECT_EQ(all[1].found.possibility, 0);
  EXPECT_FALSE(all[1].found.converged) << "that no run breaks it is no proof";
  const json told = json::parse(write_results_json(p, r))["limits"];
  EXPECT_EQ(told.size(), 2u);
  EXPECT_EQ(told[1]["sample"], -1);
}

TEST(Limits, TellWhetherTheirSearchHasEndedAndWhatItTakes) {
  const Folder folder;
  Problem p = make_limited(2, {make_limit("reach", 0.9, Kind::Reach)}, 4000);
  const auto model = [](const Point& x) { return done({{"reach", x[0] + 0.2 * x[1]}}, "topple"); };
  const auto find = [&](const StudyResult& r) {
    for (const Sentence& s : tell(p, r))
      if (s.id == "limit.reach") return s.text;
    return std::string();
  };
  StudyResult r = run_model(p, folder / "a", model);
  const char* ended =
      "It is hardly possible that the limit is broken: possibility at least 0.24. A search ended there, and "
      "found nothing more possible. It takes no more than x1 0.75";
  EXPECT_NE(find(r).find(ended), std::string::npos) << find(r);
  EXPECT_TRUE(std::ranges::any_of(list_notable_runs(p, r), [](const NotableRun& n) {
    return n.why == "most possible run that breaks the limit of reach (0.24)";
  }));
  r.limits.clear();
  EXPECT_NE(find(r).find("No search has ended there, so it may be higher."), std::string::npos) << find(r);
}

TEST(LimitsReplay, AreTheSameForAnyThreadsAfterInterruptionsAndInTheStore) {
  const Folder folder;
  Problem p = make_small_problem(1500);
  p.limits = {make_limit("root", 4.5, Kind::Reach), make_limit("z", -9, Kind::Clearance)};
  EXPECT_EQ(expect_replays(p, folder / "").limits.size(), 2u);
}

}  // namespace
}  // namespace topple::study
