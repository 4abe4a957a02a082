#pragma once
/// The largest box around a point that holds none of given other points (docs/theory/uncertainty.md, section 7).

#include <cstdint>
#include <utility>
#include <vector>

#include "uncertainty/space.h"

namespace topple::uncertainty {

/// Of points to be kept out of boxes around `seed`, those that count: another one is dropped if it lies between the
/// seed and a point on every axis, because a box that holds the farther one holds the nearer one too.
class Front {
 public:
  explicit Front(Point seed) : seed_(std::move(seed)) {}
  void add(const Point&);
  const Point& seed() const { return seed_; }
  const std::vector<Point>& points() const { return points_; }

 private:
  bool is_behind(const Point& far, const Point& near) const;
  Point seed_;
  std::vector<Point> points_;
};

/// A box inside `outer` that holds the front's seed and keeps each of its points out by at least `margin` (part of the
/// width of `outer`) on some axis, as large as is found: greedy cuts from several random orders, then faces pushed out
/// against each other until the volume no longer grows. Exact in one dimension; a local optimum in more. If `seed`
/// itself is within the margin of a bad point on all axes, the box is the seed alone.
Box find_largest_box(const Box& outer, const Front&, double margin, int starts, std::uint64_t random_seed);

}  // namespace topple::uncertainty
