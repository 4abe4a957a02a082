#include "uncertainty/wall.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "uncertainty/linear.h"

namespace topple::uncertainty {
namespace {

constexpr int sections = 4, rounds = 4;

}  // namespace

WallProbe::WallProbe(const Box& box, std::vector<double> scale, std::vector<int> axes, Point inside, Point outside,
                     double radius, Allow allow)
    : box_(box),
      scale_(std::move(scale)),
      axes_(std::move(axes)),
      anchor_(std::move(inside)),
      outside_(std::move(outside)),
      radius_(radius),
      allow_(std::move(allow)) {
  double length = 0;
  for (const int i : axes_) {
    direction_.push_back((outside_[i] - anchor_[i]) / scale_[i]);
    length += direction_.back() * direction_.back();
  }
  length = std::sqrt(length);
  if (!(length > 0)) return;
  for (double& d : direction_) d /= length;
  // places further inside, from which the rays may start
  for (const double part : {0.25, 0.5, 1.0}) {
    Point x = anchor_;
    for (std::size_t k = 0; k < axes_.size(); ++k) x[axes_[k]] -= part * radius_ * direction_[k] * scale_[axes_[k]];
    x = clip(box_, std::move(x));
    if (!is_allowed(x)) break;
    pending_.push_back(std::move(x));
  }
  if (pending_.empty()) tell({});
}

Point WallProbe::blend(const Point& to, double t) const {
  Point x = anchor_;
  for (const int i : axes_) x[i] += t * (to[i] - anchor_[i]);
  return clip(box_, std::move(x));
}

void WallProbe::ask_sections() {
  pending_.clear();
  for (auto& r : rays_) {
    r.asked = 0;
    for (int k = 1; r.crosses && k <= (round_ == 0 ? sections : sections - 1); ++k) {
      Point x = blend(r.to, r.in + (r.out - r.in) * k / sections);
      if (!is_allowed(x)) break;
      pending_.push_back(std::move(x));
      ++r.asked;
    }
    if (round_ == 0 && r.asked == 0) r.crosses = false;
  }
}

void WallProbe::tell(const std::vector<bool>& is_inside) {
  if (round_ < 0) {
    for (std::size_t k = 0; k < pending_.size() && is_inside[k]; ++k) anchor_ = pending_[k];
    // one ray past the known outside, one more per axis, turned towards it
    for (int turn = -1; turn < static_cast<int>(axes_.size()); ++turn) {
      Ray r{outside_};
      for (std::size_t k = 0; k < axes_.size(); ++k) {
        double step = direction_[k];
        if (turn >= 0) {
          const double along = direction_[turn];
          step += (static_cast<int>(k) == turn ? 1.0 : 0.0) - along * direction_[k];
        }
        r.to[axes_[k]] += radius_ * step * scale_[axes_[k]];
      }
      r.to = clip(box_, std::move(r.to));
      if (!is_allowed(r.to)) {
        double in = 0, out = 1;
        for (int k = 0; k < 40; ++k) (is_allowed(blend(r.to, 0.5 * (in + out))) ? in : out) = 0.5 * (in + out);
        r.to = blend(r.to, in);
      }
      rays_.push_back(std::move(r));
    }
  } else {
    std::size_t next = 0;
    for (auto& r : rays_) {
      if (!r.crosses) continue;
      int k = 1;
      while (k <= r.asked && is_inside[next + k - 1]) ++k;
      next += r.asked;
      if (k > r.asked && round_ == 0) r.crosses = false;
      const double width = r.out - r.in, from = r.in;
      r.in = from + width * (k - 1) / sections;
      r.out = from + width * k / sections;
    }
  }
  if (++round_ < rounds)
    ask_sections();
  else
    pending_.clear();
  if (pending_.empty()) fit();
}

/// Least squares for ν·p = 1 over the crossings p, seen from the anchor.
void WallProbe::fit() {
  const std::size_t n = axes_.size();
  std::vector<Point> A(n, Point(n, 0.0));
  Point nu(n, 0.0);
  int count = 0;
  double trace = 0;
  for (const auto& r : rays_) {
    if (!r.crosses) continue;
    ++count;
    const Point x = blend(r.to, 0.5 * (r.in + r.out));
    Point p;
    for (const int i : axes_) p.push_back((x[i] - anchor_[i]) / scale_[i]);
    for (std::size_t i = 0; i < n; ++i) {
      nu[i] += p[i];
      for (std::size_t j = 0; j < n; ++j) A[i][j] += p[i] * p[j];
      trace += p[i] * p[i];
    }
  }
  if (count == 0) return;
  for (std::size_t i = 0; i < n; ++i) A[i][i] += 1e-10 * trace;
  if (!solve(A, nu)) return;
  double length = 0;
  for (const double v : nu) length += v * v;
  length = std::sqrt(length);
  if (!(length > 0) || !std::isfinite(length)) return;
  for (double& v : nu) v /= length;
  normal_ = std::move(nu);
  offset_ = 1 / length;
}

double WallProbe::calc_distance(const Point& x) const {
  double along = 0;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    along += normal_[k] * (x[axes_[k]] - anchor_[axes_[k]]) / scale_[axes_[k]];
  return offset_ - along;
}

}  // namespace topple::uncertainty
