#include "product/footprint.h"

#include <cmath>
#include <cstddef>

#include "product/clip.h"

namespace topple::product {

namespace {

using Point = std::array<double, 2>;

double cross(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Whether a point lies on the edge from a to b, its ends left out.
bool is_within(const Point& a, const Point& b, const Point& p) {
  return cross(a, b, p) == 0 && (p[0] - a[0]) * (p[0] - b[0]) + (p[1] - a[1]) * (p[1] - b[1]) < 0;
}

/// Whether an edge from b goes back on the one from a to b.
bool goes_back(const Point& a, const Point& b, const Point& c) {
  return cross(a, b, c) == 0 && (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0;
}

/// Whether p, seen from a corner, lies between the directions to `from` and, counterclockwise, `to`.
bool lies_between(const Point& corner, const Point& from, const Point& to, const Point& p) {
  const double turn_p = cross(corner, from, p), turn_to = cross(corner, from, to), left = cross(corner, p, to);
  return turn_to >= 0 ? turn_p > 0 && left > 0 : turn_p > 0 || left > 0;
}

/// Whether edges of two ways through a corner lie on each other.
bool shares(const Point& a, const Point& b, const Point& c, const Point& d) {
  return a == c || a == d || b == c || b == d;
}

}  // namespace

double calc_signed_area(const std::vector<Point>& corners) {
  double twice = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point &a = corners[i], &b = corners[(i + 1) % corners.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

bool crosses_itself(const std::vector<Point>& all) {
  std::vector<Point> corners;  // without those that are given twice in turn
  for (const Point& p : all)
    if (corners.empty() || corners.back() != p) corners.push_back(p);
  while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
  const std::size_t n = corners.size();
  const auto at = [&](std::size_t i) -> const Point& { return corners[i % n]; };
  for (std::size_t i = 0; i < n; ++i) {
    const Point &before = at(i + n - 1), &a = at(i), &b = at(i + 1);
    if (goes_back(before, a, b)) return true;
    for (std::size_t j = 0; j < n; ++j) {
      const Point &c = at(j), &d = at(j + 1), &next = at(j + 2);
      if (cross(a, b, c) * cross(a, b, d) < 0 && cross(c, d, a) * cross(c, d, b) < 0) return true;
      // through a corner that lies on an edge or on another corner
      if (is_within(a, b, d) && cross(a, b, c) * cross(a, b, next) < 0) return true;
      if (a == d && lies_between(a, b, before, c) != lies_between(a, b, before, next) && !shares(before, b, c, next))
        return true;
    }
  }
  return false;
}

double calc_overlap(const std::vector<Point>& outline, const std::vector<Point>& convex) {
  Loop left;
  for (const Point& p : outline) left.push_back({p[0], p[1], 0});
  for (std::size_t i = 0; i < convex.size() && !left.empty(); ++i) {
    const Point &a = convex[i], &b = convex[(i + 1) % convex.size()];
    const double x = b[0] - a[0], y = b[1] - a[1], length = std::hypot(x, y);
    if (length > 0) left = clip(left, {{a[0], a[1], 0}, {y / length, -x / length, 0}});
  }
  return 0.5 * norm(calc_normal(left));
}

}  // namespace topple::product
