#include "product/expression.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "product/complaints.h"

namespace topple::product {

namespace {

constexpr size_t longest = 500;
constexpr int deepest = 50;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

}  // namespace

/// Recursive descent; the first fault ends it.
class ExpressionParser {
 public:
  using Code = Expression::Code;

  ExpressionParser(const std::string& text, const std::vector<std::string>& names, ExpressionFault& fault)
      : text_(text), names_(names), fault_(fault) {}

  Expression parse() {
    if (text_.size() > longest) {
      fail(longest, "the formula is longer than " + std::to_string(longest) + " characters");
    } else if (skip(), at_ == text_.size()) {
      fail(0, "the formula is empty");
    } else {
      sum();
      if (!failed_ && at_ < text_.size()) fail(at_, "an operator is wanted before " + rest());
    }
    if (failed_) out_ = {};
    if (out_.steps_.empty()) out_.steps_.push_back({});
    std::sort(out_.used_.begin(), out_.used_.end());
    out_.used_.erase(std::unique(out_.used_.begin(), out_.used_.end()), out_.used_.end());
    return out_;
  }

 private:
  void fail(size_t offset, const std::string& message, const std::string& help = {}) {
    if (failed_) return;
    failed_ = true;
    fault_ = {offset, message, help};
  }
  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }
  char peek() {
    skip();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool take(char c) {
    if (peek() != c || at_ >= text_.size()) return false;
    ++at_;
    return true;
  }
  std::string rest() const { return quoted(text_.substr(at_, 12)); }
  void add(Code code) { out_.steps_.push_back({code, 0, -1}); }

  void sum() {
    product();
    while (!failed_) {
      if (take('+')) {
        product(), add(Code::Add);
      } else if (take('-')) {
        product(), add(Code::Subtract);
      } else {
        return;
      }
    }
  }
  void product() {
    sign();
    while (!failed_) {
      if (take('*')) {
        sign(), add(Code::Multiply);
      } else if (take('/')) {
        sign(), add(Code::Divide);
      } else {
        return;
      }
    }
  }
  void sign() {
    if (++depth_ > deepest) {
      fail(at_, "the formula is nested too deep");
    } else if (take('-')) {
      sign(), add(Code::Negate);
    } else if (take('+')) {
      sign();
    } else {
      power();
    }
    --depth_;
  }
  void power() {
    value();
    if (failed_ || !take('^')) return;
    sign();  // from the right, and a sign may stand there
    add(Code::Power);
  }
  void value() {
    const char c = peek();
    const size_t start = at_;
    if (is_digit(c) || c == '.') {
      double number = 0;
      const auto [end, failure] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
      if (failure != std::errc{} || !std::isfinite(number)) return fail(start, rest() + " is not a number");
      at_ = static_cast<size_t>(end - text_.data());
      out_.steps_.push_back({Code::Number, number, -1});
    } else if (is_letter(c)) {
      while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
      name(text_.substr(start, at_ - start), start);
    } else if (take('(')) {
      sum();
      if (!failed_ && !take(')')) fail(start, "this parenthesis is not closed");
    } else if (at_ == text_.size()) {
      fail(text_.empty() ? 0 : text_.size() - 1, "the formula ends where a value is wanted");
    } else {
      fail(at_, "a value is wanted instead of " + rest());
    }
  }
  void name(const std::string& word, size_t start) {
    struct Function {
      const char* name;
      Code code;
      int arguments;
    };
    static constexpr Function functions[] = {{"min", Code::Min, 2}, {"max", Code::Max, 2}, {"sqrt", Code::Sqrt, 1},
                                             {"exp", Code::Exp, 1}, {"ln", Code::Ln, 1},   {"abs", Code::Abs, 1}};
    if (peek() == '(') {
      for (const Function& f : functions) {
        if (word != f.name) continue;
        take('(');
        for (int i = 0; i < f.arguments; ++i) {
          if (i > 0 && !take(','))
            return fail(start, word + " takes " + std::to_string(f.arguments) + " values between commas");
          sum();
          if (failed_) return;
        }
        if (!take(')'))
          return fail(start, peek() == ',' ? word + " takes " + std::to_string(f.arguments) + " value" +
                                                 (f.arguments > 1 ? "s" : "")
                                           : "the parenthesis after " + word + " is not closed");
        return add(f.code);
      }
      std::vector<std::string> known;
      for (const Function& f : functions) known.push_back(f.name);
      return fail(start, "there is no function " + quoted(word),
                  did_you_mean(word, known, "functions: " + list_of(known)));
    }
    for (size_t i = 0; i < names_.size(); ++i) {
      if (names_[i] != word) continue;
      out_.steps_.push_back({Code::Variable, 0, static_cast<int>(i)});
      out_.used_.push_back(static_cast<int>(i));
      return;
    }
    fail(start, "there is no value " + quoted(word), did_you_mean(word, names_, "known here: " + list_of(names_)));
  }

  const std::string& text_;
  const std::vector<std::string>& names_;
  ExpressionFault& fault_;
  Expression out_;
  size_t at_ = 0;
  int depth_ = 0;
  bool failed_ = false;
};

Expression Expression::parse(const std::string& text, const std::vector<std::string>& names, ExpressionFault& fault) {
  return ExpressionParser(text, names, fault).parse();
}

double Expression::evaluate(std::span<const double> values) const {
  std::vector<double> stack;
  stack.reserve(steps_.size());
  const auto pop = [&stack] {
    const double v = stack.back();
    stack.pop_back();
    return v;
  };
  for (const Step& s : steps_) {
    if (s.code == Code::Number) {
      stack.push_back(s.number);
      continue;
    }
    if (s.code == Code::Variable) {
      stack.push_back(values[static_cast<size_t>(s.variable)]);
      continue;
    }
    const double b = pop();
    switch (s.code) {
      case Code::Negate:
        stack.push_back(-b);
        continue;
      case Code::Sqrt:
        stack.push_back(std::sqrt(b));
        continue;
      case Code::Exp:
        stack.push_back(std::exp(b));
        continue;
      case Code::Ln:
        stack.push_back(std::log(b));
        continue;
      case Code::Abs:
        stack.push_back(std::abs(b));
        continue;
      default:
        break;
    }
    const double a = pop();
    switch (s.code) {
      case Code::Add:
        stack.push_back(a + b);
        break;
      case Code::Subtract:
        stack.push_back(a - b);
        break;
      case Code::Multiply:
        stack.push_back(a * b);
        break;
      case Code::Divide:
        stack.push_back(a / b);
        break;
      case Code::Power:
        stack.push_back(std::pow(a, b));
        break;
      case Code::Min:
        stack.push_back(std::isnan(a) ? a : std::isnan(b) ? b : std::min(a, b));  // of no value there is no least
        break;
      case Code::Max:
        stack.push_back(std::isnan(a) ? a : std::isnan(b) ? b : std::max(a, b));
        break;
      default:
        break;
    }
  }
  return stack.back();
}

}  // namespace topple::product
