#include "record/building_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "base/polygon.h"
#include "base/union_outline.h"

namespace topple::record {
namespace {

constexpr double kRounding = 0.01;  // of a building that has settled under its dead load [m]

Polygon find_corners(const BoxShape& shape, const Pose& X_WB) {
  Polygon corners;
  for (int k = 0; k < 8; ++k) {
    const Vec3 local{(k & 1) != 0 ? shape.half.x : -shape.half.x, (k & 2) != 0 ? shape.half.y : -shape.half.y,
                     (k & 4) != 0 ? shape.half.z : -shape.half.z};
    const Vec3 p = X_WB * (shape.X_BS * local);
    corners.push_back({p.x, p.y});
  }
  return corners;
}

}  // namespace

std::vector<Polygon> calc_building_plan(const Record& r) {
  if (r.time.empty()) return {};
  std::vector<Rectangle> rectangles;
  std::map<std::string, Polygon> turned;  // what does not lie along the axes, by the shaft's or body's name
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    const Pose X_WB = pose_at(r, 0, b);
    for (const BoxShape& shape : r.bodies[b].shapes) {
      const Polygon corners = find_corners(shape, X_WB);
      Rectangle all{corners[0], corners[0]};
      for (const Point2& p : corners)
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
  std::vector<Polygon> loops = calc_union_outlines(rectangles, kRounding);
  for (auto& [name, corners] : turned) loops.push_back(calc_hull(std::move(corners)));
  return loops;
}

}  // namespace topple::record
