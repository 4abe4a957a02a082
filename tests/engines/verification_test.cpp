// Every case of the verification on the native engine, and the page that shows them.
#include "engines/verification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

namespace topple::engines {
namespace {

const std::vector<VerificationCase>& cases() {
  static const auto list = make_verification_cases();
  return list;
}

const std::vector<VerificationResult>& results() {
  static const auto list = [] {
    const auto engine = make_engine("native");
    std::vector<VerificationResult> r;
    for (const VerificationCase& c : cases()) r.push_back(verify(c, *engine));
    return r;
  }();
  return list;
}

TEST(VerificationPhysics, ErrorsAreWithinTheirTolerancesAndFallAsTheory) {
  int orders = 0;
  for (size_t i = 0; i < cases().size(); ++i) {
    SCOPED_TRACE(cases()[i].name);
    const VerificationResult& r = results()[i];
    EXPECT_TRUE(r.unsupported.empty());
    EXPECT_EQ(r.failure, "");
    ASSERT_EQ(r.rows.size(), cases()[i].quantities.size());
    for (size_t q = 0; q < r.rows.size(); ++q) {
      const VerifiedQuantity& quantity = cases()[i].quantities[q];
      SCOPED_TRACE(quantity.what);
      EXPECT_LE(r.rows[q].error.back(), quantity.tolerance);
      EXPECT_TRUE(r.rows[q].is_within);
      if (quantity.order > 0) {
        ++orders;
        EXPECT_NEAR(r.rows[q].order, quantity.order, 0.25);
      }
    }
  }
  EXPECT_GE(orders, 20);
}

TEST(Verification, EveryCaseSaysWhatItIsComparedWith) {
  for (const VerificationCase& c : cases()) {
    SCOPED_TRACE(c.name);
    EXPECT_FALSE(c.model.empty());
    EXPECT_FALSE(c.source.empty());
    ASSERT_FALSE(c.steps.empty());
    for (size_t i = 1; i < c.steps.size(); ++i) EXPECT_NEAR(c.steps[i], 0.5 * c.steps[i - 1], 1e-15);
    for (const VerifiedQuantity& q : c.quantities) EXPECT_GT(q.tolerance, 0) << q.what;
  }
}

/// The cells of a line of a table; else the line alone.
std::vector<std::string> cells_of(const std::string& line) {
  if (line.empty() || line[0] != '|') return {line};
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
  return cells;
}

bool is_number(const std::string& cell, double& value) {
  if (cell == " round-off ") {
    value = 0;
    return true;
  }
  char* end = nullptr;
  value = std::strtod(cell.c_str(), &end);
  return end != cell.c_str() && *(end + std::strspn(end, " ")) == '\0';
}

// Words and structure as they stand, and every cell that is one number (exact values, errors, orders, tolerances)
// within a tenth or 1e-8: processors may differ in the last digit of sines and square roots, which small errors
// magnify. Orders that are not claimed are left out, because where errors scatter they do so more.
TEST(VerificationPhysics, ThePageIsWhatTheCommandWrites) {
  constexpr size_t order = 6, expected = 7;  // columns
  const std::string page = to_markdown(*make_engine("native"), cases(), results());
  std::ifstream file(TOPPLE_SOURCE_DIR "/docs/verification.md");
  ASSERT_TRUE(file) << "topple mbs verify --markdown docs/verification.md";
  std::istringstream in(page);
  std::string mine, theirs;
  while (std::getline(in, mine)) {
    ASSERT_TRUE(std::getline(file, theirs)) << "the page ends before: " << mine;
    const auto a = cells_of(mine), b = cells_of(theirs);
    ASSERT_EQ(a.size(), b.size()) << mine << "\n" << theirs;
    for (size_t i = 0; i < a.size(); ++i) {
      double x = 0, y = 0;
      if (i == order && a.size() > expected && a[expected] == " - ") continue;
      if (a.size() > 1 && is_number(a[i], x) && is_number(b[i], y)) {
        EXPECT_NEAR(x, y, std::max(1e-8, 0.1 * std::abs(x))) << mine;
      } else {
        EXPECT_EQ(a[i], b[i]) << mine;
      }
    }
  }
  EXPECT_FALSE(std::getline(file, theirs)) << "the page goes on: " << theirs;
}

TEST(Verification, AWrongEngineIsOutside) {
  // an engine that stands still
  class Still : public Engine {
   public:
    std::string name() const override { return "still"; }
    std::string version() const override { return "1"; }
    std::vector<Unsupported> find_unsupported(const mbs::Model& m, const mbs::Options&) const override {
      if (m.springs.empty()) return {};
      return {{"springs[0]", "springs"}};
    }

   protected:
    mbs::Summary solve(const mbs::Model& m, const mbs::Options& o) const override {
      mbs::View v;
      for (const mbs::Body& b : m.bodies) {
        v.X_WB.push_back(b.X_WB);
        v.v_WB.push_back(b.v_WB);
        v.w_WB.push_back(b.w_WB);
      }
      v.time = o.duration;
      if (o.on_frame) o.on_frame(v);
      return {};
    }
  };
  const Still engine;
  std::vector<VerificationResult> found;
  int unsupported = 0;
  for (const VerificationCase& c : cases()) {
    found.push_back(verify(c, engine));
    const VerificationResult& r = found.back();
    unsupported += !r.unsupported.empty();
    if (r.unsupported.empty()) { EXPECT_FALSE(r.passes()) << c.name; }
  }
  EXPECT_GT(unsupported, 3);
  const std::string page = to_markdown(engine, cases(), found);
  EXPECT_THAT(page, testing::HasSubstr("Not expressible: springs[0]: springs."));
  EXPECT_THAT(page, testing::HasSubstr("**outside**"));
}

}  // namespace
}  // namespace topple::engines
