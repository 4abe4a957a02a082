#pragma once
/// Formulas of a file: "1.4 * ((fc - 8) / 10)^(2/3)". Numbers, names, + - * / ^, parentheses, and the functions min,
/// max, sqrt, exp, ln, abs. ^ binds tightest and from the right, and before a sign: -2^2 = -4.

#include <span>
#include <string>
#include <vector>

namespace topple::product {

/// What is wrong with a formula, at which character from 0.
struct ExpressionFault {
  size_t offset = 0;
  std::string message, help;
};

class Expression {
 public:
  /// Reads a formula of at most 500 characters, nested at most 50 levels deep; `names` are the variables it may use.
  /// With a fault, `fault` is filled and the formula is 0.
  static Expression parse(const std::string& text, const std::vector<std::string>& names, ExpressionFault& fault);

  /// Value for the variables in the order of `names`; NaN or infinite outside of the formula's range.
  double evaluate(std::span<const double> values) const;
  /// Indices of the variables that are used, rising.
  const std::vector<int>& used() const { return used_; }

 private:
  friend class ExpressionParser;
  enum class Code { Number, Variable, Negate, Add, Subtract, Multiply, Divide, Power, Min, Max, Sqrt, Exp, Ln, Abs };
  struct Step {
    Code code = Code::Number;
    double number = 0;
    int variable = -1;
  };
  std::vector<Step> steps_;  // operands first
  std::vector<int> used_;
};

}  // namespace topple::product
