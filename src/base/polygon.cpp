#include "base/polygon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace topple {

Polygon calc_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  const auto cross = [](const Point2& o, const Point2& a, const Point2& b) {
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  };
  Polygon hull(2 * points.size());
  size_t n = 0;
  for (size_t pass = 0; pass < 2; ++pass) {
    const size_t start = n;
    for (size_t i = 0; i < points.size(); ++i) {
      const Point2& p = pass == 0 ? points[i] : points[points.size() - 1 - i];
      while (n >= start + 2 && cross(hull[n - 2], hull[n - 1], p) <= 0) --n;
      hull[n++] = p;
    }
    --n;
  }
  hull.resize(n);
  return hull;
}

double calc_signed_area(const Polygon& p) {
  double twice = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const Point2 &a = p[i], &b = p[(i + 1) % p.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

double calc_area(const Polygon& p) { return std::abs(calc_signed_area(p)); }

}  // namespace topple
