#pragma once
/// Numbers of things in sentences.

#include <string>

namespace topple {

/// "1 row", "2 rows", "2 thicknesses".
inline std::string count_words(long long n, const std::string& one) {
  return std::to_string(n) + " " + one + (n == 1 ? "" : one.ends_with("s") ? "es" : "s");
}

}  // namespace topple
