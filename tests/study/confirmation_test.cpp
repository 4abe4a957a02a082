#include "study/confirmation.h"

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "server.h"
#include "small_study.h"
#include "study/results.h"
#include "study/story.h"

namespace topple::study {
namespace {

using State = Confirmation::State;
using record::Status;
using json = nlohmann::json;

/// The small study as a condensed model; the whole one gives 10 more for z where R > 20 and falls up to R = 8.5.
Problem make_problem(int confirm) {
  Problem p = make_small_problem(600);
  Problem whole = p;
  whole.identity = R"({"whole":true})";
  p.whole = std::make_shared<const Problem>(std::move(whole));
  p.confirm = confirm;
  return p;
}

Answer calc(const Point& x, bool is_whole) {
  Answer a = calc_small(x);
  const double R = x[0] * x[1] / 100;
  if (!is_whole || a.kind != Answer::Kind::Done) return a;
  if (R > 20) a.outputs[0].second += 10;
  if (R < 8.5) a.outcome = "falls";
  return a;
}

RunnerFactories make_factories(double seconds = 0) {
  return {{"small", [seconds](const std::string& definition) -> Runner {
             const bool is_whole = json::parse(definition).at("identity").contains("whole");
             return [is_whole, seconds](auto points, const auto& give, const auto& cancel) {
               for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                 if (is_whole && seconds > 0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
                 give(i, calc(points[i], is_whole));
               }
             };
           }}};
}

StudyOptions make_options(const std::string& store) {
  StudyOptions o;
  o.store = store;
  o.pool.jobs = 2;
  return o;
}

TEST(Confirmation, MarksEachBoundByWholeRuns) {
  const Folder folder;
  const Problem p = make_problem(1000);
  const StudyResult r = run_study(p, make_factories(), make_options(folder / "a"), {}, {});
  ASSERT_TRUE(r.is_finished);
  const Confirmation& c = r.confirmation;
  ASSERT_EQ(c.bounds.size(), 2 * 2 * r.alpha.outputs[0].levels.size());
  for (const Confirmation::Bound& b : c.bounds) {
    const auto& level = r.alpha.outputs[static_cast<std::size_t>(b.output)].levels[static_cast<std::size_t>(b.level)];
    // R of the largest z in the cut
    const bool is_high = level.upper.value + 8 > 20;
    EXPECT_EQ(b.state, b.output == 0 && b.is_upper && is_high ? State::Exceeded : State::Confirmed)
        << b.output << " " << level.alpha << " " << b.is_upper;
    if (b.state == State::Exceeded) { EXPECT_NEAR(b.whole - level.upper.value, 10, 1e-9); }
  }
  EXPECT_EQ(r.alpha.archive[c.runs.front().sample].x, (Point{25, 64})) << "the middle of the inputs comes first";
  for (const auto& o : c.outcomes) EXPECT_EQ(o.state, State::Confirmed) << "the most possible runs are far from R = 8";
  EXPECT_LT(c.runs.size(), 60u) << "each sample once";
  for (const auto& run : c.runs) EXPECT_EQ(run.whole.state, uncertainty::Result::State::Done);
}

TEST(Confirmation, TheVerdictSaysWhatTheWholeRunOfTheCoreWas) {
  const Folder folder;
  Problem p = make_problem(20);
  p.asked = "holds";
  const RunnerFactories others = {{"small", [](const std::string& definition) -> Runner {
                                     const bool is_whole = json::parse(definition).at("identity").contains("whole");
                                     return [is_whole](auto points, const auto& give, const auto& cancel) {
                                       for (std::size_t i = 0; i < points.size() && !cancel; ++i) {
                                         Answer a = calc_small(points[i]);
                                         if (a.kind == Answer::Kind::Done) a.outcome = is_whole ? "sinks" : "holds";
                                         give(i, a);
                                       }
                                     };
                                   }}};
  const auto find = [](const std::vector<Sentence>& list, const std::string& id) {
    for (const Sentence& s : list)
      if (s.id == id) return s;
    return Sentence{};
  };
  const std::vector<Sentence> told = tell(p, run_study(p, others, make_options(folder / "a"), {}, {}));
  EXPECT_NE(find(told, "verdict").text.find("the whole run with these values has the outcome \"sinks\""),
            std::string::npos)
      << find(told, "verdict").text;
  EXPECT_EQ(find(told, "verdict").status, Status::Bad);
  EXPECT_EQ(find(told, "confirmation").status, Status::Bad);
  const std::vector<Sentence> same = tell(p, run_study(p, make_factories(), make_options(folder / "b"), {}, {}));
  EXPECT_EQ(find(same, "verdict").text.find("whole run"), std::string::npos);
}

TEST(Confirmation, SaysWhatItsLimitLeftOut) {
  const Folder folder;
  const StudyResult r = run_study(make_problem(11), make_factories(), make_options(folder / "a"), {}, {});
  EXPECT_EQ(r.confirmation.runs.size(), 11u);
  const auto& bounds = r.confirmation.bounds;
  EXPECT_TRUE(std::any_of(bounds.begin(), bounds.end(), [](const auto& b) { return b.state == State::NotRun; }));
  const json j = json::parse(write_results_json(make_problem(11), r));
  EXPECT_EQ(j["confirmation"]["runs"].size(), 11u);
  EXPECT_EQ(j["confirmation"]["bounds"].size(), bounds.size());
  EXPECT_NE(write_confirmation_csv(make_problem(11), r).find(",not run\n"), std::string::npos);
  const Problem alone = make_small_problem(100);
  const StudyResult without = run_study(alone, make_small_factories(), make_options(folder / "b"), {}, {});
  EXPECT_TRUE(write_confirmation_csv(alone, without).empty()) << "a study without a whole model has none";
}

TEST(ConfirmationReplay, IsTheSameAfterInterruptionsAndWhenItIsRead) {
  const Folder folder;
  const Problem p = make_problem(30);
  const StudyResult r = run_study(p, make_factories(), make_options(folder / "a"), {}, {});
  const std::string bits = write_results_json(p, r) + write_confirmation_csv(p, r);
  const StudyOptions o = make_options(folder / "b");
  int interrupted = 0;
  for (const int after : {0, 5, 1 << 30}) {
    std::atomic<bool> cancel = false;
    Progress progress;
    progress.cancel = &cancel;
    long before = -1;
    const StudyResult part = run_study(p, make_factories(2e-2), o, progress, [&](const StudyState& s) {
      if (!s.is_confirming) return;
      if (before < 0) before = s.run_here;
      if (s.run_here - before >= after) cancel = true;
    });
    interrupted += !part.is_finished;
    if (part.is_finished) { EXPECT_EQ(write_results_json(p, part) + write_confirmation_csv(p, part), bits); }
  }
  EXPECT_GE(interrupted, 1) << "while whole runs were under way";
  Store store(folder / "b");
  const StudyResult again = read_study(p, store, store.find_study("main").value());
  EXPECT_EQ(write_results_json(p, again) + write_confirmation_csv(p, again), bits);
}

}  // namespace
}  // namespace topple::study
