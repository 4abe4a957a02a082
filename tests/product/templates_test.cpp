#include "product/templates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/error.h"
#include "plan_text.h"
#include "product/plan.h"

namespace topple::product {
namespace {

std::string text_of_file(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST(Templates, AreTheFilesOfTheFolderAndNoOthers) {
  const std::filesystem::path folder = TOPPLE_SOURCE_DIR "/examples/templates";
  size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files += entry.path().extension() == ".toml";
  EXPECT_EQ(templates().size(), files);
  for (const Template& t : templates()) {
    EXPECT_EQ(t.text, text_of_file(folder / (t.name + ".toml"))) << t.name;
    EXPECT_FALSE(t.title.empty() || t.description.empty()) << t.name;
    EXPECT_EQ(&find_template(t.name), &t);
  }
}

TEST(Templates, PassTheirOwnCheckWithoutAWord) {
  for (const Template& t : templates()) EXPECT_EQ(rendered(complaints_about(t.text), t.text), "") << t.name;
}

TEST(Templates, TheirCommentedLinesAreLegalToo) {
  for (const Template& t : templates()) {
    // every "# key = value" and "# [[table]]" line switched on
    std::string text, line;
    std::istringstream lines(t.text);
    while (std::getline(lines, line)) {
      const bool is_setting =
          line.starts_with("# ") && (line.find(" = ") != std::string::npos || line.starts_with("# ["));
      text += (is_setting ? line.substr(2) : line) + "\n";
    }
    EXPECT_NE(text, t.text) << t.name;
    EXPECT_EQ(rendered(complaints_about(text), text), "") << t.name;
  }
}

TEST(Templates, AnUnknownNameSaysWhichThereAre) {
  try {
    find_template("fram");
    ADD_FAILURE() << "was taken";
  } catch (const InputError& e) { EXPECT_THAT(e.diagnostics().at(0).help, testing::HasSubstr("\"frame\"")); }
}

TEST(Templates, TheFrameHasThreeStoreysAndTwoStages) {
  std::vector<Diagnostic> warnings;
  const Plan plan = read_plan(find_template("frame").text, "frame.toml", warnings);
  EXPECT_EQ(plan.members.size(), 27u + 36u + 12u + 1u);
  EXPECT_EQ(plan.stages.size(), 2u);
}

}  // namespace
}  // namespace topple::product
