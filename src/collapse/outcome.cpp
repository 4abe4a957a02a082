#include "collapse/outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "base/disjoint_sets.h"

namespace topple::collapse {

std::vector<StageTimes> find_stage_times(const ModelMap& map, bool all) {
  std::map<int, StageTimes> times;
  for (const Firing& f : map.schedule) {
    if (f.fails && !all) continue;
    const auto [it, is_new] = times.emplace(f.stage, StageTimes{static_cast<size_t>(f.stage), f.time, f.time});
    it->second.first = std::min(it->second.first, f.time);
    it->second.last = std::max(it->second.last, f.time);
  }
  std::vector<StageTimes> out;
  for (const auto& [s, t] : times) out.push_back(t);
  std::stable_sort(out.begin(), out.end(), [](const StageTimes& a, const StageTimes& b) { return a.first < b.first; });
  return out;
}

namespace {

/// Of each structure.
std::vector<MechanismInput> make_mechanism_inputs(const product::Plan& plan, const mbs::Model& model,
                                                  const ModelMap& map, const Knowledge& k, const Recorder& recorder,
                                                  const mbs::Summary& summary, bool is_under_way, bool is_cancelled) {
  MechanismInput in;
  in.fall_direction = map.fall_direction;
  in.is_direction_planned = map.is_direction_planned;
  in.direction_tolerance = plan.criteria.azimuth_tolerance;
  in.storey_height = map.ground_storey_height;
  in.came_to_rest = summary.ending == mbs::Summary::Ending::AtRest;
  in.is_under_way = is_under_way;
  in.is_cancelled = is_cancelled;
  for (const StageTimes& t : find_stage_times(map)) in.last_charge = std::max(in.last_charge, t.last);
  const size_t S = map.structures.size();
  std::vector<double> mass(S, 0);
  std::vector<Vec3> centre(S);
  std::vector<std::vector<Point2>> corners(S);
  std::vector<double> foot(S, std::numeric_limits<double>::infinity());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (!map.bodies[b].is_upper) continue;
    const size_t structure = static_cast<size_t>(map.bodies[b].structure);
    const mbs::Body& body = model.bodies[b];
    mass[structure] += body.mass;
    centre[structure] += body.mass * body.X_WB.p;
    for (const record::BoxShape& s : map.bodies[b].shapes) {
      const PlacedBox box{body.X_WB * s.X_BS, s.half};
      for (const Point2& p : calc_outline(box)) corners[structure].push_back(p);
      const Mat3 R = to_matrix(box.X_WS.q);
      foot[structure] = std::min(foot[structure], box.X_WS.p.z - std::abs(R(2, 0)) * s.half.x -
                                                      std::abs(R(2, 1)) * s.half.y - std::abs(R(2, 2)) * s.half.z);
    }
  }
  std::vector<MechanismInput> out;
  for (size_t s = 0; s < S; ++s) {
    in.frames = recorder.block_frames(s);
    in.touchdowns = recorder.upper_touchdowns(s, true), in.all_touchdowns = recorder.upper_touchdowns(s, false);
    find_deciding_touchdown(in, k);
    if (mass[s] > 0) centre[s] = (1 / mass[s]) * centre[s];
    for (Point2& p : corners[s]) p = {p[0] - centre[s].x, p[1] - centre[s].y};
    in.outline = calc_hull(std::move(corners[s]));
    in.foot = std::isfinite(foot[s]) ? foot[s] : 0;
    out.push_back(in);
  }
  return out;
}

}  // namespace

std::vector<Mechanism> judge_structures(const product::Plan& plan, const mbs::Model& model, const ModelMap& map,
                                        const Knowledge& k, const Recorder& recorder, const mbs::Summary& summary,
                                        bool is_under_way, bool is_cancelled) {
  std::vector<Mechanism> verdicts;
  for (const MechanismInput& in :
       make_mechanism_inputs(plan, model, map, k, recorder, summary, is_under_way, is_cancelled))
    verdicts.push_back(judge_mechanism(in, k));
  return verdicts;
}

Mechanism judge_run(const std::vector<Mechanism>& verdicts, const ModelMap& map, const Knowledge& k,
                    const Recorder& recorder) {
  std::vector<std::string> names;
  std::vector<double> masses;
  for (const StructureEntry& structure : map.structures) {
    names.push_back(structure.name);
    masses.push_back(structure.mass);
  }
  Mechanism out = join_mechanisms(names, verdicts, masses);
  if (const double beside = recorder.block_frames().back().beside; beside >= k.mechanism_stands_share)
    out.text += fmt::format(" Of what no charge acts on {:.0f} % of the mass has come down too.", 100 * beside);
  return out;
}

std::vector<NearVerdict> find_near_verdicts(const product::Plan& plan, const mbs::Model& model, const ModelMap& map,
                                            const Knowledge& k, const Recorder& recorder, const mbs::Summary& summary) {
  const std::vector<MechanismInput> inputs =
      make_mechanism_inputs(plan, model, map, k, recorder, summary, false, false);
  return inputs.size() == 1 ? find_near_verdicts(inputs.front(), k) : std::vector<NearVerdict>{};
}

bool stands(const BlockFrame& block, const Knowledge& k) { return calc_away(block, k) < 1; }

size_t find_frame(const std::vector<BlockFrame>& block, double time) {
  size_t i = 0;
  while (i + 1 < block.size() && block[i + 1].time <= time + 1e-9) ++i;
  return i;
}

Polygon calc_building_outline(const mbs::Model& model, const ModelMap& map) {
  std::vector<Point2> corners;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (map.bodies[b].structure < 0) continue;
    for (const record::BoxShape& s : map.bodies[b].shapes)
      for (const Point2& p : calc_outline({model.bodies[b].X_WB * s.X_BS, s.half})) corners.push_back(p);
  }
  return calc_hull(std::move(corners));
}

Polygon find_start_outline(const record::Record& r, size_t body) {
  using record::Belonging;
  const Belonging belongs = r.bodies[body].belongs;
  if (belongs == Belonging::Building || r.building_outline.empty()) return r.building_outline;
  std::vector<Point2> corners;
  const Pose X_WB = record::pose_at(r, 0, body);
  for (size_t i = 0; i < r.bodies[body].shapes.size(); ++i) {
    const record::BoxShape s = record::shape_at(r, 0, body, i);
    for (const Point2& p : calc_outline({X_WB * s.X_BS, s.half})) corners.push_back(p);
  }
  // of records that do not say it: what lies beyond the building's outline
  constexpr double rounding = 1e-3;  // of poses that are kept as floats [m]
  const bool is_beside = belongs == Belonging::Beside ||
                         std::any_of(corners.begin(), corners.end(),
                                     [&](const Point2& p) { return calc_distance(p, r.building_outline) > rounding; });
  return is_beside ? calc_hull(std::move(corners)) : r.building_outline;
}

constexpr double kStays = 0.05;  // [m]

bool stays_beside(const record::Record& r, size_t body, size_t frame) {
  const Polygon from = find_start_outline(r, body);
  if (from == r.building_outline || from.empty()) return false;
  const Pose X_WB = record::pose_at(r, frame, body);
  for (size_t i = 0; i < r.bodies[body].shapes.size(); ++i) {
    const record::BoxShape s = record::shape_at(r, frame, body, i);
    for (const Point2& p : calc_outline({X_WB * s.X_BS, s.half}))
      if (calc_distance(p, from) >= kStays) return false;
  }
  return true;
}

std::vector<PlacedBox> find_moving_boxes(const record::Record& r, size_t frame) {
  std::vector<PlacedBox> boxes;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (r.bodies[b].fixed || stays_beside(r, b, frame)) continue;
    const Pose X_WB = record::pose_at(r, frame, b);
    for (size_t i = 0; i < r.bodies[b].shapes.size(); ++i) {
      const record::BoxShape s = record::shape_at(r, frame, b, i);
      boxes.push_back({X_WB * s.X_BS, s.half});
    }
  }
  return boxes;
}

Heap find_heap(const record::Record& r, size_t frame) {
  constexpr double cell = 0.25;  // [m]
  return calc_heap(find_moving_boxes(r, frame), cell);
}

double calc_deviation(double found, double azimuth) {
  return std::abs(std::remainder(found - azimuth, 2 * std::numbers::pi));
}

double calc_deviation(const Mechanism& m, double azimuth) {
  double most = calc_deviation(m.azimuth, azimuth);
  for (const Fall& f : m.falls)
    if (const double off = calc_deviation(f.azimuth, azimuth); off > most) most = off;
  return most;
}

namespace {

/// Of a place, as records keep poses [m].
double rounding_of(const PlacedBox& box) {
  return std::max(1e-5, 0x1p-22 * std::max(std::abs(box.X_WS.p.x), std::abs(box.X_WS.p.y)));
}

/// Of what of a box is farther than `least` over an area seen from above, the lowest height, to that much; infinite:
/// nothing is [m].
double calc_lowest_within(const PlacedBox& box, const Polygon& area, double least) {
  PlacedBox within = box;
  for (int i = 0; i < 3; ++i) within.half[i] = std::max(0.0, box.half[i] - least);
  if (calc_distance(calc_outline(within), area) > 0) return std::numeric_limits<double>::infinity();
  return calc_lowest_over(within, area) - least;
}

}  // namespace

double calc_stave_error(const record::BodyInfo& body) {
  constexpr size_t least_staves = 16;  // around a shaft; of a column a stump has fewer boxes
  if (body.kind != "shaft" && (body.kind != "stump" || body.shapes.size() < least_staves)) return 0;
  double most = 0;
  // corners of a stave lie half its breadth times tan(angle / 4) beyond the ring
  for (const record::BoxShape& s : body.shapes) most = std::max(most, s.half.y);
  return std::tan(0.5 * std::numbers::pi / least_staves) * most;
}

Approach find_approach(const record::Record& r, const Polygon& area, const std::atomic<bool>* cancel) {
  Approach out;
  double nlow[2] = {1e30, 1e30}, nhigh[2] = {-1e30, -1e30};
  for (const Point2& p : area)
    for (size_t i : {0UL, 1UL}) nlow[i] = std::min(nlow[i], p[i]), nhigh[i] = std::max(nhigh[i], p[i]);
  for (size_t f = 0; f < r.time.size() && !(cancel != nullptr && *cancel); ++f) {
    for (size_t b = 0; b < r.bodies.size(); ++b) {
      if (f > 0 && r.bodies[b].fixed) continue;
      const Pose X_WB = record::pose_at(r, f, b);
      for (size_t i = 0; i < r.bodies[b].shapes.size(); ++i) {
        const record::BoxShape s = record::shape_at(r, f, b, i);
        const PlacedBox box{X_WB * s.X_BS, s.half};
        const double radius = norm(s.half);
        const double gap[2] = {std::max({nlow[0] - box.X_WS.p.x - radius, box.X_WS.p.x - radius - nhigh[0], 0.0}),
                               std::max({nlow[1] - box.X_WS.p.y - radius, box.X_WS.p.y - radius - nhigh[1], 0.0})};
        const double at_least = std::hypot(gap[0], gap[1]);
        if (at_least > 0 && at_least >= out.least) continue;
        double d = calc_distance(calc_outline(box), area);
        if (d < rounding_of(box)) d = 0;
        // round-off of what stands is no way
        if (d < out.least - (std::isfinite(out.least) ? rounding_of(box) : 0))
          out.least = d, out.when = r.time[f], out.body = b;
        // as a wall beside it whose joint closes, or at the start the stave of a ring beside it
        constexpr double joint = 0.01;  // [m]
        const double may_overlap = f == 0 ? std::max(joint, calc_stave_error(r.bodies[b])) : joint;
        if (d > 0) continue;
        const double height = calc_lowest_within(box, area, may_overlap);
        if (height < out.lowest) out.lowest = height, out.lowest_when = r.time[f], out.lowest_body = b;
      }
    }
    if (out.lowest <= kOnGround) break;
  }
  return out;
}

namespace {

/// How far a part lies beyond the footprint.
struct PartReach {
  size_t body = 0;
  double mass = 0;
  std::array<double, 4> side{};  // beyond the box around it; 0: not beyond [m]
  double way = 0;                // distance of its farthest point in plan [m]
  std::vector<Point2> corners;   // of its boxes, seen from above
};
std::vector<PartReach> find_part_reaches(const record::Record& r, size_t frame) {
  std::vector<PartReach> parts;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (r.bodies[b].fixed) continue;
    PartReach part;
    part.body = b;
    // what is thrown out is still in the mass of its member
    part.mass = r.bodies[b].kind == "debris" ? 0 : r.bodies[b].mass;
    const Pose X_WB = record::pose_at(r, frame, b);
    const Polygon from = find_start_outline(r, b);
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    for (const Point2& p : from)
      for (size_t i : {0UL, 1UL}) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    for (size_t shape = 0; shape < r.bodies[b].shapes.size(); ++shape) {
      const record::BoxShape s = record::shape_at(r, frame, b, shape);
      for (const Point2& p : calc_outline({X_WB * s.X_BS, s.half})) {
        part.corners.push_back(p);
        if (!from.empty()) part.way = std::max(part.way, calc_distance(p, from));
        for (size_t i : {0UL, 1UL}) {
          part.side[2 * i] = std::max(part.side[2 * i], low[i] - p[i]);
          part.side[2 * i + 1] = std::max(part.side[2 * i + 1], p[i] - high[i]);
        }
      }
    }
    // poses are kept as floats
    constexpr double rounding = 1e-5;  // [m]
    const auto is_none = [](double x) { return x < rounding; };
    std::replace_if(part.side.begin(), part.side.end(), is_none, 0.0);
    if (is_none(part.way)) part.way = 0;
    // what stands beside the building and stays there is no debris
    if (from != r.building_outline && part.way < kStays) continue;
    parts.push_back(std::move(part));
  }
  std::stable_sort(parts.begin(), parts.end(), [](const PartReach& a, const PartReach& b) { return a.way < b.way; });
  return parts;
}

/// Of values with their masses, the smallest within which a share of the mass lies.
double find_within(std::vector<std::pair<double, double>> value_and_mass, double share) {
  std::sort(value_and_mass.begin(), value_and_mass.end());
  double mass = 0, within = 0;
  for (const auto& [value, m] : value_and_mass) mass += m;
  for (const auto& [value, m] : value_and_mass)
    if ((within += m) >= share * mass) return value;
  return 0;
}

}  // namespace

Reach calc_reach(const record::Record& r, size_t frame) {
  constexpr double most = 0.95;
  Reach out;
  // a single piece may fly far: how far beyond the footprint each part lies, and which is the last
  const std::vector<PartReach> parts = find_part_reaches(r, frame);
  std::vector<Point2> corners;
  std::array<std::vector<std::pair<double, double>>, 4> sides;
  std::vector<std::pair<double, double>> ways;
  for (const PartReach& part : parts) {
    corners.insert(corners.end(), part.corners.begin(), part.corners.end());
    for (size_t i = 0; i < 4; ++i) {
      out.side[i] = std::max(out.side[i], part.side[i]);
      sides[i].emplace_back(part.side[i], part.mass);
    }
    ways.emplace_back(part.way, part.mass);
  }
  for (size_t i = 0; i < 4; ++i) out.side_most[i] = find_within(std::move(sides[i]), most);
  out.most_mass = find_within(std::move(ways), most);
  out.outline = calc_hull(std::move(corners));
  out.area = calc_area(out.outline);
  if (parts.empty()) return out;
  out.farthest = static_cast<int>(parts.back().body);
  out.largest = parts.back().way;
  return out;
}

namespace {

/// Of each body whether it hangs together with the ground in the last frame.
std::vector<bool> find_standing(const record::Record& r) {
  using record::ZoneState;
  const size_t Z = r.zones.size(), B = r.bodies.size();
  const int ground = static_cast<int>(B);
  DisjointSets linked(B + 1);
  for (size_t b = 0; b < B; ++b)
    if (r.bodies[b].fixed) linked.join(static_cast<int>(b), ground);
  const auto body_of = [ground](int body) { return body < 0 ? ground : body; };
  for (size_t z = 0; z < Z; ++z) {
    const auto state = static_cast<ZoneState>(r.zone_state[r.zone_state.size() - Z + z]);
    if (state != ZoneState::Broken && state != ZoneState::Fired)
      linked.join(body_of(r.zones[z].body_a), body_of(r.zones[z].body_b));
  }
  std::vector<bool> out(B);
  for (size_t b = 0; b < B; ++b) out[b] = linked.find(static_cast<int>(b)) == linked.find(ground);
  return out;
}

}  // namespace

std::vector<OpenPart> find_open_parts(const record::Record& r, const ModelMap& map,
                                      const std::vector<Mechanism>& verdicts, double gravity, double friction) {
  std::vector<OpenPart> out;
  const size_t last = r.time.size() - 1;
  const std::vector<bool> is_standing = find_standing(r);
  // what no charge has acted on rests in its equilibrium
  const bool has_fired =
      std::any_of(map.schedule.begin(), map.schedule.end(), [](const Firing& f) { return !f.fails; });
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (r.bodies[b].fixed) continue;
    // debris is of no structure
    const int structure = b < map.bodies.size() ? map.bodies[b].structure : -1;
    const Mechanism* verdict = structure >= 0 ? &verdicts[static_cast<size_t>(structure)] : nullptr;
    // what sways about its place goes nowhere
    if (verdict != nullptr && verdict->is_final && verdict->name == "stands" && is_standing[b]) continue;
    const bool may_fall = has_fired && verdict != nullptr && !verdict->is_final;
    const Vec3 p = record::pose_at(r, last, b).p;
    const double v = last > 0 ? norm(p - record::pose_at(r, last - 1, b).p) / (r.time[last] - r.time[last - 1]) : 0.0;
    if (!(v > kStill) && !may_fall) continue;
    const double height = std::max(0.0, p.z);
    const double slide = friction * gravity > 0 ? (0.5 * v * v + gravity * height) / (friction * gravity)
                                                : std::numeric_limits<double>::infinity();
    out.push_back({b, v, may_fall ? height + slide : slide});
  }
  return out;
}

Polygon calc_share_outline(const record::Record& r, size_t frame, double share) {
  const std::vector<PartReach> parts = find_part_reaches(r, frame);
  double mass = 0, within = 0;
  for (const PartReach& part : parts) mass += part.mass;
  std::vector<Point2> corners;
  for (const PartReach& part : parts) {
    corners.insert(corners.end(), part.corners.begin(), part.corners.end());
    if ((within += part.mass) >= share * mass) break;
  }
  return calc_hull(std::move(corners));
}

}  // namespace topple::collapse
