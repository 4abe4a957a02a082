#include "base/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topple {
namespace {

using testing::HasSubstr;
using testing::Not;

Diagnostic sample() {
  return {Severity::Error, "E203", {"plan.toml", 2, 10}, 6, "unknown section \"C40x04\"", "did you mean \"C40x40\"?"};
}

TEST(Render, ShowsPlaceLineCaretAndHelp) {
  EXPECT_EQ(render(sample(), "[member]\nsection = C40x04\nx = 1\n", false),
            "plan.toml:2:10: error E203: unknown section \"C40x04\"\n"
            " 2 | section = C40x04\n"
            "   |          ^^^^^^\n"
            "   = help: did you mean \"C40x40\"?\n");
}

TEST(Render, LeavesTheLineOutWithoutText) {
  EXPECT_EQ(render(sample(), "", false),
            "plan.toml:2:10: error E203: unknown section \"C40x04\"\n"
            "    = help: did you mean \"C40x40\"?\n");
}

TEST(Render, NamesAWarning) {
  Diagnostic d = sample();
  d.severity = Severity::Warning;
  d.code = "W301";
  EXPECT_THAT(render(d, "", false), HasSubstr("warning W301: "));
}

TEST(Render, LeavesThePlaceOutWhenThereIsNone) {
  EXPECT_EQ(render({Severity::Error, "E1", {}, 1, "no such thing", ""}, "text", false), "error E1: no such thing\n");
}

TEST(Render, ColoursOnlyWhenAsked) {
  EXPECT_THAT(render(sample(), "a\nsection = C40x04", false), Not(HasSubstr("\x1b")));
  EXPECT_THAT(render(sample(), "a\nsection = C40x04", true), HasSubstr("\x1b[1;31m"));
}

TEST(Render, CountsCharactersNotBytes) {
  Diagnostic d = sample();
  d.where = {"p", 1, 6};
  d.width = 1;
  d.help = "";
  EXPECT_THAT(render(d, "größe = 1", false), HasSubstr("\n   |      ^\n"));
}

TEST(Render, ReplacesControlCharacters) {
  Diagnostic d = sample();
  d.where = {"p", 1, 3};
  EXPECT_THAT(render(d, "a\x1b[2Jb\tc\r\n", false), HasSubstr(" 1 | a [2Jb c\n"));
}

TEST(Render, ShowsAWindowOfAHugeLine) {
  Diagnostic d = sample();
  d.where = {"p", 1, 50001};
  d.width = 3;
  const std::string out = render(d, std::string(50000, 'a') + "BAD" + std::string(50000, 'c'), false);
  EXPECT_LT(out.size(), 600u);
  // the caret stands below the B
  const auto line = out.find("BAD"), begin = out.rfind('\n', line) + 1;
  const auto caret = out.find("^^^"), caret_begin = out.rfind('\n', caret) + 1;
  ASSERT_NE(line, std::string::npos);
  ASSERT_NE(caret, std::string::npos);
  EXPECT_EQ(line - begin, caret - caret_begin);
}

TEST(Render, SurvivesPlacesOutsideTheText) {
  for (const SourcePosition& where :
       {SourcePosition{"p", 99, 1}, {"p", 1, 999}, {"p", 1, 0}, {"p", 1, -5}, {"p", 3, 1}}) {
    Diagnostic d = sample();
    d.where = where;
    d.width = 1000000;
    EXPECT_LT(render(d, "a\nb\n", false).size(), 1500u);
  }
}

TEST(InputErrorTest, CarriesEveryComplaint) {
  Diagnostic second = sample();
  second.code = "E204";
  const InputError error({sample(), second});
  EXPECT_EQ(error.diagnostics().size(), 2u);
  EXPECT_THAT(error.what(), HasSubstr("E203"));
  EXPECT_THAT(error.what(), HasSubstr("E204"));
}

TEST(InputErrorTest, OffersItsFirstErrorAndNoWarning) {
  Diagnostic warning = sample(), second = sample();
  warning.severity = Severity::Warning, warning.code = "W510";
  second.code = "E204";
  EXPECT_EQ(InputError({warning, second, sample()}).first_error().code, "E204");
}

TEST(InputErrorTest, MayHaveNoPlace) {
  const InputError error("E701", "cannot read x", "check it");
  ASSERT_EQ(error.diagnostics().size(), 1u);
  EXPECT_EQ(error.diagnostics()[0].code, "E701");
  EXPECT_EQ(error.diagnostics()[0].help, "check it");
  EXPECT_EQ(error.diagnostics()[0].where.line, 0);
}

TEST(NearestName, FindsTypingErrors) {
  const std::vector<std::string> known = {"storey", "section", "residual_bars", "delay", "duration"};
  EXPECT_EQ(nearest_name("storye", known), "storey") << "two letters swapped";
  EXPECT_EQ(nearest_name("sectoin", known), "section");
  EXPECT_EQ(nearest_name("residual_bar", known), "residual_bars") << "one missing";
  EXPECT_EQ(nearest_name("delaay", known), "delay") << "one too many";
  EXPECT_EQ(nearest_name("duratjon", known), "duration") << "one wrong";
}

TEST(NearestName, GivesNothingWhenNothingIsNear) {
  EXPECT_EQ(nearest_name("colour", {"storey", "section"}), "");
  EXPECT_EQ(nearest_name("x", {"section"}), "");
  EXPECT_EQ(nearest_name("abc", {}), "");
}

TEST(NearestName, TakesTheNearestThenTheFirst) {
  EXPECT_EQ(nearest_name("C-A1-0", {"C-B2-0", "C-A2-0", "C-A1-1"}), "C-A2-0");
  EXPECT_EQ(nearest_name("column", {"colunm_", "columns"}), "columns");
  EXPECT_EQ(nearest_name("V_WB", {"X_WB", "v_WB", "w_WB"}), "v_WB") << "a capital for a small letter";
  EXPECT_EQ(nearest_name("FC", {"fct", "fc"}), "fc");
}

TEST(NearestName, IsQuickOnHugeWords) { EXPECT_EQ(nearest_name(std::string(1000000, 'a'), {"section", "storey"}), ""); }

}  // namespace
}  // namespace topple
