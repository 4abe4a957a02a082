#include "collapse/debris.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

namespace topple::collapse {

namespace {

double cross2(const Point2& o, const Point2& a, const Point2& b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

bool contains(const Polygon& polygon, const Point2& p) {
  bool inside = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Point2 &a = polygon[i], &b = polygon[j];
    if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]) inside = !inside;
  }
  return inside;
}

/// Square of the distance [m²].
double point_segment(const Point2& p, const Point2& a, const Point2& b) {
  const double dx = b[0] - a[0], dy = b[1] - a[1], l2 = dx * dx + dy * dy;
  const double t = l2 > 0 ? std::clamp(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / l2, 0.0, 1.0) : 0;
  const double x = p[0] - a[0] - t * dx, y = p[1] - a[1] - t * dy;
  return x * x + y * y;
}

/// Heights at which a plumb line at p enters and leaves a box; the first is not below the second where it misses it.
std::pair<double, double> find_plumb(const PlacedBox& box, const Mat3& R_WS, const Point2& p) {
  const Vec3 o = transpose_times(R_WS, Vec3{p[0] - box.X_WS.p.x, p[1] - box.X_WS.p.y, -box.X_WS.p.z});
  const Vec3 d = transpose_times(R_WS, Vec3{0, 0, 1});
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    if (std::abs(d[c]) < 1e-12) {
      if (std::abs(o[c]) > box.half[c]) high = low = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const double a = (-box.half[c] - o[c]) / d[c], b = (box.half[c] - o[c]) / d[c];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return {low, high};
}

bool segments_cross(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const double p = cross2(a, b, c), q = cross2(a, b, d), r = cross2(c, d, a), s = cross2(c, d, b);
  return ((p > 0) != (q > 0)) && ((r > 0) != (s > 0));
}

}  // namespace

double calc_distance(const Polygon& a, const Polygon& b) {
  if (a.empty() || b.empty()) return std::numeric_limits<double>::infinity();
  if (contains(a, b.front()) || contains(b, a.front())) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t j = 0; j < b.size(); ++j) {
      const Point2 &a0 = a[i], &a1 = a[(i + 1) % a.size()], &b0 = b[j], &b1 = b[(j + 1) % b.size()];
      if (segments_cross(a0, a1, b0, b1)) return 0;
      least = std::min({least, point_segment(a0, b0, b1), point_segment(b0, a0, a1)});
    }
  return std::sqrt(least);
}

double calc_distance(const Point2& p, const Polygon& polygon) {
  if (polygon.empty()) return std::numeric_limits<double>::infinity();
  if (contains(polygon, p)) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < polygon.size(); ++i)
    least = std::min(least, point_segment(p, polygon[i], polygon[(i + 1) % polygon.size()]));
  return std::sqrt(least);
}

Polygon calc_outline(const PlacedBox& box) {
  const Mat3 R = to_matrix(box.X_WS.q);
  std::vector<Point2> points;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = box.X_WS.p + R * Vec3{i & 1 ? box.half.x : -box.half.x, i & 2 ? box.half.y : -box.half.y,
                                         i & 4 ? box.half.z : -box.half.z};
    points.push_back({p.x, p.y});
  }
  return calc_hull(std::move(points));
}

double calc_lowest_over(const PlacedBox& box, const Polygon& polygon) {
  const Mat3 R = to_matrix(box.X_WS.q);
  std::array<Vec3, 8> corner;
  for (size_t i = 0; i < 8; ++i)
    corner[i] = box.X_WS.p + R * Vec3{i & 1 ? box.half.x : -box.half.x, i & 2 ? box.half.y : -box.half.y,
                                      i & 4 ? box.half.z : -box.half.z};
  // the lowest point is a corner over the area, a place of an edge over the area's edge, or over a corner of the area
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& p : corner)
    if (p.z < lowest && contains(polygon, {p.x, p.y})) lowest = p.z;
  for (size_t i = 0; i < 8; ++i)
    for (const size_t bit : {1UL, 2UL, 4UL}) {
      if (i & bit) continue;
      const Vec3 &a = corner[i], &b = corner[i | bit];
      for (size_t k = 0; k < polygon.size(); ++k) {
        const Point2 &c = polygon[k], &d = polygon[(k + 1) % polygon.size()];
        if (!segments_cross({a.x, a.y}, {b.x, b.y}, c, d)) continue;
        const double from = cross2(c, d, {a.x, a.y}), to = cross2(c, d, {b.x, b.y});
        lowest = std::min(lowest, a.z + from / (from - to) * (b.z - a.z));
      }
    }
  for (const Point2& p : polygon) {
    const auto [low, high] = find_plumb(box, R, p);
    if (high > low) lowest = std::min(lowest, low);
  }
  return lowest;
}

namespace {

/// Half of the upright box around a box [m].
Vec3 calc_upright_half(const Mat3& R, const Vec3& half) {
  Vec3 reach;
  for (int i = 0; i < 3; ++i)
    reach[i] = std::abs(R(i, 0)) * half.x + std::abs(R(i, 1)) * half.y + std::abs(R(i, 2)) * half.z;
  return reach;
}

}  // namespace

double calc_heap_height(const std::vector<PlacedBox>& boxes) {
  double height = 0;
  for (const PlacedBox& box : boxes)
    height = std::max(height, box.X_WS.p.z + calc_upright_half(to_matrix(box.X_WS.q), box.half).z);
  return height;
}

Heap calc_heap(const std::vector<PlacedBox>& boxes, double cell) {
  Heap heap;
  heap.height = calc_heap_height(boxes);
  std::map<std::pair<std::int64_t, std::int64_t>, double> top;
  for (const PlacedBox& box : boxes) {
    const Mat3 R = to_matrix(box.X_WS.q);
    const Vec3 reach = calc_upright_half(R, box.half);
    const auto first = [&](double v) { return static_cast<std::int64_t>(std::floor(v / cell)); };
    for (std::int64_t i = first(box.X_WS.p.x - reach.x); i <= first(box.X_WS.p.x + reach.x); ++i)
      for (std::int64_t j = first(box.X_WS.p.y - reach.y); j <= first(box.X_WS.p.y + reach.y); ++j) {
        const auto [low, high] =
            find_plumb(box, R, {(static_cast<double>(i) + 0.5) * cell, (static_cast<double>(j) + 0.5) * cell});
        if (!(high > low) || high <= 0) continue;
        double& z = top[{i, j}];
        z = std::max(z, high);
      }
  }
  for (const auto& [at, z] : top) {
    heap.volume += z * cell * cell;
    heap.columns.push_back({at.first, at.second, z});
  }
  return heap;
}

}  // namespace topple::collapse
