// Compiled once for each instruction set (Highway's foreach_target).
#include "fem/contact_balls.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/contact_balls.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace topple::fem::lanes {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;

/// Calls body(bits, first) for all in ranges, eight or fewer at a time, until it returns true; bits of those for which
/// the test of places from the first on holds.
template <class Test, class Body>
HWY_INLINE bool find_first(std::span<const BallRange> ranges, const Test& test, const Body& body) {
  const D d;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  for (const auto& [first, last] : ranges)
    for (std::uint32_t i = first; i < last; i += lanes) {
      std::uint8_t mask[8] = {};
      hn::StoreMaskBits(d, test(i), mask);
      unsigned bits = mask[0];
      if (last - i < lanes) bits &= (1U << (last - i)) - 1;
      if (bits != 0 && body(bits, i)) return true;
    }
  return false;
}
HWY_INLINE bool append(const Balls& balls, unsigned bits, std::uint32_t first, std::vector<std::uint32_t>& found) {
  for (; bits != 0; bits &= bits - 1)
    found.push_back(balls.number[first + static_cast<std::uint32_t>(std::countr_zero(bits))]);
  return false;
}

void find_close(const Balls& balls, std::span<const BallRange> ranges, const Vec3& p, double reach,
                std::vector<std::uint32_t>& found) {
  const D d;
  const auto px = hn::Set(d, p.x), py = hn::Set(d, p.y), pz = hn::Set(d, p.z), r = hn::Set(d, reach);
  const auto is_close = [&](size_t i) HWY_ATTR {
    const auto x = hn::Sub(hn::LoadU(d, balls.x.data() + i), px), y = hn::Sub(hn::LoadU(d, balls.y.data() + i), py);
    const auto z = hn::Sub(hn::LoadU(d, balls.z.data() + i), pz),
               both = hn::Add(hn::LoadU(d, balls.reach.data() + i), r);
    return hn::Lt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)), hn::Mul(both, both));
  };
  find_first(ranges, is_close, [&](unsigned bits, std::uint32_t first) { return append(balls, bits, first, found); });
}

template <class Body>
HWY_INLINE bool find_first_in_box(const Balls& balls, std::span<const BallRange> ranges, const ContactBox& box,
                                  const Body& body) {
  const D d;
  const double* axes[] = {balls.x.data(), balls.y.data(), balls.z.data()};
  hn::Vec<D> low[3], high[3];
  for (int c = 0; c < 3; ++c) low[c] = hn::Set(d, box.low[c]), high[c] = hn::Set(d, box.high[c]);
  const auto is_near = [&](size_t i) HWY_ATTR {
    const auto reach = hn::LoadU(d, balls.reach.data() + i);
    const auto is_in = [&](size_t c) HWY_ATTR {
      const auto x = hn::LoadU(d, axes[c] + i);
      return hn::And(hn::Ge(hn::Add(x, reach), low[c]), hn::Le(hn::Sub(x, reach), high[c]));
    };
    return hn::And(hn::And(is_in(0), is_in(1)), is_in(2));
  };
  return find_first(ranges, is_near, body);
}
void find_in_box(const Balls& balls, std::span<const BallRange> ranges, const ContactBox& box,
                 std::vector<std::uint32_t>& found) {
  find_first_in_box(balls, ranges, box,
                    [&](unsigned bits, std::uint32_t first) { return append(balls, bits, first, found); });
}
bool has_in_box(const Balls& balls, std::span<const BallRange> ranges, const ContactBox& box) {
  return find_first_in_box(balls, ranges, box, [](unsigned, std::uint32_t) { return true; });
}

}  // namespace HWY_NAMESPACE
}  // namespace topple::fem::lanes
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::fem {

namespace lanes {

HWY_EXPORT(find_close);
HWY_EXPORT(find_in_box);
HWY_EXPORT(has_in_box);

void Balls::resize(size_t count) {
  constexpr size_t kBeyond = 8;
  for (auto* of : {&x, &y, &z, &reach}) of->assign(count + kBeyond, 0);
  number.resize(count);
}
void Balls::set(size_t at, const Vec3& p, double reach_of, std::uint32_t number_of) {
  x[at] = p.x, y[at] = p.y, z[at] = p.z, reach[at] = reach_of, number[at] = number_of;
}

void find_close(const Balls& balls, std::span<const BallRange> ranges, const Vec3& p, double reach,
                std::vector<std::uint32_t>& found) {
  HWY_DYNAMIC_DISPATCH(find_close)(balls, ranges, p, reach, found);
}
void find_in_box(const Balls& balls, std::span<const BallRange> ranges, const ContactBox& box,
                 std::vector<std::uint32_t>& found) {
  HWY_DYNAMIC_DISPATCH(find_in_box)(balls, ranges, box, found);
}
bool has_in_box(const Balls& balls, std::span<const BallRange> ranges, const ContactBox& box) {
  return HWY_DYNAMIC_DISPATCH(has_in_box)(balls, ranges, box);
}

}  // namespace lanes

BallCells::BallCells(std::span<const Particle> particles, std::span<const double> reach, Team& team) {
  const size_t count = particles.size();
  if (count == 0) return;
  constexpr size_t kNear = 995;  // of a thousand
  std::vector<double> sorted(reach.begin(), reach.end());
  const auto most = sorted.begin() + static_cast<std::ptrdiff_t>((count - 1) * kNear / 1000);
  std::nth_element(sorted.begin(), most, sorted.end());
  most_reach_ = *most;
  const auto is_far = [&](size_t i) { return !(reach[i] <= most_reach_); };
  Vec3 high = low_ = particles[0].p;
  size_t far = 0;
  for (size_t i = 0; i < count; ++i) {
    if (is_far(i)) ++far;
    for (int c = 0; c < 3; ++c)
      low_[c] = std::min(low_[c], particles[i].p[c]), high[c] = std::max(high[c], particles[i].p[c]);
  }
  // cells as wide as two of them reach, unless those would be many more than balls
  constexpr double kCellsPerBall = 8;
  double edge = std::max(2 * most_reach_, 1e-300), cells = 0;
  for (;; edge *= 1.25) {
    cells = 1;
    for (int c = 0; c < 3; ++c) cells *= std::floor((high[c] - low_[c]) / edge) + 1;
    if (!(cells > kCellsPerBall * static_cast<double>(count) + 8)) break;
  }
  for (int c = 0; c < 3; ++c) {
    counts_[static_cast<size_t>(c)] = static_cast<size_t>(std::max(1.0, std::floor((high[c] - low_[c]) / edge) + 1));
    per_edge_[c] = 1 / edge;
  }
  std::vector<std::uint32_t> cell_of(count);
  starts_.assign(counts_[0] * counts_[1] * counts_[2] + 1, 0);
  constexpr size_t kShare = 1024;
  team.run((count + kShare - 1) / kShare, [&](size_t share) {
    for (size_t i = share * kShare; i < std::min(count, (share + 1) * kShare); ++i) {
      const auto [x, y, z] = find_cell(particles[i].p);
      cell_of[i] = static_cast<std::uint32_t>(number(x, y, z));
    }
  });
  for (size_t i = 0; i < count; ++i)
    if (!is_far(i)) ++starts_[cell_of[i] + 1];
  for (size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  balls_.resize(count - far), far_.resize(far);
  size_t beside = 0;
  for (size_t i = 0; i < count; ++i)
    (is_far(i) ? far_ : balls_)
        .set(is_far(i) ? beside++ : next[cell_of[i]]++, particles[i].p, reach[i], static_cast<std::uint32_t>(i));
}

std::array<size_t, 3> BallCells::find_cell(const Vec3& p) const {
  std::array<size_t, 3> cell{};
  for (int c = 0; c < 3; ++c) {
    const double last = static_cast<double>(counts_[static_cast<size_t>(c)] - 1);
    // a number that is none counts to the last
    cell[static_cast<size_t>(c)] = static_cast<size_t>(std::max(0.0, std::min(last, (p[c] - low_[c]) * per_edge_[c])));
  }
  return cell;
}

void BallCells::find_ranges(const Vec3& from, const Vec3& to, std::vector<lanes::BallRange>& ranges) const {
  ranges.clear();
  const auto low = find_cell(from), high = find_cell(to);
  for (size_t i = low[0]; i <= high[0]; ++i)
    for (size_t j = low[1]; j <= high[1]; ++j) {
      const lanes::BallRange range{starts_[number(i, j, low[2])], starts_[number(i, j, high[2]) + 1]};
      if (range[0] < range[1]) ranges.push_back(range);
    }
}

template <class Body>
bool BallCells::for_box(const ContactBox& box, const Body& body) const {
  static thread_local std::vector<lanes::BallRange> ranges;
  if (box.is_empty() || starts_.empty()) return false;
  const ContactBox wide = box.widened(most_reach_);
  find_ranges(wide.low, wide.high, ranges);
  const lanes::BallRange all{0, static_cast<std::uint32_t>(far_.number.size())};
  return body(balls_, ranges) || body(far_, std::span(&all, 1));
}

void BallCells::find_pairs(size_t task, std::vector<ParticlePair>& found) const {
  static thread_local std::vector<lanes::BallRange> ranges;
  static thread_local std::vector<std::uint32_t> close;
  const auto add = [&](std::uint32_t a) {
    for (const std::uint32_t b : close) found.push_back({std::max(a, b), std::min(a, b)});
  };
  const bool is_last = task + 1 == tasks();
  const lanes::Balls& of = is_last ? far_ : balls_;
  const size_t first = is_last ? 0 : task * kRun,
               last = is_last ? of.number.size() : std::min(of.number.size(), first + kRun);
  for (size_t i = first; i < last; ++i) {
    const Vec3 p{of.x[i], of.y[i], of.z[i]};
    const double reach = of.reach[i], far = reach + most_reach_;
    close.clear();
    find_ranges(p - Vec3{far, far, far}, p + Vec3{far, far, far}, ranges);
    if (!is_last) {
      // those behind it in cells
      const auto place = static_cast<std::uint32_t>(i + 1);
      std::erase_if(ranges, [&](const lanes::BallRange& range) { return range[1] <= place; });
      for (lanes::BallRange& range : ranges) range[0] = std::max(range[0], place);
    }
    lanes::find_close(balls_, ranges, p, reach, close);
    if (is_last) {
      const lanes::BallRange behind{static_cast<std::uint32_t>(i + 1), static_cast<std::uint32_t>(last)};
      lanes::find_close(far_, std::span(&behind, 1), p, reach, close);
    }
    add(of.number[i]);
  }
}

std::vector<std::array<std::uint32_t, 2>> sort_pairs(
    const std::vector<std::vector<std::array<std::uint32_t, 2>>>& lists, size_t count) {
  std::vector<std::uint32_t> starts(count + 1, 0);
  for (const auto& list : lists)
    for (const auto& pair : list) ++starts[pair[0] + 1];
  for (size_t i = 0; i < count; ++i) starts[i + 1] += starts[i];
  std::vector<std::array<std::uint32_t, 2>> sorted(starts.back());
  std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
  for (const auto& list : lists)
    for (const auto& pair : list) sorted[next[pair[0]]++] = pair;
  for (size_t i = 0; i < count; ++i)
    if (starts[i + 1] > starts[i] + 1) std::sort(sorted.begin() + starts[i], sorted.begin() + starts[i + 1]);
  return sorted;
}

void BallCells::find_in_box(const ContactBox& box, std::vector<std::uint32_t>& found) const {
  found.clear();
  for_box(box, [&](const lanes::Balls& balls, std::span<const lanes::BallRange> ranges) {
    lanes::find_in_box(balls, ranges, box, found);
    return false;
  });
}
bool BallCells::has_in_box(const ContactBox& box) const {
  return for_box(box, [&](const lanes::Balls& balls, std::span<const lanes::BallRange> ranges) {
    return lanes::has_in_box(balls, ranges, box);
  });
}

}  // namespace topple::fem
#endif
