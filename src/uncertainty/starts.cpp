#include "uncertainty/starts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace topple::uncertainty {

double RankedPlaces::calc_distance(const double* a, const double* b) const {
  double distance = 0;
  for (std::size_t i = 0; i < n; ++i) distance = std::max(distance, std::abs(a[i] - b[i]));
  return distance;
}

bool RankedPlaces::is_bottom(std::size_t k) const {
  const double* here = &at[k * n];
  double nearest = std::numeric_limits<double>::infinity();  // of the better ones
  for (std::size_t j = 0; j < k; ++j) nearest = std::min(nearest, calc_distance(&at[j * n], here));
  std::size_t nearer = 0;
  for (std::size_t j = k + 1; j < size() && nearer < 2 * n; ++j)
    nearer += calc_distance(&at[j * n], here) < nearest ? 1 : 0;
  return nearer >= 2 * n;
}

std::vector<std::size_t> choose_apart(const RankedPlaces& places, std::vector<double>& taken, double least,
                                      std::size_t count, const std::function<bool(std::size_t)>& is_allowed) {
  std::vector<std::size_t> chosen;
  const std::size_t n = places.n;
  for (std::size_t k = 0; k < places.size() && chosen.size() < count; ++k) {
    const double* here = &places.at[k * n];
    bool is_apart = true;
    for (std::size_t j = 0; j + n <= taken.size() && is_apart; j += n)
      is_apart = places.calc_distance(&taken[j], here) > least;
    if (!is_apart || !is_allowed(k)) continue;
    chosen.push_back(k);
    taken.insert(taken.end(), here, here + n);
  }
  return chosen;
}

}  // namespace topple::uncertainty
