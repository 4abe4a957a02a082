/// Whatever a file holds, reading it ends in a plan or in complaints that point into it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "plan_text.h"
#include "product/plan.h"

namespace topple::product {
namespace {

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Characters in the n-th line, its end not counted; -1 if the text has no such line.
int calc_line_length(const std::string& text, int line) {
  size_t begin = 0;
  for (int i = 1; i < line; ++i) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return -1;
    ++begin;
  }
  const size_t end = std::min(text.find('\n', begin), text.size());
  return static_cast<int>(std::count_if(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                        text.begin() + static_cast<std::ptrdiff_t>(end),
                                        [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// True if the text was refused; every complaint must have a place in it, a code and words, and must render.
bool is_refused(const std::string& text) {
  std::vector<Diagnostic> warnings;
  try {
    read_plan(text, "plan.toml", warnings);
    return false;
  } catch (const InputError& error) {
    bool has_error = false;
    for (const Diagnostic& d : error.diagnostics()) {
      has_error = has_error || d.severity == Severity::Error;
      const int length = calc_line_length(text, d.where.line);
      EXPECT_GE(d.where.line, 1) << d.message;
      EXPECT_GE(d.where.column, 1) << d.message;
      EXPECT_GE(length, 0) << d.code << " " << d.message << " at line " << d.where.line;
      EXPECT_LE(d.where.column, length + 1) << d.code << " " << d.message;  // just behind the end: something is missing
      EXPECT_GE(d.width, 1);
      EXPECT_EQ(d.code.size(), 4u);
      EXPECT_FALSE(d.message.empty());
      EXPECT_FALSE(render(d, text, true).empty());
    }
    EXPECT_TRUE(has_error);
    return true;
  }
}

/// The name of a file begins with the code of its error, "E204-bare-number.toml".
TEST(Malformed, EveryFileOfTheCorpusIsRefusedForItsReason) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(TOPPLE_SOURCE_DIR) + "/tests/data/malformed")) {
    const std::string name = entry.path().filename().string(), text = bytes_of(entry.path());
    SCOPED_TRACE(name);
    ++count;
    EXPECT_TRUE(is_refused(text));
    const std::vector<Diagnostic> complaints = complaints_about(text);
    EXPECT_TRUE(std::any_of(complaints.begin(), complaints.end(), [&](const Diagnostic& d) {
      return d.code == name.substr(0, 4);
    })) << rendered(complaints, text);
  }
  EXPECT_GE(count, 60);
}

/// Values of the plan as they are written: from behind "= " to the end of the line.
std::vector<std::pair<size_t, size_t>> find_values(const std::string& text) {
  std::vector<std::pair<size_t, size_t>> values;
  for (size_t at = text.find("= "); at != std::string::npos; at = text.find("= ", at + 2)) {
    const size_t begin = at + 2, end = text.find_first_of(",}\n#", begin);
    if (end != std::string::npos) values.push_back({begin, end});
  }
  return values;
}

class Mutations : public testing::Test {
 protected:
  size_t below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random_); }

  const std::string plan_ = bytes_of(std::string(TOPPLE_SOURCE_DIR) + "/examples/weida/plan.toml");
  std::mt19937 random_{20240229};
};

TEST_F(Mutations, OfBytes) {
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string text = plan_;
    for (size_t k = 0, n = 1 + below(3); k < n; ++k) text[below(text.size())] ^= static_cast<char>(1 << below(8));
    refused += is_refused(text);
    if (HasFailure()) FAIL() << "mutation " << i;
  }
  EXPECT_GT(refused, 300);  // flips in comments and names change nothing
}

TEST_F(Mutations, DeletionsInsertionsAndTruncations) {
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string text = plan_;
    const size_t at = below(text.size()), length = 1 + below(60);
    switch (i % 4) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text.resize(at);
        break;
      case 2:
        text.insert(at, text.substr(below(text.size()), length));
        break;
      case 3: {  // a line goes elsewhere
        const size_t begin = text.rfind('\n', at), end = text.find('\n', at);
        if (begin == std::string::npos || end == std::string::npos) break;
        const std::string line = text.substr(begin, end - begin);
        text.erase(begin, end - begin);
        text.insert(text.find('\n', below(text.size() - 1)), line);
        break;
      }
    }
    refused += is_refused(text);
    if (HasFailure()) FAIL() << "mutation " << i;
  }
  EXPECT_GT(refused, 500);
}

TEST_F(Mutations, ValuesOfOtherTypes) {
  const char* const others[] = {"7",
                                "-1",
                                "0",
                                "1e308",
                                "-0.0",
                                "inf",
                                "nan",
                                "true",
                                "\"\"",
                                "\"x\"",
                                "\"nan m\"",
                                "\"1e15 m\"",
                                "\"-3 m\"",
                                "\"0 s\"",
                                "\"1e-300 N/mm2\"",
                                "\"*\"",
                                "\"..\"",
                                "[]",
                                "[[]]",
                                "[1, \"a\"]",
                                "[{}]",
                                "{}",
                                "{ a = 1 }",
                                "1979-05-27T07:32:00Z",
                                "07:32:00",
                                "9223372036854775807",
                                "-9223372036854775808",
                                "0xFFFFFFFF",
                                "\"\\u0000\"",
                                "'''x'''"};
  const auto values = find_values(plan_);
  ASSERT_GT(values.size(), 100u);
  int refused = 0;
  for (const auto& [begin, end] : values)
    for (const char* other : others) {
      refused += is_refused(plan_.substr(0, begin) + other + plan_.substr(end));
      if (HasFailure()) FAIL() << "value at byte " << begin << " replaced by " << other;
    }
  EXPECT_GT(refused, 2000);
}

TEST_F(Mutations, ValuesOfOtherKeys) {
  const auto values = find_values(plan_);
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    auto a = values[below(values.size())], b = values[below(values.size())];
    if (a.first == b.first) continue;
    if (a.first > b.first) std::swap(a, b);
    const std::string text = plan_.substr(0, a.first) + plan_.substr(b.first, b.second - b.first) +
                             plan_.substr(a.second, b.first - a.second) + plan_.substr(a.first, a.second - a.first) +
                             plan_.substr(b.second);
    refused += is_refused(text);
    if (HasFailure()) FAIL() << "swap " << i;
  }
  EXPECT_GT(refused, 500);
}

TEST(Hostile, DeepNestingIsAnError) {
  for (const size_t depth : {size_t{20}, size_t{300}, size_t{100000}}) {
    std::string dots = "a", tables;
    for (size_t i = 1; i < depth; ++i) dots += ".a";
    for (size_t i = 0; i < depth; ++i) tables += "{a=";
    EXPECT_TRUE(is_refused("x = " + std::string(depth, '[')));
    EXPECT_TRUE(is_refused("x = " + std::string(depth, '[') + std::string(depth, ']')));
    EXPECT_TRUE(is_refused("x = " + tables));
    EXPECT_TRUE(is_refused(dots + " = 1"));
    EXPECT_TRUE(is_refused("[" + dots + "]"));
    EXPECT_TRUE(is_refused("[[" + dots + "]]"));
    EXPECT_TRUE(is_refused("x = { k = \"\"\"t\"\"\"\"\", " + dots + " = 1 }"));
    EXPECT_TRUE(is_refused("x = { k = '''t''''', " + dots + " = 1 }"));
    EXPECT_TRUE(is_refused("x = { k = \"\\\"\", " + dots + " = 1 }"));
  }
}

TEST(Hostile, LongWordsAndLinesAreAnError) {
  EXPECT_TRUE(is_refused("title = \"" + std::string(100000, 'x') + "\""));
  EXPECT_TRUE(is_refused(std::string(100000, 'x') + " = 1"));
  EXPECT_TRUE(is_refused(
      replaced(small_plan(), "removed = [\"W-A1A2-0\"]", "removed = [\"" + std::string(100000, '*') + "\"]")));
  std::string many = "removed = [";
  for (int i = 0; i < 100000; ++i) many += "\"*\",";
  EXPECT_TRUE(is_refused(replaced(small_plan(), "removed = [\"W-A1A2-0\"]", many + "]")));
}

}  // namespace
}  // namespace topple::product
