#include "uncertainty/fan.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace topple::uncertainty {

std::vector<FanLevel> calc_fan(const Space& space, const Archive& archive, const std::vector<double>& levels,
                               int outcome) {
  std::size_t length = 0;
  for (const auto& s : archive.samples()) length = std::max(length, s.result.trajectory.size());
  std::vector<FanLevel> fan;
  for (const double alpha : levels) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Box box = make_box(space, alpha);
    FanLevel f{alpha,
               0,
               std::vector<double>(length, nan),
               std::vector<double>(length, nan),
               std::vector<int>(length, -1),
               std::vector<int>(length, -1)};
    for (int i = 0; i < static_cast<int>(archive.size()); ++i) {
      const Sample& s = archive[i];
      if (s.result.state != Result::State::Done || s.result.trajectory.empty()) continue;
      if (outcome != all_outcomes && s.result.outcome != outcome) continue;
      if (!is_in_cut(space, box, alpha, s.x)) continue;
      ++f.curves;
      for (std::size_t t = 0; t < s.result.trajectory.size(); ++t) {
        const double v = s.result.trajectory[t];
        if (!std::isfinite(v)) continue;  // none there
        if (f.at_lower[t] < 0 || v < f.lower[t]) f.lower[t] = v, f.at_lower[t] = i;
        if (f.at_upper[t] < 0 || v > f.upper[t]) f.upper[t] = v, f.at_upper[t] = i;
      }
    }
    fan.push_back(std::move(f));
  }
  return fan;
}

Evaluate with_functionals(Evaluate model, std::vector<std::function<double(std::span<const double>)>> functionals) {
  return [model = std::move(model), functionals = std::move(functionals)](std::span<const Point> batch,
                                                                          std::span<Result> out) {
    model(batch, out);
    for (auto& r : out)
      if (r.state == Result::State::Done)
        for (const auto& f : functionals) r.values.push_back(f(r.trajectory));
  };
}

}  // namespace topple::uncertainty
