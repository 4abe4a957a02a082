#include "study/permissible.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"

namespace topple::study {
namespace {

constexpr const char* form = "such as \"topple, reach_pos_x <= 20\": outcomes and limits of outputs between commas";

std::string trim(std::string_view s) {
  const std::size_t a = s.find_first_not_of(" \t\r\n"), b = s.find_last_not_of(" \t\r\n");
  return a == std::string_view::npos ? std::string() : std::string(s.substr(a, b - a + 1));
}

std::string unquoted(const std::string& s) {
  return s.size() >= 2 && s.front() == '"' && s.back() == '"' ? s.substr(1, s.size() - 2) : s;
}

/// The place of a character outside quotes, or none.
std::size_t find_outside(std::string_view s, std::string_view any, std::size_t from = 0) {
  bool is_inside = false;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s[i] == '"') is_inside = !is_inside;
    if (!is_inside && i >= from && any.find(s[i]) != std::string_view::npos) return i;
  }
  return std::string_view::npos;
}

/// The place of the sign of a limit; one within parentheses belongs to a name such as p(z > 3), if there is another.
std::size_t find_sign(std::string_view s) {
  const std::size_t first = find_outside(s, "<>");
  int depth = 0;
  for (std::size_t i = 0; first != std::string_view::npos && i < s.size(); ++i) {
    depth += s[i] == '(' ? 1 : s[i] == ')' ? -1 : 0;
    if (depth == 0 && find_outside(s, "<>", i) == i) return i;
  }
  return first;
}

[[noreturn]] void complain(const std::string& what, const std::string& help = form) {
  throw InputError("E825", "--permissible: " + what, help);
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& n : names) text += (text.empty() ? "" : ", ") + (n.empty() ? "(no name)" : n);
  return text;
}

[[noreturn]] void complain_of_name(const std::string& what, const std::string& name,
                                   const std::vector<std::string>& known) {
  const std::string near = nearest_name(name, known);
  complain(fmt::format("there is no {} \"{}\"", what, name),
           (near.empty() ? "" : "did you mean \"" + near + "\"? ") + ("known: " + list(known)));
}

PermissibleLimit read_limit(const std::string& part, std::size_t sign, const Problem& p) {
  PermissibleLimit limit;
  limit.text = part;
  limit.output = unquoted(trim(part.substr(0, sign)));
  limit.is_most = part[sign] == '<';
  std::size_t at = sign + 1;
  limit.is_strict = at >= part.size() || part[at] != '=';
  if (!limit.is_strict) ++at;
  const std::string right = trim(part.substr(at));
  const auto [end, fault] = std::from_chars(right.data(), right.data() + right.size(), limit.value);
  if (fault != std::errc() || !std::isfinite(limit.value))
    complain(fmt::format("\"{}\": a number is wanted behind {}", part, part.substr(sign, at - sign)));
  if (limit.output.empty()) complain(fmt::format("\"{}\": the name of an output is wanted in front", part));
  const Quantity q = find_output(p, limit.output);
  const std::string unit = trim(std::string_view(end, right.data() + right.size()));
  if (!unit.empty() && unit != q.unit)
    complain(fmt::format("\"{}\": {} is shown in {}", part, limit.output, q.unit.empty() ? "no unit" : q.unit));
  limit.value *= q.unit_value;
  if (!p.outputs.empty()) {
    std::vector<std::string> known;
    for (const Quantity& o : p.outputs) known.push_back(o.name);
    if (std::find(known.begin(), known.end(), limit.output) == known.end())
      complain_of_name("output", limit.output, known);
  }
  return limit;
}

}  // namespace

Permissible read_permissible(const std::string& text, const Problem& p) {
  Permissible out;
  if (std::count(text.begin(), text.end(), '"') % 2 != 0) complain("a quote is not closed");
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(find_outside(text, ",", begin), text.size());
    const std::string part = trim(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    if (part.empty()) complain("a part is empty");
    if (const std::size_t sign = find_sign(part); sign != std::string::npos) {
      out.limits.push_back(read_limit(part, sign, p));
      continue;
    }
    const std::string name = unquoted(part);
    if (find_outside(part, "=") != std::string::npos)
      complain(fmt::format("\"{}\": an output can be kept below or above a number", part),
               "such as \"r <= 0.3\"; the name of an outcome that has a sign stands in double quotes");
    if (!p.outcomes.empty() && std::find(p.outcomes.begin(), p.outcomes.end(), name) == p.outcomes.end())
      complain_of_name("outcome", name, p.outcomes);
    if (p.random)
      complain(fmt::format("\"{}\": a point of random inputs has no outcome", name),
               fmt::format("ask for its share, which has to be one of the statistics: \"p({}) >= 0.95\"", name));
    out.outcomes.push_back(name);
  }
  return out;
}

void check_outputs(const Permissible& p, const std::vector<std::string>& outputs) {
  for (const PermissibleLimit& l : p.limits)
    if (std::find(outputs.begin(), outputs.end(), l.output) == outputs.end())
      complain_of_name("output", l.output, outputs);
}

uncertainty::Requirement make_requirement(const Permissible& p, const std::vector<std::string>& outputs,
                                          const std::vector<std::string>& outcomes) {
  std::vector<int> allowed;
  for (const std::string& name : p.outcomes) {
    const auto found = std::find(outcomes.begin(), outcomes.end(), name);
    if (found != outcomes.end()) allowed.push_back(static_cast<int>(found - outcomes.begin()));
  }
  check_outputs(p, outputs);
  struct Rule {
    std::size_t output;
    double sign, value, size;
    bool is_strict;
  };
  std::vector<Rule> rules;
  for (const PermissibleLimit& l : p.limits) {
    const auto found = std::find(outputs.begin(), outputs.end(), l.output);
    rules.push_back({static_cast<std::size_t>(found - outputs.begin()), l.is_most ? 1.0 : -1.0, l.value,
                     l.value == 0 ? 1.0 : std::abs(l.value), l.is_strict});
  }
  return [has_outcomes = !p.outcomes.empty(), allowed, rules](const uncertainty::Result& r) {
    if (has_outcomes && std::find(allowed.begin(), allowed.end(), r.outcome) == allowed.end()) return -1.0;
    double margin = 1;
    for (const Rule& rule : rules) {
      const double room = rule.sign * (rule.value - r.values[rule.output]) / rule.size;
      // what lies on a strict limit violates it by next to nothing
      margin = std::min(margin, rule.is_strict && room == 0 ? -std::numeric_limits<double>::min() : room);
    }
    return margin;
  };
}

}  // namespace topple::study
