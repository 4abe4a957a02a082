#include "uncertainty/levels.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace topple::uncertainty {

std::vector<double> check_levels(std::vector<double> levels) {
  for (const double a : levels)
    if (!(a >= 0 && a <= 1)) throw InputError("E807", fmt::format("level alpha = {}; levels lie between 0 and 1", a));
  levels.push_back(0);
  levels.push_back(1);
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  return levels;
}

int count_levels(const Space& space, const std::vector<double>& levels, const std::vector<Box>& boxes, const Point& x) {
  int count = 0;
  while (count < static_cast<int>(levels.size()) && is_in_cut(space, boxes[count], levels[count], x)) ++count;
  return count;
}

}  // namespace topple::uncertainty
