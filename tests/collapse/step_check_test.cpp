#include "collapse/step_check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "plans.h"

namespace topple::collapse {
namespace {

using record::Record;
using record::Status;
using testing::HasSubstr;

const record::Finding* check_of(const Record& r) {
  for (const record::Finding& f : r.findings)
    if (f.id == "verification.half_step") return &f;
  return nullptr;
}

TEST(StepCheckPhysics, AHouseThatTopplesDoesSoWithHalfTheStep) {
  // with stubs of 1 m, crushed within a step or two, numbers hang on the step (AStubIsCrushedByWhatComesDownOnIt)
  product::Plan plan = read(house(charge("C-A*-0", "0.1 s"), "2 s"));
  for (product::Charge& c : plan.stages.front().charges) c.position = 1.3, c.destroyed_length = 1.6;
  RunOptions options;
  const Record plain = run_plan(plan, default_knowledge(), options, {});
  ASSERT_EQ(check_of(plain), nullptr);
  std::string text;
  for (const int threads : {1, 2}) {
    options.threads = threads;
    double last = 0;
    RunCallbacks callbacks;
    callbacks.progress.report = [&](double done, double whole) {
      EXPECT_LE(done, whole + plain.provenance.step);  // the last step passes the end
      last = done / whole;
    };
    const Record r = run_plan_at_two_steps(plan, default_knowledge(), options, callbacks);
    EXPECT_EQ(r.position, plain.position);
    EXPECT_EQ(r.provenance.step, plain.provenance.step);
    const record::Finding* check = check_of(r);
    ASSERT_NE(check, nullptr);
    EXPECT_EQ(&r.findings.back(), check);
    EXPECT_EQ(check->status, Status::Good) << check->text;
    EXPECT_THAT(check->text, HasSubstr("the same verdict. "));
    EXPECT_THAT(check->text, HasSubstr(fmt::format("With {:.3g} ms", 500 * plain.provenance.step)));
    EXPECT_LT(check->value, 0.03);
    EXPECT_GT(last, 0.9);
    if (threads == 1) {
      text = check->text;
    } else {
      EXPECT_EQ(check->text, text);
    }
  }
}

TEST(StepCheck, ACancelledRunIsNotCompared) {
  const product::Plan plan = read(house(charge("C-A*-0", "0.1 s"), "10 s"));
  for (const int threads : {1, 2}) {
    std::atomic<bool> cancel = false;
    RunCallbacks callbacks;
    callbacks.progress.cancel = &cancel;
    callbacks.progress.report = [&](double done, double) { cancel = done > 0.02; };
    RunOptions options;
    options.threads = threads;
    const Record r = run_plan_at_two_steps(plan, default_knowledge(), options, callbacks);
    EXPECT_EQ(r.ending, "cancelled");
    EXPECT_EQ(check_of(r), nullptr);
  }
}

/// A record of nothing but findings.
Record make_record(const std::string& mechanism, double tilt, double touchdown, Status criterion) {
  Record r;
  r.ending = "at_rest";
  r.provenance.step = 1e-4;
  r.findings = {{"mechanism", "Mechanism", "Mechanism: " + mechanism, "", tilt, "rad", Status::Info},
                {"touchdown.first", "Touchdown", "First touchdown", "", touchdown, "s", Status::Info},
                {"debris.reach", "Fall and debris", "Reach of the debris", "", 12, "m", Status::Info},
                {"criterion.direction", "Criteria", "Direction", "", 0, "", criterion},
                {"verification.energy", "Verification", "Energy balance", "", 1e-3, "1", Status::Good}};
  return r;
}

record::Finding compare(const Record& half) {
  Record r = make_record("topple", 0.4, 2, Status::Good);
  add_step_check(half, default_knowledge(), r);
  return *check_of(r);
}

TEST(StepCheck, JudgesByVerdictThenByNumbers) {
  EXPECT_EQ(compare(make_record("topple", 0.385, 2.05, Status::Good)).status, Status::Good);
  const record::Finding tilted = compare(make_record("topple", 0.37, 2, Status::Good));
  EXPECT_EQ(tilted.status, Status::Warning);
  EXPECT_NEAR(tilted.value, 0.075, 1e-12);
  EXPECT_EQ(
      tilted.text,
      "With 0.1 ms the same verdict, but numbers that hang on the step. First touchdown 2.00 s, here 2.00 s. Tilt "
      "21.2 deg, here 22.9 deg. Reach of the debris 12.0 m, here 12.0 m. Error of the energy balance 0.1 %, here "
      "0.1 %.");
  EXPECT_EQ(compare(make_record("topple", 0.4, 2.11, Status::Good)).status, Status::Warning);
  const record::Finding flying = compare(make_record("topple", 0.4, NAN, Status::Good));
  EXPECT_EQ(flying.status, Status::Warning);
  EXPECT_THAT(flying.text, testing::Not(HasSubstr("touchdown")));
  const record::Finding folded = compare(make_record("fold", 0.4, 2, Status::Bad));
  EXPECT_EQ(folded.status, Status::Bad);
  EXPECT_THAT(folded.text, HasSubstr("With 0.1 ms other judgements: Mechanism: fold, Direction. First"));
}

TEST(StepCheck, SaysWhyThereIsNothingToCompareWith) {
  Record half = make_record("topple", 0.4, 2, Status::Good);
  half.ending = "failed";
  half.ending_text = "The numbers grew without bound at 1.2 s.";
  const record::Finding f = compare(half);
  EXPECT_EQ(f.status, Status::Warning);
  EXPECT_EQ(f.text, "With 0.1 ms there is no answer. The numbers grew without bound at 1.2 s.");
}

}  // namespace
}  // namespace topple::collapse
