#pragma once
/// Boxes along the axes, and which of them meet.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/linalg.h"

namespace topple::fem {

/// Along the axes; empty while low is above high.
struct ContactBox {
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  void add(const Vec3& p, double r) {
    for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], p[c] - r), high[c] = std::max(high[c], p[c] + r);
  }
  void add(const ContactBox& b) {
    for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], b.low[c]), high[c] = std::max(high[c], b.high[c]);
  }
  /// With so much room around it; empty if it is.
  ContactBox widened(double room) const {
    return is_empty() ? *this : ContactBox{low - Vec3{room, room, room}, high + Vec3{room, room, room}};
  }
  bool is_empty() const { return low.x > high.x; }
  bool meets(const ContactBox& b) const {
    return low.x <= b.high.x && b.low.x <= high.x && low.y <= b.high.y && b.low.y <= high.y && low.z <= b.high.z &&
           b.low.z <= high.z;
  }
  /// How far everything in it is at least from everything in the other.
  double calc_gap(const ContactBox& b) const {
    const Vec3 d{std::max({0.0, low.x - b.high.x, b.low.x - high.x}),
                 std::max({0.0, low.y - b.high.y, b.low.y - high.y}),
                 std::max({0.0, low.z - b.high.z, b.low.z - high.z})};
    return norm(d);
  }
  bool has(const Vec3& p, double r) const {
    return p.x >= low.x - r && p.x <= high.x + r && p.y >= low.y - r && p.y <= high.y + r && p.z >= low.z - r &&
           p.z <= high.z + r;
  }
};

/// Boxes by the cells of a grid that they reach into; what is outside of it counts to the cells at its edge.
class ContactCells {
 public:
  /// A grid over `bounds` with cells of about `edge` [m].
  ContactCells(const std::vector<ContactBox>& boxes, const ContactBox& bounds, double edge);

  /// Numbers of the boxes before box `a` that meet it, in order.
  void find_before(const std::vector<ContactBox>& boxes, std::uint32_t a, std::vector<std::uint32_t>& found) const;
  /// Numbers of the boxes that meet another one, in order.
  void find_met(const std::vector<ContactBox>& boxes, const ContactBox& other, std::vector<std::uint32_t>& found) const;

 private:
  using Range = std::array<std::array<std::uint16_t, 2>, 3>;  // first and last cell along each axis
  Range find_range(const ContactBox& box) const;
  size_t number(size_t i, size_t j, size_t k) const { return (i * counts_[1] + j) * counts_[2] + k; }
  size_t first_common(const Range& a, const Range& b) const {
    return number(std::max(a[0][0], b[0][0]), std::max(a[1][0], b[1][0]), std::max(a[2][0], b[2][0]));
  }
  template <class Body>
  void for_cells(const Range& range, const Body& body) const {
    for (size_t i = range[0][0]; i <= range[0][1]; ++i)
      for (size_t j = range[1][0]; j <= range[1][1]; ++j)
        for (size_t k = range[2][0]; k <= range[2][1]; ++k) body(number(i, j, k));
  }

  Vec3 low_, per_edge_;
  std::array<size_t, 3> counts_{};
  std::vector<Range> ranges_;           // of boxes
  std::vector<std::uint32_t> starts_;   // of the entries of a cell
  std::vector<std::uint32_t> entries_;  // boxes, in order in each cell
};

}  // namespace topple::fem
