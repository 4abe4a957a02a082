#pragma once
/// Random numbers that are the same everywhere: the standard's generator, without the library's distributions.

#include <cmath>
#include <cstdint>
#include <random>

namespace topple::uncertainty {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Uniform in [0, 1).
  double next() { return std::ldexp(static_cast<double>(engine_() >> 11), -53); }
  /// Uniform in [a, b).
  double next(double a, double b) { return a + (b - a) * next(); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace topple::uncertainty
