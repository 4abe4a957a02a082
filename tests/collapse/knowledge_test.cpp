#include "collapse/knowledge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/file.h"

namespace topple::collapse {
namespace {

std::string shipped() { return read_file(TOPPLE_SOURCE_DIR "/data/knowledge.json"); }

std::string complaint_of(const std::string& text) {
  try {
    read_knowledge(text, "rules.json");
  } catch (const InputError& e) { return e.what(); }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Knowledge, BuiltInRulesAreThoseOfTheFile) {
  const Knowledge k = read_knowledge(shipped(), "data/knowledge.json");
  ASSERT_EQ(k.rules.size(), default_knowledge().rules.size());
  for (size_t i = 0; i < k.rules.size(); ++i) {
    EXPECT_EQ(k.rules[i].id, default_knowledge().rules[i].id);
    EXPECT_EQ(k.rules[i].value, default_knowledge().rules[i].value);
  }
  EXPECT_EQ(k.zone_rupture_rotation, 0.35);
}

TEST(Knowledge, EveryRuleHasAReasonInWords) {
  for (const Rule& r : default_knowledge().rules) {
    EXPECT_GE(r.reason.size(), 15u) << r.id;
    EXPECT_FALSE(r.unit.empty()) << r.id;
  }
}

TEST(Knowledge, RefusesWhatIsNotASet) {
  EXPECT_THAT(complaint_of(""), testing::HasSubstr("E611"));
  EXPECT_THAT(complaint_of("{\"rules\": [\n  {]}"),
              testing::AllOf(testing::HasSubstr("E611"), testing::HasSubstr(":2:4:")));
  EXPECT_THAT(complaint_of("[1, 2]"), testing::HasSubstr("not a JSON object"));
  EXPECT_THAT(complaint_of("{\"rules\": []}"), testing::HasSubstr("\"zone.length_by_depth\" is missing"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"zone.slip_rupture\"", "\"zone.slip_ruptur\"")),
              testing::AllOf(testing::HasSubstr("did you mean \"zone.slip_rupture\""),
                             testing::HasSubstr("\"zone.slip_rupture\" is missing")));
  EXPECT_THAT(
      complaint_of(replaced(shipped(), "\"value\": 0.35", "\"value\": -0.35")),
      testing::ContainsRegex(":[1-9][0-9]*:[1-9][0-9]*: error E661: rule \"zone.rupture_rotation\" needs a value > 0"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"zone.elongation_share\", \"value\": 1",
                                    "\"zone.elongation_share\", \"value\": -1")),
              testing::HasSubstr("\"zone.elongation_share\" needs a value >= 0"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"member.uncracked_share\", \"value\": 1",
                                    "\"member.uncracked_share\", \"value\": 1.5")),
              testing::HasSubstr("\"member.uncracked_share\" needs a value from 0 to 1"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"value\": 0.35", "\"value\": \"much\"")),
              testing::HasSubstr("needs a value > 0"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"zone.biaxial_exponent\", \"value\": 1.5",
                                    "\"zone.biaxial_exponent\", \"value\": 11")),
              testing::HasSubstr("\"zone.biaxial_exponent\" needs a value from 1 to 10"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"zone.damping_ratio\", \"value\": 0.05",
                                    "\"zone.damping_ratio\", \"value\": 0.3")),
              testing::HasSubstr("\"zone.damping_ratio\" needs a value > 0, at most 0.2"));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"contact.frequency\", \"value\": 250",
                                    "\"contact.frequency\", \"value\": 1e30")),
              testing::HasSubstr("\"contact.frequency\" needs a value > 0, at most 100000"));
  EXPECT_THAT(
      complaint_of(replaced(shipped(), "\"unit\": \"1/MPa\"", "\"unit\": \"1/Pa\"")),
      testing::ContainsRegex(":[1-9][0-9]*: error E661: rule \"zone.length_by_bar\" has the unit \"1/MPa\", not "
                             "\"1/Pa\""));
  EXPECT_THAT(complaint_of(replaced(shipped(), "\"zone.twist_rupture\"", "\"zone.slip_rupture\"")),
              testing::HasSubstr("given twice"));
}

}  // namespace
}  // namespace topple::collapse
