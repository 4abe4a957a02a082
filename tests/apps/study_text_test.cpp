#include "study_text.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "terminal.h"

namespace topple::apps {
namespace {

std::string print(const study::Problem& p, const study::StudyResult& r) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = open_memstream(&text, &size);
  print_study(out, p, r);
  std::fclose(out);
  std::string said(text, size);
  std::free(text);
  return said;
}

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
  r.insights.boxes.boxes[1].volume = 0.0123, r.insights.boxes.boxes[1].kept = false;
  r.insights.source = study::Insights::Source::Spread;
  r.insights.drivers.outcomes = {{0, 0.5, {{0.9, 0.9, 0.01, 0.01}}}, {1, 0.5, {{0.9, 0.9, 0.01, 0.01}}}};
  const std::string said = print(p, r);
  EXPECT_NE(said.find("box 1, 100 % of the support"), std::string::npos) << said;
  EXPECT_NE(said.find("  dropped box, 1.2 % of the support"), std::string::npos)
      << said << "without a number, as if it were one";
  EXPECT_NE(said.find("outcome (no name): a 0.90"), std::string::npos) << said;
}

TEST(StudyText, WritesNothingThatATerminalWouldObey) {
  study::Problem p;
  p.title = "title\x1b[2J";
  p.inputs = {{"a", "", 1}};
  p.space.inputs = {uncertainty::make_triangular(0, 1, 2)};
  study::StudyResult r;
  r.outputs = {"z\nwidth\x07"};
  r.outcomes = {"stands", "falls\r\x1b]0;no\xC2\x9B"};
  r.alpha.classes.resize(2);
  r.alpha.classes[1].outcome = 1;
  r.alpha.outputs.resize(1);
  r.alpha.outputs[0].levels.resize(2);
  r.failures = {"3 x exit code 1: line\none\tand two\x1b[31m"};
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = open_memstream(&text, &size);
  print_study(out, p, r);
  study::StudyState s;
  s.so_far = &r;
  std::fputs(describe_state(p, s).c_str(), out);
  std::fclose(out);
  const std::string said(text, size);
  std::free(text);
  for (const char c : said) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << static_cast<int>(c);
  EXPECT_EQ(said.find("\xC2\x9B"), std::string::npos);
  for (const char* whole : {"z width?", "falls ?]0;no?", "3 x exit code 1: line one and two?[31m", "title?[2J"})
    EXPECT_NE(said.find(whole), std::string::npos) << whole << " in " << said;
  EXPECT_EQ(to_printable("büro 5 °, 3 €"), "büro 5 °, 3 €");
}

TEST(StudyText, RoundsDegreesSoThatTheyStayTrue) {
  study::Problem p;
  study::StudyResult r;
  r.outcomes = {"stands", "falls"};
  for (int k = 0; k < 2; ++k) {
    uncertainty::ClassBounds c;
    c.outcome = k, c.possibility = k == 0 ? 1 : 0.123456789;
    r.alpha.classes.push_back(c);
    uncertainty::Possibility found;
    found.outcome = k, found.possibility = c.possibility, found.converged = true;
    r.possibilities.classes.push_back(found);
  }
  const std::string said = print(p, r);
  EXPECT_NE(said.find("0.12345 "), std::string::npos) << said << "at least";
  EXPECT_NE(said.find("0.87655 "), std::string::npos) << said << "at most";
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
