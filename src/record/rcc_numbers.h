#pragma once
/// Numbers in the files of resistance curves.

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace topple::record {

inline constexpr const char* line_end = "\r\n";  // RFC 4180

/// JSON has no NaN and no infinity.
inline nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}
inline nlohmann::ordered_json numbers(const std::vector<double>& values) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}
/// The shortest digits that give the same number back; not a number is an empty field.
inline std::string digits(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }
inline const char* sign_of(int direction) { return direction < 0 ? "-" : "+"; }

}  // namespace topple::record
