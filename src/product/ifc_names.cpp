#include "product/ifc_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>

namespace topple::product {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

}  // namespace

std::optional<ConcreteClass> find_class(const std::string& name) {
  size_t at = 0;
  const auto skip_blanks = [&] { at = std::min(name.size(), name.find_first_not_of(" \t", at)); };
  const auto read_number = [&] {
    const size_t from = at;
    int number = 0;
    for (; at < name.size() && is_digit(name[at]); ++at)
      if (at - from < 3) number = 10 * number + (name[at] - '0');
    return at - from > 3 ? 0 : number;
  };
  for (size_t c = name.find('C'); c != std::string::npos; c = name.find('C', c + 1)) {
    const size_t first = c > 0 && name[c - 1] == 'L' ? c - 1 : c;
    if (first > 0 && is_letter(name[first - 1])) continue;
    at = c + 1;
    skip_blanks();
    const int fck = read_number();
    skip_blanks();
    if (at == name.size() || name[at] != '/') continue;
    ++at;
    skip_blanks();
    const int cube = read_number();
    if (fck < 8 || fck > 100 || cube < fck || cube > 130) continue;
    return ConcreteClass{fmt::format("{}C{}/{}", first < c ? "L" : "", fck, cube), fck, first < c};
  }
  return std::nullopt;
}

std::string find_yield(const std::string& grade) {
  static const std::regex number(R"((?:^|[^0-9.,/])([2-6][0-9]0)(?![0-9]|[.,][0-9]))"),
      other_units("psi|ksi", std::regex::icase);
  if (std::regex_search(grade, other_units)) return {};
  std::string found;
  for (std::sregex_iterator m(grade.begin(), grade.end(), number), end; m != end; ++m) {
    if (!found.empty() && found != (*m)[1].str()) return {};
    found = (*m)[1].str();
  }
  return found;
}

bool is_masonry(const std::string& name) {
  static const std::regex words("brick|mason|mauer|ziegel|kalksand|klinker|metselwerk", std::regex::icase);
  return std::regex_search(name, words);
}

bool is_concrete(const std::string& name) {
  static const std::regex words("concrete|beton", std::regex::icase);
  return std::regex_search(name, words);
}

const std::string& Keys::of(const std::string& name) {
  const auto [known, is_new] = keys_.try_emplace(name);
  if (!is_new) return known->second;
  std::string key;
  for (const char c : name.substr(0, 40)) key += is_letter(c) || is_digit(c) ? c : '_';
  const std::string first = key;
  for (int i = 2; !taken_.insert(key).second; ++i) key = first + "_" + std::to_string(i);
  return known->second = key;
}

}  // namespace topple::product
