#include "study/fans.h"

#include <algorithm>
#include <cmath>

#include "base/unit.h"

namespace topple::study {

std::vector<Curve> list_curves(const Problem& p, const uncertainty::Archive& archive) {
  if (!p.curves.empty()) return p.curves;
  std::size_t length = 0;
  for (const auto& s : archive.samples()) length = std::max(length, s.result.trajectory.size());
  if (length == 0) return {};
  Curve c{"trajectory", "", 1, "number", "", {}, false};
  for (std::size_t k = 0; k < length; ++k) c.at.push_back(static_cast<double>(k));
  return {c};
}

std::vector<CurveFan> calc_fans(const Problem& p, const StudyResult& r) {
  const std::vector<Curve> curves = list_curves(p, r.alpha.archive);
  std::vector<CurveFan> fans;
  if (curves.empty()) return fans;
  std::vector<double> levels;
  if (!r.alpha.outputs.empty())
    for (const auto& l : r.alpha.outputs.front().levels) levels.push_back(l.alpha);
  else if (!r.alpha.coverage.empty())  // those that are asked for may lack 0 and 1
    for (const auto& c : r.alpha.coverage) levels.push_back(c.alpha);
  else
    levels = make_alpha_options(p).levels;
  std::vector<int> outcomes = {uncertainty::all_outcomes};
  if (count_outcomes(r.alpha) > 1)
    for (const auto& c : r.alpha.classes)
      if (c.outcome != uncertainty::failed_outcome) outcomes.push_back(c.outcome);
  for (const int outcome : outcomes) {
    const std::vector<uncertainty::FanLevel> whole = uncertainty::calc_fan(p.space, r.alpha.archive, levels, outcome);
    std::size_t begin = 0;
    for (std::size_t c = 0; c < curves.size(); ++c) {
      CurveFan fan{static_cast<int>(c), outcome, {}};
      for (const uncertainty::FanLevel& w : whole) {
        uncertainty::FanLevel part{w.alpha, w.curves, {}, {}, {}, {}};
        const std::size_t end = std::min(begin + curves[c].at.size(), w.lower.size());
        for (std::size_t k = std::min(begin, end); k < end; ++k) {
          part.lower.push_back(w.lower[k]);
          part.upper.push_back(w.upper[k]);
          part.at_lower.push_back(w.at_lower[k]);
          part.at_upper.push_back(w.at_upper[k]);
        }
        fan.levels.push_back(std::move(part));
      }
      fans.push_back(std::move(fan));
      begin += curves[c].at.size();
    }
  }
  return fans;
}

std::vector<DebrisLevel> calc_debris(const Curve& curve, const CurveFan& fan) {
  using Corner = std::array<double, 2>;
  std::vector<DebrisLevel> out;
  for (const uncertainty::FanLevel& l : fan.levels) {
    DebrisLevel d{l.alpha, l.curves, {}};
    double size = 0;
    for (const double h : l.upper)
      if (std::isfinite(h)) size = std::max(size, std::abs(h));
    std::vector<Corner> corners;
    // three directions at least bound a region that spans less than this box
    const double far = 1e3 * (size + 1);
    if (l.curves > 0) corners = {{-far, -far}, {far, -far}, {far, far}, {-far, far}};
    for (std::size_t k = 0; k < l.upper.size() && k < curve.at.size() && !corners.empty(); ++k) {
      const double h = l.upper[k], angle = curve.at[k] * unit::deg;
      if (!std::isfinite(h)) continue;
      const auto beyond = [&](const Corner& p) { return p[0] * std::cos(angle) + p[1] * std::sin(angle) - h; };
      std::vector<Corner> kept;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Corner &a = corners[i], &b = corners[(i + 1) % corners.size()];
        const double da = beyond(a), db = beyond(b);
        if (da <= 0) kept.push_back(a);
        if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
          const double t = da / (da - db);
          kept.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
        }
      }
      corners = std::move(kept);
    }
    d.corners = std::move(corners);
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace topple::study
