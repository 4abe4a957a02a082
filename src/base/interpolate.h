#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace topple {

/// Value at t, on a straight line from one point to the next; the first or last value outside of them.
///   time  ascending, as many as values, at least one
inline double interpolate(const std::vector<double>& time, const std::vector<double>& value, double t) {
  const auto after = std::lower_bound(time.begin(), time.end(), t);
  if (after == time.begin()) return value.front();
  if (after == time.end()) return value.back();
  const auto i = static_cast<std::size_t>(after - time.begin());
  const double share = (t - time[i - 1]) / (time[i] - time[i - 1]);
  return (1 - share) * value[i - 1] + share * value[i];
}

}  // namespace topple
