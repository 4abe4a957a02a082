#include "uncertainty/tangent.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace topple::uncertainty {

std::vector<HalfSpace> find_tangents(const Space& space, double alpha, const Point& base, const std::vector<int>& axes,
                                     const std::vector<double>& scale, const std::vector<double>& u) {
  constexpr double step = 1e-6;  // of the support's width
  const std::size_t n = axes.size();
  Point x = base;
  for (std::size_t k = 0; k < n; ++k) x[axes[k]] += u[k] * scale[axes[k]];
  std::vector<HalfSpace> list;
  const auto add = [&](const std::function<double(const Point&)>& g) {
    const double here = g(x);
    HalfSpace h;
    double square = 0;
    for (std::size_t k = 0; k < n; ++k) {
      Point y = x;
      y[axes[k]] = x[axes[k]] + step * scale[axes[k]];
      const double above = g(y);
      y[axes[k]] = x[axes[k]] - step * scale[axes[k]];
      const double below = g(y);
      // one side may have no value
      const double slope = std::isfinite(above) && std::isfinite(below) ? (above - below) / (2 * step)
                           : std::isfinite(above)                       ? (above - here) / step
                                                                        : (here - below) / step;
      h.a.push_back(slope);
      h.b += slope * u[k];
      square += slope * slope;
    }
    h.b -= here;
    if (!(square > 0) || !std::isfinite(square) || !std::isfinite(h.b)) return;
    const double length = std::sqrt(square);
    for (double& a : h.a) a /= length;
    h.b /= length;
    list.push_back(std::move(h));
  };
  for (const auto& g : space.constraints) add(g);
  if (space.joint) add([&](const Point& y) { return alpha - space.joint(y); });
  return list;
}

std::vector<double> project(const std::vector<HalfSpace>& list, const std::vector<double>& lower,
                            const std::vector<double>& upper, const std::vector<double>& target) {
  const std::size_t n = target.size();
  std::vector<double> u = target, kept(n, 0.0), multipliers(list.size(), 0.0);
  for (int sweep = 0; sweep < 400; ++sweep) {
    double largest = 0;
    const std::vector<double> before = u;
    for (std::size_t j = 0; j < list.size(); ++j) {
      const HalfSpace& h = list[j];
      double beyond = multipliers[j] - h.b;
      for (std::size_t k = 0; k < n; ++k) beyond += h.a[k] * u[k];
      const double now = std::max(0.0, beyond), change = multipliers[j] - now;
      for (std::size_t k = 0; k < n; ++k) u[k] += change * h.a[k];
      multipliers[j] = now;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const double v = u[k] + kept[k];
      u[k] = std::clamp(v, lower[k], upper[k]);
      kept[k] = v - u[k];
      largest = std::max(largest, std::abs(u[k] - before[k]));
    }
    if (largest < 1e-13) break;
  }
  return u;
}

}  // namespace topple::uncertainty
