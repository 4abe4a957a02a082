#include "study_text.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "terminal.h"

namespace topple::apps {
namespace {

TEST(StudyText, ShowsBoundsOfARunningStudyInTheUnitsOfItsResults) {
  study::Problem p;
  p.outputs = {{"lean", "deg", 0.0174532925199433}, {"share", "", 1}};
  study::StudyResult r;
  r.outputs = {"lean", "share"};
  r.alpha.outputs.resize(2);
  for (auto& o : r.alpha.outputs) o.levels.resize(1);
  r.alpha.outputs[0].levels[0].lower.value = -0.0174532925199433;
  r.alpha.outputs[0].levels[0].upper.value = 2 * 0.0174532925199433;
  r.alpha.outputs[1].levels[0].upper.value = 0.5;
  study::StudyState s;
  s.done = 20, s.running = 2, s.run_here = 20, s.seconds = 10, s.limit = 100;
  EXPECT_EQ(describe_state(p, s), "20 done, 2 running, 0 failed, 2/s, at most 40 s left");
  s.so_far = &r;
  EXPECT_EQ(describe_state(p, s),
            "20 done, 2 running, 0 failed, 2/s, at most 40 s left; lean -1 to 2 deg; share 0 to 0.5");
}

TEST(StudyText, WritesWholePercentagesAndOutcomesWithoutAName) {
  study::Problem p;
  p.inputs = {{"a", "", 1}};
  p.space.inputs = {uncertainty::make_triangular(0, 1, 2)};
  study::StudyResult r;
  r.outcomes = {"", "falls"};
  r.alpha.classes.resize(2);
  r.alpha.classes[1].outcome = 1;
  uncertainty::PermissibleBox b;
  b.box = {{0}, {2}}, b.volume = 1, b.kept = true;
  r.insights.has_boxes = true;
  r.insights.boxes.boxes = {b, b};
  r.insights.boxes.boxes[1].volume = 0.0123;
  r.insights.source = study::Insights::Source::Spread;
  r.insights.drivers.outcomes = {{0, 0.5, {{0.9, 0.9, 0.01, 0.01}}}, {1, 0.5, {{0.9, 0.9, 0.01, 0.01}}}};
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = open_memstream(&text, &size);
  print_study(out, p, r);
  std::fclose(out);
  const std::string said(text, size);
  std::free(text);
  EXPECT_NE(said.find("box 1, 100 % of the support"), std::string::npos) << said;
  EXPECT_NE(said.find("box 2, 1.2 % of the support"), std::string::npos) << said;
  EXPECT_NE(said.find("outcome (no name): a 0.90"), std::string::npos) << said;
}

TEST(Terminal, QuotesWordsAsAShellTakesThem) {
  EXPECT_EQ(quote_word("out/plan.toml"), "out/plan.toml");
  EXPECT_EQ(quote_word("büro"), "büro");
  EXPECT_EQ(quote_word("0.4 m"), "\"0.4 m\"");
  for (const char* word :
       {"a", "", "a b", "it's", "$HOME", "a\"b", "`ls`", "a\\b", "!1", "x;y", "(z)", "~", "*", "a'b\"c"}) {
    std::FILE* shell = popen(("printf %s " + quote_word(word)).c_str(), "r");
    ASSERT_NE(shell, nullptr);
    char said[64] = {};
    const size_t count = std::fread(said, 1, sizeof said - 1, shell);
    EXPECT_EQ(pclose(shell), 0) << word;
    EXPECT_EQ(std::string(said, count), word);
  }
}

}  // namespace
}  // namespace topple::apps
