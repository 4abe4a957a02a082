#pragma once
/// topple study and topple worker as processes of a test, over a program that stands for a user's model.

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "../study/server.h"
#include "../uncertainty/reference_cases.h"
#include "study/database.h"

namespace topple::study {

namespace cases = uncertainty::cases;

inline std::string read(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A file of fuzzy inputs for a reference case.
inline void write_inputs(const std::string& path, const std::vector<uncertainty::FuzzyNumber>& inputs) {
  std::ofstream out(path);
  out.precision(17);
  out << "[inputs]\n";
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    out << "x" << i + 1 << " = { tabulated = [";
    for (const auto& c : inputs[i].cuts()) out << "[" << c.alpha << ", " << c.left << ", " << c.right << "], ";
    out << "] }\n";
  }
}

class StudyProgram : public testing::Test {
 protected:
  std::vector<std::string> study(const std::string& out, const std::string& model, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {TOPPLE_PROGRAM,
                                      "study",
                                      folder / "in.toml",
                                      "-o",
                                      folder / out,
                                      "--evaluator",
                                      std::string(TOPPLE_STUDY_MODEL) + " " + model};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  pid_t start(const std::vector<std::string>& words) {
    started.push_back(spawn(words, folder / "log"));
    return started.back();
  }
  /// Nothing outlives a test that failed.
  void TearDown() override {
    for (const pid_t pid : started)
      if (waitpid(pid, nullptr, WNOHANG) == 0) kill(pid, SIGKILL), waitpid(pid, nullptr, 0);
  }
  int run(const std::vector<std::string>& words) { return wait_for(start(words)); }
  /// Same bits in everything that is written.
  void expect_same(const std::string& a, const std::string& b) {
    for (const char* name : {"/results.json", "/membership.csv", "/outcomes.csv", "/samples.csv"}) {
      ASSERT_FALSE(read(folder / a + name).empty()) << read(folder / "log");
      EXPECT_EQ(read(folder / a + name), read(folder / b + name)) << name;
    }
  }
  static long number(Database& db, const std::string& sql) { return std::stol(db.run(sql)[0][0].value()); }
  static long results(Database& db) { return number(db, "SELECT count(*) FROM result"); }
  /// Throws when it takes too long.
  static void wait_until(const std::function<bool()>& is_so) {
    const auto start = std::chrono::steady_clock::now();
    while (!is_so()) {
      if (std::chrono::steady_clock::now() - start > std::chrono::seconds(120))
        throw std::runtime_error("it takes too long");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  void expect_one_result_each(Database& db) {
    EXPECT_EQ(results(db), number(db, "SELECT count(*) FROM job"));
    EXPECT_EQ(number(db, "SELECT count(DISTINCT r.hash) FROM result r JOIN job j ON j.hash = r.hash"), results(db));
    EXPECT_EQ(number(db, "SELECT count(*) FROM job WHERE state NOT IN ('done', 'failed')"), 0);
  }

  Folder folder;
  std::vector<pid_t> started;
};

}  // namespace topple::study
