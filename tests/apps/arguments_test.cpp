#include "arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

namespace topple::apps {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::variant<Arguments, int> parse(std::vector<std::string> words) {
  words.insert(words.begin(), "topple");
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  return parse_arguments(static_cast<int>(words.size()), argv.data());
}

/// What the command line says and its exit code.
std::pair<std::string, int> said(const std::vector<std::string>& words) {
  std::ostringstream text;
  std::streambuf* before = std::cout.rdbuf(text.rdbuf());
  const auto result = parse(words);
  std::cout.rdbuf(before);
  const int* code = std::get_if<int>(&result);
  return {text.str(), code == nullptr ? -1 : *code};
}

/// Words of a shell's line: quoted texts are one; ends before a redirection, or two spaces that set off what it is for.
std::vector<std::string> split_line(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  bool quoted = false, any = false;
  for (size_t i = 0; i <= line.size(); ++i) {
    const char c = i < line.size() ? line[i] : ' ';
    if (c == '"') {
      quoted = !quoted, any = true;
    } else if (c == ' ' && !quoted) {
      if (!word.empty() || any) words.push_back(word);
      word.clear(), any = false;
      if (line.compare(i, 2, "  ") == 0 || line.compare(i, 2, " >") == 0) break;
    } else {
      word += c;
    }
  }
  return words;
}

std::vector<std::string> examples_in(const std::string& help) {
  std::istringstream in(help);
  std::vector<std::string> out;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line == "Examples:")
      inside = true;
    else if (inside && line.rfind("  topple ", 0) == 0)
      out.push_back(line.substr(2));
  }
  return out;
}

/// How each verb is typed, out of the manual's headings.
std::vector<std::vector<std::string>> list_typed_verbs() {
  std::istringstream in(said({"manual"}).first);
  std::vector<std::vector<std::string>> out;
  for (std::string line; std::getline(in, line);)
    if (line.rfind(".SS topple ", 0) == 0) out.push_back(split_line(line.substr(11)));
  return out;
}

TEST(Arguments, EveryVerbShowsExamplesThatItUnderstands) {
  const auto verbs = list_typed_verbs();
  EXPECT_GT(verbs.size(), 20u);
  int count = 0;
  for (std::vector<std::string> verb : verbs) {
    std::string name;
    for (const std::string& word : verb) name += word + " ";
    verb.emplace_back("--help");
    const auto [help, code] = said(verb);
    EXPECT_EQ(code, kOk) << name;
    const auto examples = examples_in(help);
    EXPECT_FALSE(examples.empty()) << "no examples: topple " << name << "--help";
    for (const std::string& example : examples) {
      EXPECT_THAT(example + " ", HasSubstr("topple " + name)) << "an example of another verb";
      std::vector<std::string> words = split_line(example);
      words.erase(words.begin());
      const auto parsed = parse(words);
      const int* stopped = std::get_if<int>(&parsed);
      EXPECT_TRUE(stopped == nullptr || *stopped == kOk) << example;
      ++count;
    }
  }
  EXPECT_GT(count, 35);
}

TEST(Arguments, ExamplesOfTheProgramAreUnderstood) {
  const auto examples = examples_in(said({"--help"}).first);
  EXPECT_GT(examples.size(), 15u);
  for (const std::string& example : examples) {
    std::vector<std::string> words = split_line(example);
    words.erase(words.begin());
    const auto parsed = parse(words);
    EXPECT_TRUE(std::holds_alternative<Arguments>(parsed) || std::get<int>(parsed) == kOk) << example;
  }
}

TEST(Arguments, CompletionKnowsEveryVerbAndOption) {
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const auto [script, code] = said({"completion", shell});
    EXPECT_EQ(code, kOk);
    for (const auto& verb : list_typed_verbs()) EXPECT_THAT(script, HasSubstr(verb.back())) << shell;
    for (const char* option : {"frame-rate", "normal-force", "rerun-failed", "no-open", "scaled-step"})
      EXPECT_THAT(script, HasSubstr(option)) << shell;
    EXPECT_THAT(script, HasSubstr("layered solid both"));
    EXPECT_THAT(script, HasSubstr("native"));
  }
  EXPECT_EQ(said({"completion", "csh"}).second, kBadInput);
}

TEST(Arguments, AreRefusedInJsonWhereThatIsAskedFor) {
  const auto refusal = [](const std::vector<std::string>& words) {
    const auto [text, code] = said(words);
    EXPECT_EQ(code, kBadInput);
    return text;
  };
  const auto j = nlohmann::json::parse(refusal({"run", "p.toml", "-o", "x", "--json", "--duratoin", "1 s"}));
  EXPECT_EQ(j["exit_code"], kBadInput);
  EXPECT_EQ(j["diagnostics"][0]["code"], "E801");
  EXPECT_EQ(j["diagnostics"][0]["message"], "topple run: there is no option --duratoin; did you mean --duration?");
  EXPECT_TRUE(nlohmann::json::accept(refusal({"run", "--json"})));
  EXPECT_TRUE(nlohmann::json::accept(refusal({"fe", "p.toml", "--json"})));
  EXPECT_EQ(refusal({"run", "p.toml", "-o", "x", "--duratoin", "1 s"}), "");
  EXPECT_EQ(refusal({"export", "r.h5", "--json", "-o", "x", "--bogus"}), "") << "a format";
}

TEST(Arguments, AnEmptyQuantityIsRefused) {
  EXPECT_EQ(std::get<int>(parse({"fe", "plan.toml", "--size", "", "-o", "out"})), kBadInput);
  EXPECT_EQ(std::get<int>(parse({"run", "plan.toml", "--duration", "", "-o", "out"})), kBadInput);
  EXPECT_EQ(std::get<int>(parse({"mbs", "run", "m.json", "--step=", "-o", "out"})), kBadInput);
  EXPECT_EQ(std::get<Arguments>(parse({"fe", "plan.toml", "--size", "0.4 m", "-o", "out"})).fe.size, "0.4 m");
}

TEST(Arguments, LevelsAndWholeNumbersOfAStudyAreRefused) {
  const auto with = [](const std::string& option, const std::string& value) {
    return parse({"study", "in.toml", "--evaluator", "model", "-o", "out", option, value});
  };
  EXPECT_EQ(std::get<int>(with("--alpha", "")), kBadInput);
  EXPECT_EQ(std::get<int>(with("--alpha", " ")), kBadInput);
  for (const char* number : {"0x20", "020", "+20", "1e3", "20.0", ""})
    for (const char* option : {"--samples", "--jobs", "--batch"})
      EXPECT_EQ(std::get<int>(with(option, number)), kBadInput) << option << number;
  EXPECT_EQ(std::get<Arguments>(with("--samples", "20")).study.samples, 20);
}

TEST(Arguments, WhatOnlyMakesAMeshKeepsNoCheckpoint) {
  EXPECT_EQ(std::get<int>(parse({"fe", "plan.toml", "--mesh-only", "--checkpoint"})), kBadInput);
}

TEST(Arguments, ZshIsToldOfOneRestOfArgumentsAtMost) {
  const std::string script = said({"completion", "zsh"}).first;
  std::istringstream in(script);
  int count = 0;
  for (std::string line; std::getline(in, line);) {
    const size_t first = line.find(" '*:");
    if (first == std::string::npos) continue;
    EXPECT_EQ(line.find(" '*:", first + 1), std::string::npos) << line;
    ++count;
  }
  EXPECT_GT(count, 10);
  EXPECT_THAT(script, HasSubstr(" '1:first:_files' '*:second:_files'"));
}

TEST(Arguments, ManualHasItsParts) {
  const auto [page, code] = said({"manual"});
  EXPECT_EQ(code, kOk);
  for (const char* part : {".SH NAME", ".SH SYNOPSIS", ".SH COMMANDS", ".SH \"EXIT STATUS\"", ".SH EXAMPLES"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, HasSubstr("\\-\\-frame\\-rate"));
}

TEST(Arguments, HelpIsAVerb) {
  EXPECT_EQ(said({"help"}), said({"--help"}));
  EXPECT_EQ(said({"help", "run"}), said({"run", "--help"}));
  EXPECT_EQ(said({"help", "mbs", "run"}), said({"mbs", "run", "--help"}));
  EXPECT_THAT(said({"help", "run"}).first, HasSubstr("--check-step"));
}

TEST(Arguments, OptionsThatNobodyKnowsAreNamed) {
  std::ostringstream text;
  std::streambuf* before = std::cerr.rdbuf(text.rdbuf());
  const int code = said({"run", "--sterp", "3", "plan.toml", "-o", "x"}).second;
  std::cerr.rdbuf(before);
  EXPECT_EQ(code, 2);
  EXPECT_EQ(text.str(),
            "topple run: there is no option --sterp; did you mean --step?\nRun topple run --help for its options.\n");
}

}  // namespace
}  // namespace topple::apps
