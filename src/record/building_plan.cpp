#include "record/building_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "base/union_outline.h"

namespace topple::record {
namespace {

using Point = std::array<double, 2>;

constexpr double kRounding = 0.01;  // of a building that has settled under its dead load [m]

std::vector<Point> find_corners(const BoxShape& shape, const Pose& X_WB) {
  std::vector<Point> corners;
  for (int k = 0; k < 8; ++k) {
    const Vec3 local{(k & 1) != 0 ? shape.half.x : -shape.half.x, (k & 2) != 0 ? shape.half.y : -shape.half.y,
                     (k & 4) != 0 ? shape.half.z : -shape.half.z};
    const Vec3 p = X_WB * (shape.X_BS * local);
    corners.push_back({p.x, p.y});
  }
  return corners;
}

/// Convex, counter-clockwise.
std::vector<Point> calc_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end());
  std::vector<Point> hull;
  const auto is_left = [](const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  };
  for (int half = 0; half < 2; ++half) {
    const size_t begin = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= begin + 2 && !is_left(hull[hull.size() - 2], hull.back(), p)) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

double calc_area(const std::vector<Point>& loop) {
  double area = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Point &a = loop[i], &b = loop[(i + 1) % loop.size()];
    area += 0.5 * (a[0] * b[1] - b[0] * a[1]);
  }
  return area;
}

}  // namespace

std::vector<std::vector<Point>> calc_building_plan(const Record& r) {
  if (r.time.empty()) return {};
  std::vector<Rectangle> rectangles;
  std::map<std::string, std::vector<Point>> turned;  // what does not lie along the axes, by the shaft's or body's name
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    const Pose X_WB = pose_at(r, 0, b);
    for (const BoxShape& shape : r.bodies[b].shapes) {
      const std::vector<Point> corners = find_corners(shape, X_WB);
      Rectangle all{corners[0], corners[0]};
      for (const Point& p : corners)
        for (size_t i = 0; i < 2; ++i) {
          all.low[i] = std::min(all.low[i], p[i]);
          all.high[i] = std::max(all.high[i], p[i]);
        }
      const double area = (all.high[0] - all.low[0]) * (all.high[1] - all.low[1]);
      if (!std::isfinite(area)) continue;
      constexpr double nearly = 0.98;
      if (r.bodies[b].kind != "shaft" && calc_area(calc_hull(corners)) > nearly * area) {
        rectangles.push_back(all);
        continue;
      }
      const std::string& name = r.bodies[b].name;
      auto& into = turned[r.bodies[b].kind == "shaft" ? name.substr(0, name.rfind('/')) : name];
      into.insert(into.end(), corners.begin(), corners.end());
    }
  }
  std::vector<std::vector<Point>> loops = calc_union_outlines(rectangles, kRounding);
  for (auto& [name, corners] : turned) loops.push_back(calc_hull(std::move(corners)));
  return loops;
}

}  // namespace topple::record
