#include "self_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace topple::apps {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::atomic<bool> kGoOn = false;

SelfCheckCase make_case(double got) {
  return {"Length", "a ruler", [got] { return std::vector<CheckedNumber>{{"of a metre", "m", 1, got, 1e-3}}; }};
}

TEST(SelfCheck, TellsNumbersWithinTheirToleranceFromOthers) {
  for (const auto& [got, ok] : {std::pair{1.0, true},
                                {1.0009, true},
                                {0.9991, true},
                                {1.0011, false},
                                {0.9, false},
                                {double{NAN}, false},
                                {double{INFINITY}, false}}) {
    const auto checks = run_self_checks({make_case(got)}, kGoOn);
    ASSERT_EQ(checks.size(), 1u);
    EXPECT_EQ(checks[0].is_ok(), ok) << got;
    EXPECT_EQ(all_ok(checks), ok);
    EXPECT_THAT(to_text(checks), HasSubstr(ok ? "  ok      Length" : "  FAILED  Length"));
  }
}

TEST(SelfCheck, OneFailureOfManyFailsAll) {
  const SelfCheckCase broken{"Broken", "nothing",
                             []() -> std::vector<CheckedNumber> { throw std::runtime_error("no such file"); }};
  const SelfCheckCase empty{"Empty", "nothing", [] { return std::vector<CheckedNumber>{}; }};
  const auto checks = run_self_checks({make_case(1), broken, make_case(1), empty}, kGoOn);
  ASSERT_EQ(checks.size(), 4u);
  EXPECT_TRUE(checks[2].is_ok());  // the others are done all the same
  EXPECT_FALSE(all_ok(checks));
  EXPECT_EQ(checks[1].failure, "no such file");
  EXPECT_THAT(to_text(checks), HasSubstr("no such file"));
  EXPECT_FALSE(checks[3].is_ok());
}

TEST(SelfCheck, LeavesOutWhatWasNotDone) {
  std::atomic<bool> cancel = true;
  EXPECT_TRUE(run_self_checks({make_case(1)}, cancel).empty());
  cancel = false;
  const SelfCheckCase interrupted{"Interrupted", "a signal", [&] {
                                    cancel = true;
                                    return std::vector<CheckedNumber>{{"of a metre", "m", 1, 1, 1e-3}};
                                  }};
  const auto checks = run_self_checks({make_case(1), interrupted, make_case(1)}, cancel);
  ASSERT_EQ(checks.size(), 2u);
  EXPECT_TRUE(all_ok(checks));
}

TEST(SelfCheck, FilesThatCannotBeWrittenFail) {
  int failed = 0;
  for (const SelfCheckCase& c : make_self_checks("/dev/null/folder")) {
    if (c.name.find("written") == std::string::npos) continue;
    const auto checks = run_self_checks({c}, kGoOn);
    EXPECT_FALSE(checks.at(0).is_ok()) << c.name;
    EXPECT_THAT(checks.at(0).failure, Not(testing::IsEmpty()));
    ++failed;
  }
  EXPECT_EQ(failed, 2);
}

}  // namespace
}  // namespace topple::apps
