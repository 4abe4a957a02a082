#pragma once
/// Where searches of a cut begin: good places that are apart from each other and from what is known.

#include <cstddef>
#include <functional>
#include <vector>

namespace topple::uncertainty {

/// Places of a cut, each by its coordinates (n a place) in widths of the cut, the best one first.
struct RankedPlaces {
  std::size_t n = 0;
  std::vector<double> at;  // (places x n)

  std::size_t size() const { return n > 0 ? at.size() / n : 0; }
  /// The largest difference of two places' coordinates.
  double calc_distance(const double* a, const double* b) const;
  /// Whether the 2n places nearest to place k are all worse: it is no flank of a valley that is known.
  bool is_bottom(std::size_t k) const;
};

/// The best places, at most `count`, that are farther than `least` from those taken and from each other.
///   taken  coordinates as in `RankedPlaces`; those that are chosen are added
std::vector<std::size_t> choose_apart(const RankedPlaces&, std::vector<double>& taken, double least, std::size_t count,
                                      const std::function<bool(std::size_t)>& is_allowed);

}  // namespace topple::uncertainty
