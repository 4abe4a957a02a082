#pragma once
/// Outputs that are a sum of functions of a few inputs each: f = Σ gₖ(x of group k). Their bounds are looked for group
/// by group; a search over all inputs at once ends in one of as many basins as the product of those of the groups.

#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "uncertainty/archive.h"
#include "uncertainty/local_search.h"

namespace topple::uncertainty {

class GroupSearch {
 public:
  /// The corners of the support have been run, and there is no interaction.
  ///   levels     the cuts, the support first
  ///   tolerance  of sums, absolute
  GroupSearch(const Space&, Asker&, const std::vector<Region>& levels, int output, double tolerance,
              std::uint64_t seed);

  /// Runs places that tell groups apart, tests the sum with a few places of all groups at once, and runs some that are
  /// spread over each group. False: the output is no such sum, one of single inputs or of
  /// more than four, or runs failed.
  bool find();
  /// Inputs, rising.
  const std::vector<std::vector<int>>& groups() const { return groups_; }

  /// For every level and sign: the place composed of the best ones of each group that are known beside the last such
  /// place, at first beside the centre.
  std::vector<Point> compose();

  /// Where a search in a group begins.
  struct Start {
    int level;
    double sign;  // the least value of sign * output is looked for
    std::size_t group;
    Point x;  // as the place that is composed, but for the group's inputs
  };
  /// The best places of each group beside the centre, at most `count`, that are apart: bottoms first.
  std::vector<Start> list_starts(std::size_t count) const;

 private:
  /// NaN where it was not run, or failed.
  double value_at(const Point&) const;
  void join_by_corners();
  void join_by_pairs();
  void list_groups();
  void spread();
  bool is_sum() const;
  /// Samples of a cut that are as `base` is but for a group's inputs, the best ones that are apart.
  std::vector<Point> list_best(const Point& base, std::size_t group, int level, double sign, std::size_t count) const;
  /// Of the levels that have a width, with both signs.
  template <class Function>
  void each_side(Function) const;

  Asker& asker_;
  const std::vector<Region>& levels_;
  int output_;
  double tolerance_;
  std::uint64_t seed_;
  Point centre_;
  DisjointSets together_;  // the support's axes
  bool has_failed_ = false;
  std::vector<std::vector<int>> groups_;
  std::vector<Point> composed_;  // of each level and sign
};

}  // namespace topple::uncertainty
