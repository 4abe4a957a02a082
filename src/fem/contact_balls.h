#pragma once
/// Balls by the cells of a grid, and which of them may touch each other, many at a time in SIMD lanes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "base/linalg.h"
#include "base/team.h"
#include "fem/contact_cells.h"
#include "fem/particle.h"

namespace topple::fem {

namespace lanes {

/// Balls side by side. B balls.
struct Balls {
  AlignedVector<double> x, y, z, reach;  // filled up to whole vectors (B)
  std::vector<std::uint32_t> number;     // (B)
  void resize(size_t count);
  void set(size_t at, const Vec3& p, double reach, std::uint32_t number);
};

/// Places [first, last) in Balls.
using BallRange = std::array<std::uint32_t, 2>;

/// Appends the numbers of those in ranges that are apart from a ball by less than both reaches.
void find_close(const Balls&, std::span<const BallRange>, const Vec3& p, double reach,
                std::vector<std::uint32_t>& found);
/// The same of those no further from a box than they reach, along each axis.
void find_in_box(const Balls&, std::span<const BallRange>, const ContactBox&, std::vector<std::uint32_t>& found);
bool has_in_box(const Balls&, std::span<const BallRange>, const ContactBox&);

}  // namespace lanes

/// All entries of some lists in order; numbers that stand first are below `count`, and each has few.
std::vector<std::array<std::uint32_t, 2>> sort_pairs(
    const std::vector<std::vector<std::array<std::uint32_t, 2>>>& lists, size_t count);

/// Balls in cells; those few that reach much further than the others beside them, so that the others need not look as
/// far.
class BallCells {
 public:
  /// `reach`: how far from its middle each may touch another [m] (B).
  BallCells(std::span<const Particle>, std::span<const double> reach, Team&);

  /// Pairs of balls that are apart by less than both reaches, the later one first, each once, in tasks of which
  /// there are `tasks()`.
  size_t tasks() const { return (balls_.number.size() + kRun - 1) / kRun + 1; }
  void find_pairs(size_t task, std::vector<ParticlePair>& found) const;
  /// Numbers of those no further from a box than they reach, along each axis.
  void find_in_box(const ContactBox&, std::vector<std::uint32_t>& found) const;
  bool has_in_box(const ContactBox&) const;

 private:
  static constexpr size_t kRun = 256;  // balls of a task
  std::array<size_t, 3> find_cell(const Vec3& p) const;
  /// Those in cells that a box reaches into.
  void find_ranges(const Vec3& low, const Vec3& high, std::vector<lanes::BallRange>& ranges) const;
  size_t number(size_t i, size_t j, size_t k) const { return (i * counts_[1] + j) * counts_[2] + k; }
  /// Calls body(balls, ranges) for those in cells, then for those beside them, until it returns true.
  template <class Body>
  bool for_box(const ContactBox&, const Body& body) const;

  double most_reach_ = 0;  // of those in cells
  Vec3 low_, per_edge_;
  std::array<size_t, 3> counts_{};
  std::vector<std::uint32_t> starts_;  // of cells
  lanes::Balls balls_, far_;           // by cells; beside them
};

}  // namespace topple::fem
