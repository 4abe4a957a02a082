#include "collapse/outcome.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace topple::collapse {

std::vector<StageTimes> find_stage_times(const ModelMap& map) {
  std::map<int, StageTimes> times;
  for (const Firing& f : map.schedule) {
    if (f.fails) continue;
    const auto [it, is_new] = times.emplace(f.stage, StageTimes{static_cast<size_t>(f.stage), f.time, f.time});
    it->second.first = std::min(it->second.first, f.time);
    it->second.last = std::max(it->second.last, f.time);
  }
  std::vector<StageTimes> out;
  for (const auto& [s, t] : times) out.push_back(t);
  return out;
}

Mechanism judge_run(const product::Plan& plan, const mbs::Model& model, const ModelMap& map, const Knowledge& k,
                    const Recorder& recorder, const mbs::Summary& summary) {
  MechanismInput in;
  in.frames = recorder.block_frames();
  in.touchdown = recorder.first_touchdown();
  in.fall_direction = map.fall_direction;
  in.is_direction_planned = map.is_direction_planned;
  in.direction_tolerance = plan.criteria.azimuth_tolerance.value_or(0);
  in.storey_height = map.ground_storey_height;
  in.came_to_rest = summary.ending == mbs::Summary::Ending::AtRest;
  double mass = 0, centre = 0, front = -1e30, rear = 1e30;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (!map.bodies[b].is_upper) continue;
    const mbs::Body& body = model.bodies[b];
    mass += body.mass;
    centre += body.mass * dot(body.X_WB.p, in.fall_direction);
    for (const record::BoxShape& s : map.bodies[b].shapes)
      for (const Point2& p : calc_outline({body.X_WB * s.X_BS, s.half})) {
        const double along = p[0] * in.fall_direction.x + p[1] * in.fall_direction.y;
        front = std::max(front, along);
        rear = std::min(rear, along);
      }
  }
  if (mass > 0) {
    in.front = front - centre / mass;
    in.rear = centre / mass - rear;
  }
  return judge_mechanism(in, k);
}

bool stands(const BlockFrame& block, const Knowledge& k) {
  const double away = norm(block.displacement);
  return away < k.stands_displacement && std::isfinite(away);
}

size_t find_frame(const std::vector<BlockFrame>& block, double time) {
  size_t i = 0;
  while (i + 1 < block.size() && block[i + 1].time <= time + 1e-9) ++i;
  return i;
}

Polygon calc_building_outline(const mbs::Model& model, const ModelMap& map) {
  std::vector<Point2> corners;
  for (size_t b = 0; b < model.bodies.size(); ++b)
    for (const record::BoxShape& s : map.bodies[b].shapes)
      for (const Point2& p : calc_outline({model.bodies[b].X_WB * s.X_BS, s.half})) corners.push_back(p);
  return calc_hull(std::move(corners));
}

Reach calc_reach(const record::Record& r, size_t frame) {
  Reach out;
  double low0[2] = {1e30, 1e30}, high0[2] = {-1e30, -1e30};
  for (const auto& p : r.building_outline)
    for (size_t i : {0UL, 1UL}) low0[i] = std::min(low0[i], p[i]), high0[i] = std::max(high0[i], p[i]);
  // a single piece may fly far: how far beyond the footprint each part lies, and which is the last
  std::vector<std::pair<double, size_t>> ways;
  std::vector<Point2> corners;
  double mass = 0;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (r.bodies[b].fixed) continue;
    double way = 0;
    const Pose X_WB = record::pose_at(r, frame, b);
    for (const record::BoxShape& s : r.bodies[b].shapes)
      for (const Point2& p : calc_outline({X_WB * s.X_BS, s.half})) {
        corners.push_back(p);
        for (size_t i : {0UL, 1UL}) {
          out.side[2 * i] = std::max(out.side[2 * i], low0[i] - p[i]);
          out.side[2 * i + 1] = std::max(out.side[2 * i + 1], p[i] - high0[i]);
          way = std::max({way, low0[i] - p[i], p[i] - high0[i]});
        }
      }
    ways.emplace_back(way, b);
    mass += r.bodies[b].mass;
  }
  out.largest = *std::max_element(out.side.begin(), out.side.end());
  out.outline = calc_hull(std::move(corners));
  out.area = calc_area(out.outline);
  std::sort(ways.begin(), ways.end());
  double within = 0;
  for (const auto& [way, b] : ways) {
    out.most_mass = way;
    within += r.bodies[b].mass;
    if (within >= 0.95 * mass) break;
  }
  if (!ways.empty()) out.farthest = static_cast<int>(ways.back().second);
  return out;
}

}  // namespace topple::collapse
