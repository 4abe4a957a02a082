#include "uncertainty/wall.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "uncertainty/linear.h"

namespace topple::uncertainty {
namespace {

constexpr int sections = 2, rounds = 8;

}  // namespace

WallProbe::WallProbe(const Box& box, std::vector<double> scale, std::vector<int> axes, Point inside, Point outside,
                     double radius, Allow allow, Project project, int most_nearer)
    : box_(box),
      scale_(std::move(scale)),
      axes_(std::move(axes)),
      anchor_(std::move(inside)),
      outside_(std::move(outside)),
      radius_(radius),
      allow_(std::move(allow)),
      project_(std::move(project)),
      most_nearer_(most_nearer) {
  if (!(aim(outside_) > 0)) return;
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

/// Turns the rays from the anchor towards a place; gives its distance.
double WallProbe::aim(const Point& to) {
  direction_.clear();
  double length = 0;
  for (const int i : axes_) {
    direction_.push_back((to[i] - anchor_[i]) / scale_[i]);
    length += direction_.back() * direction_.back();
  }
  length = std::sqrt(length);
  if (length > 0)
    for (double& d : direction_) d /= length;
  return length;
}

/// The one towards what is aimed at, and one turned to each axis.
void WallProbe::make_rays() {
  rays_.clear();
  for (int axis = -1; axis < static_cast<int>(axes_.size()); ++axis) rays_.push_back(make_ray(axis, false));
}

Point WallProbe::blend(const Point& to, double t) const {
  Point x = anchor_;
  for (const int i : axes_) x[i] += t * (to[i] - anchor_[i]);
  return clip(box_, std::move(x));
}

/// Past the known outside, or there turned to or from an axis.
WallProbe::Ray WallProbe::make_ray(int axis, bool is_mirrored) const {
  Ray r{outside_};
  r.axis = axis, r.is_mirrored = is_mirrored;
  std::vector<double> turn(axes_.size(), 0.0);
  double square = 0;
  for (std::size_t k = 0; k < axes_.size() && axis >= 0; ++k) {
    turn[k] = (is_mirrored ? -1 : 1) * ((static_cast<int>(k) == axis ? 1.0 : 0.0) - direction_[axis] * direction_[k]);
    square += turn[k] * turn[k];
  }
  for (std::size_t k = 0; k < axes_.size(); ++k)
    r.to[axes_[k]] += radius_ * (direction_[k] + turn[k]) * scale_[axes_[k]];
  r.to = clip(box_, std::move(r.to));
  // at an end of the box the other way tells more
  double turned = 0;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    turned += turn[k] * ((r.to[axes_[k]] - outside_[axes_[k]]) / scale_[axes_[k]] - radius_ * direction_[k]);
  if (axis >= 0 && !is_mirrored && turned < 0.5 * radius_ * square) return make_ray(axis, true);
  if (project_ && !is_allowed(r.to)) r.to = project_(anchor_, r.to);
  if (!is_allowed(r.to)) {
    double in = 0, out = 1;
    for (int k = 0; k < 40; ++k) (is_allowed(blend(r.to, 0.5 * (in + out))) ? in : out) = 0.5 * (in + out);
    r.to = blend(r.to, in);
  }
  return r;
}

void WallProbe::ask_sections() {
  pending_.clear();
  for (auto& r : rays_) {
    r.asked = 0;
    if (!r.crosses || r.round >= rounds) continue;
    for (int k = 1; k <= (r.round == 0 ? sections : sections - 1); ++k) {
      Point x = blend(r.to, r.in + (r.out - r.in) * k / sections);
      if (!is_allowed(x)) break;
      pending_.push_back(std::move(x));
      ++r.asked;
    }
    if (r.round == 0 && r.asked == 0) r.crosses = false;
  }
}

void WallProbe::tell(const std::vector<bool>& is_inside) {
  if (!has_anchor_) {
    has_anchor_ = true;
    for (std::size_t k = 0; k < pending_.size() && is_inside[k]; ++k) anchor_ = pending_[k];
    make_rays();
  } else {
    std::size_t next = 0;
    for (auto& r : rays_) {
      if (!r.crosses || r.round >= rounds) continue;
      int k = 1;
      while (k <= r.asked && is_inside[next + k - 1]) ++k;
      next += r.asked;
      if (k > r.asked && r.round == 0) r.crosses = false;
      const double width = r.out - r.in, from = r.in;
      r.in = from + width * (k - 1) / sections;
      r.out = from + width * k / sections;
      ++r.round;
    }
  }
  ask_sections();
  // a plane that is not met this way is met the other way
  if (std::any_of(rays_.begin(), rays_.end(),
                  [](const Ray& r) { return !r.crosses && r.axis >= 0 && !r.is_mirrored; })) {
    for (auto& r : rays_)
      if (!r.crosses && r.axis >= 0 && !r.is_mirrored) r = make_ray(r.axis, true);
    ask_sections();
  }
  if (!pending_.empty()) return;
  fit();
  if (is_bent()) ask_nearer();
}

/// Whether the crossings miss the plane by more than they are known: there is an edge between them, or they are too
/// far from each other for a tangent.
bool WallProbe::is_bent() const {
  if (!found() || nearer_ >= most_nearer_ || !rays_.front().crosses) return false;
  return std::any_of(rays_.begin(), rays_.end(), [this](const Ray& r) {
    if (!r.crosses) return false;
    double square = 0;
    for (const int i : axes_) square += std::pow((r.to[i] - anchor_[i]) / scale_[i], 2);
    return std::abs(calc_distance(blend(r.to, 0.5 * (r.in + r.out)))) > 1.5 * std::sqrt(square) * (r.out - r.in);
  });
}

/// The same around the crossing of the ray that was not turned.
void WallProbe::ask_nearer() {
  ++nearer_;
  const Ray middle = rays_.front();
  const double length = aim(middle.to);
  radius_ *= 0.125;
  outside_ = blend(middle.to, middle.out);
  anchor_ = blend(middle.to, std::max(0.0, middle.in - radius_ / length));
  normal_.clear();
  make_rays();
  ask_sections();
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
