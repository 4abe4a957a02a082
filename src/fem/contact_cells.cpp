#include "fem/contact_cells.h"

#include <cmath>

namespace topple::fem {

ContactCells::ContactCells(const std::vector<ContactBox>& boxes, const ContactBox& bounds, double edge)
    : low_(bounds.low) {
  constexpr double kMost = 64;  // along an axis
  for (int c = 0; c < 3; ++c) {
    const double length = std::max(0.0, bounds.high[c] - bounds.low[c]);
    const double count = std::clamp(std::ceil(length / edge), 1.0, kMost);
    counts_[static_cast<size_t>(c)] = static_cast<size_t>(count), per_edge_[c] = count / std::max(length, edge);
  }
  ranges_.reserve(boxes.size());
  starts_.assign(counts_[0] * counts_[1] * counts_[2] + 1, 0);
  for (const ContactBox& box : boxes) {
    ranges_.push_back(find_range(box));
    if (!box.is_empty()) for_cells(ranges_.back(), [&](size_t cell) { ++starts_[cell + 1]; });
  }
  for (size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  entries_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].is_empty())
      for_cells(ranges_[i], [&](size_t cell) { entries_[next[cell]++] = static_cast<std::uint32_t>(i); });
}

void ContactCells::find_before(const std::vector<ContactBox>& boxes, std::uint32_t a,
                               std::vector<std::uint32_t>& found) const {
  found.clear();
  if (boxes[a].is_empty()) return;
  for_cells(ranges_[a], [&](size_t cell) {
    for (std::uint32_t i = starts_[cell]; i < starts_[cell + 1] && entries_[i] < a; ++i) {
      const std::uint32_t b = entries_[i];
      // of the cells that both reach into the first one counts
      if (first_common(ranges_[a], ranges_[b]) == cell && boxes[a].meets(boxes[b])) found.push_back(b);
    }
  });
  std::sort(found.begin(), found.end());
}

void ContactCells::find_met(const std::vector<ContactBox>& boxes, const ContactBox& other,
                            std::vector<std::uint32_t>& found) const {
  found.clear();
  if (other.is_empty()) return;
  const Range range = find_range(other);
  for_cells(range, [&](size_t cell) {
    for (std::uint32_t i = starts_[cell]; i < starts_[cell + 1]; ++i) {
      const std::uint32_t b = entries_[i];
      if (first_common(range, ranges_[b]) == cell && other.meets(boxes[b])) found.push_back(b);
    }
  });
  std::sort(found.begin(), found.end());
}

ContactCells::Range ContactCells::find_range(const ContactBox& box) const {
  Range range{};
  for (int c = 0; c < 3; ++c) {
    const double last = static_cast<double>(counts_[static_cast<size_t>(c)] - 1);
    const auto cell = [&](double x) {
      // a number that is none counts to the last
      return static_cast<std::uint16_t>(std::max(0.0, std::min(last, (x - low_[c]) * per_edge_[c])));
    };
    range[static_cast<size_t>(c)] = {cell(box.low[c]), cell(box.high[c])};
  }
  return range;
}

}  // namespace topple::fem
