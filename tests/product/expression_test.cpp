#include "product/expression.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple::product {
namespace {

const std::vector<std::string> names{"fc", "Ec", "x"};

double value(const std::string& text, double fc = 25, double Ec = 30000, double x = 2) {
  ExpressionFault fault;
  const Expression e = Expression::parse(text, names, fault);
  EXPECT_EQ(fault.message, "") << text;
  const double values[] = {fc, Ec, x};
  return e.evaluate(values);
}

TEST(Expression, FollowsTheRulesOfArithmetic) {
  EXPECT_EQ(value("1 + 2 * 3"), 7);
  EXPECT_EQ(value("(1 + 2) * 3"), 9);
  EXPECT_EQ(value("10 - 4 - 3"), 3) << "from the left";
  EXPECT_EQ(value("100 / 10 / 5"), 2) << "from the left";
  EXPECT_EQ(value("2^3^2"), 512) << "from the right";
  EXPECT_EQ(value("-2^2"), -4) << "the power binds tighter than the sign";
  EXPECT_EQ(value("2^-1"), 0.5);
  EXPECT_EQ(value("(-2)^2"), 4);
  EXPECT_EQ(value("2 * -3"), -6);
  EXPECT_EQ(value("--3"), 3);
  EXPECT_EQ(value("+3"), 3);
  EXPECT_EQ(value("2*x^2"), 8);
  EXPECT_EQ(value(" 1.5e2 "), 150);
  EXPECT_EQ(value(".5"), 0.5);
  EXPECT_EQ(value("fc/Ec"), 25.0 / 30000);
}

TEST(Expression, KnowsItsFunctions) {
  EXPECT_EQ(value("max(0.0022, 1.3 * fc / Ec)", 45, 15000), 1.3 * 45 / 15000);
  EXPECT_EQ(value("min(x, 1)"), 1);
  EXPECT_EQ(value("sqrt(16)"), 4);
  EXPECT_EQ(value("abs(1 - 3)"), 2);
  EXPECT_DOUBLE_EQ(value("ln(exp(3))"), 3);
  EXPECT_EQ(value("max(min(1, 2), max(0, x))"), 2);
  // of what has no value there is neither a least nor a largest
  for (const char* formula : {"min(1, sqrt(0 - 1))", "min(sqrt(0 - 1), 1)", "max(1, ln(0 - 1))", "max(ln(0 - 1), 1)"})
    EXPECT_TRUE(std::isnan(value(formula))) << formula;
}

// Table 1 of the paper: f_ct from f_c by its equation (1), values of reference_cases to six digits.
TEST(ExpressionReference, TensileStrengthOfThePaper) {
  const std::string equation_1 = "1.40 * ((fc - 8) / 10)^(2/3)";
  EXPECT_NEAR(value(equation_1, 10), 0.478793, 5e-7);
  EXPECT_NEAR(value(equation_1, 25), 1.994163, 5e-7);
  EXPECT_NEAR(value(equation_1, 45), 3.349108, 5e-7);
  EXPECT_TRUE(std::isnan(value(equation_1, 7))) << "no real power of a negative number";
}

TEST(Expression, TellsWhatItUses) {
  ExpressionFault fault;
  EXPECT_EQ(Expression::parse("x + fc * x", names, fault).used(), (std::vector<int>{0, 2}));
  EXPECT_TRUE(Expression::parse("3", names, fault).used().empty());
}

struct Mistake {
  std::string text;
  size_t offset;
  const char* message;
};

TEST(Expression, PointsAtItsMistakes) {
  const Mistake mistakes[] = {
      {"", 0, "empty"},
      {"   ", 0, "empty"},
      {"1 +", 2, "ends where a value is wanted"},
      {"1 + * 2", 4, "a value is wanted"},
      {"(1 + 2", 0, "not closed"},
      {"2 * (1 + 2", 4, "not closed"},
      {"1 + 2)", 5, "an operator is wanted"},
      {"fd + 1", 0, "no value \"fd\""},
      {"1 + foo(2)", 4, "no function \"foo\""},
      {"min(1)", 0, "min takes 2 values"},
      {"sqrt(1, 2)", 0, "sqrt takes 1 value"},
      {"max(1, 2", 0, "not closed"},
      {"2 fc", 2, "an operator is wanted"},
      {"1 $ 2", 2, "an operator is wanted"},
      {"1e999", 0, "not a number"},
      {".", 0, "not a number"},
      {std::string(600, '1'), 500, "longer than"},
      {std::string(100, '(') + "1" + std::string(100, ')'), 50, "nested too deep"},
      {std::string(100, '-') + "1", 50, "nested too deep"},
  };
  for (const Mistake& m : mistakes) {
    ExpressionFault fault;
    const Expression e = Expression::parse(m.text, names, fault);
    EXPECT_NE(fault.message.find(m.message), std::string::npos) << m.text << ": " << fault.message;
    EXPECT_EQ(fault.offset, m.offset) << m.text << ": " << fault.message;
    const double values[] = {1, 2, 3};
    EXPECT_EQ(e.evaluate(values), 0) << "a faulty formula is 0, not a crash";
  }
}

TEST(Expression, SuggestsNames) {
  ExpressionFault fault;
  Expression::parse("fcc + 1", names, fault);
  EXPECT_NE(fault.help.find("fc"), std::string::npos);
  fault = {};
  Expression::parse("squrt(2)", names, fault);
  EXPECT_NE(fault.help.find("sqrt"), std::string::npos);
}

TEST(Expression, SurvivesAnyText) {
  // pieces in every order, a few thousand of them
  const char* pieces[] = {"fc", "(", ")", "+", "-", "*", "/", "^", ",", "1.5", "min", "sqrt", " ", "e", "\xC3\xA4"};
  std::uint64_t state = 7;
  int fine = 0;
  for (int run = 0; run < 5000; ++run) {
    std::string text;
    for (int i = 0; i < 1 + run % 8; ++i) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      text += pieces[(state >> 33) % std::size(pieces)];
    }
    ExpressionFault fault;
    const Expression e = Expression::parse(text, names, fault);
    const double values[] = {1, 2, 3};
    e.evaluate(values);
    fine += fault.message.empty();
    if (!fault.message.empty()) { EXPECT_LE(fault.offset, text.size()) << text; }
  }
  EXPECT_GT(fine, 0);
}

}  // namespace
}  // namespace topple::product
