#pragma once
/// Sets of numbers that are joined step by step.

#include <cstddef>
#include <numeric>
#include <vector>

namespace topple {

/// Union-find with path halving (Tarjan & van Leeuwen, J. ACM 31 (1984) 245).
class DisjointSets {
 public:
  DisjointSets() = default;
  /// Each of 0 to `count` - 1 alone.
  explicit DisjointSets(std::size_t count) { reset(count); }
  void reset(std::size_t count) {
    parent_.resize(count);
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// The one that leads the set of `i`.
  int find(int i) {
    while (parent_[static_cast<std::size_t>(i)] != i) {
      parent_[static_cast<std::size_t>(i)] = parent_[static_cast<std::size_t>(parent_[static_cast<std::size_t>(i)])];
      i = parent_[static_cast<std::size_t>(i)];
    }
    return i;
  }

  /// The set of `i` becomes part of that of `to`, whose leader stays.
  void join(int i, int to) {
    const int root = find(i);
    parent_[static_cast<std::size_t>(root)] = find(to);
  }

  /// The smaller leader stays, so that the order of joins does not matter.
  void join_under_lower(int a, int b) {
    const int root_a = find(a), root_b = find(b);
    root_a < root_b ? join(root_b, root_a) : join(root_a, root_b);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace topple
