#pragma once
/// Numbers in sentences.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace topple {

/// "1 row", "2 rows", "2 thicknesses".
inline std::string count_words(long long n, const std::string& one) {
  return std::to_string(n) + " " + one + (n == 1 ? "" : one.ends_with("s") ? "es" : "s");
}

/// `value` with `least` decimals, and with more where two digits of it would not be seen: "12", "0.012".
inline std::string decimal_words(double value, int least) {
  const double size = std::abs(value);
  const bool has_digits = size > 0 && std::isfinite(size);
  const int decimals = has_digits ? std::max(least, 1 - static_cast<int>(std::floor(std::log10(size)))) : least;
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

}  // namespace topple
