#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "product/footprint.h"
#include "product/plan_limits.h"
#include "product/reading.h"

namespace topple::product {

namespace {

using Point = std::array<double, 2>;

std::vector<Point> read_footprint(TableReader& table) {
  std::vector<Point> corners;
  const std::string help =
      "corners in order, such as [[\"-30 m\", \"0 m\"], [\"-20 m\", \"0 m\"], [\"-20 m\", \"9 m\"]]";
  const Node* node = table.find("footprint");
  if (!node) {
    table.missing("footprint", help);
    return corners;
  }
  if (node->kind != Node::Kind::Array) {
    table.error("E202", node->place, "footprint: is " + name_of(node->kind) + "; a list of corners is wanted", help);
    return corners;
  }
  if (node->items.size() < 3 || node->items.size() > limits::corners) {
    table.error("E205", node->place, "footprint: has " + std::to_string(node->items.size()) + " corners",
                "allowed: between 3 and " + std::to_string(limits::corners));
    return corners;
  }
  bool is_readable = true;
  for (const Node& item : node->items) {
    if (item.kind != Node::Kind::Array || item.items.size() != 2) {
      table.error("E202", item.place, "footprint: a corner is a list of x and y", help);
      is_readable = false;
      continue;
    }
    const std::string label = table.label() + ": footprint";
    corners.push_back({read_quantity(item.items[0], label, Dimension::Length, limits::site, table.complaints()),
                       read_quantity(item.items[1], label, Dimension::Length, limits::site, table.complaints())});
    is_readable = is_readable && std::isfinite(corners.back()[0]) && std::isfinite(corners.back()[1]);
  }
  if (!is_readable) return {};
  const double area = calc_signed_area(corners);
  if (std::abs(area) < limits::footprint) {
    table.error("E308", node->place, "footprint: encloses no area", "give the corners in order around the footprint");
  } else if (crosses_itself(corners)) {
    table.error("E308", node->place, "footprint: its edges cross", "give the corners in order around the footprint");
  } else if (area < 0) {
    std::reverse(corners.begin(), corners.end());
  }
  return corners;
}

}  // namespace

namespace {

/// Both ends of a range of frequencies.
void read_frequencies(TableReader& table, VibrationLaw& law) {
  const std::string help =
      "the frequencies between which the ground answers, such as frequency = [\"5 Hz\", \"25 Hz\"]";
  const Node* node = table.find("frequency");
  if (!node) {
    table.missing("frequency", help);
    return;
  }
  if (node->kind != Node::Kind::Array || node->items.size() != 2) {
    table.error("E202", node->place, "frequency: two frequencies are wanted", help);
    return;
  }
  const std::string label = table.label() + ": frequency";
  law.low_frequency = read_quantity(node->items[0], label, Dimension::Frequency, {1, 1000}, table.complaints());
  law.high_frequency = read_quantity(node->items[1], label, Dimension::Frequency, {1, 1000}, table.complaints());
  if (law.high_frequency < law.low_frequency)
    table.error("E205", node->place, "frequency: the second one is below the first", help);
}

void read_vibration(Reading& reading, TableReader& site) {
  const Node* node = site.table("vibration");
  if (!node) return;
  TableReader table(*node, "vibration", reading.complaints);
  VibrationLaw law;
  law.velocity = table.quantity("velocity", Dimension::Velocity, {0, 10, true});
  law.energy = table.quantity("energy", Dimension::Energy, {1, 1e12});
  law.distance = table.quantity("distance", Dimension::Length, {0.1, 1e4});
  law.energy_exponent = table.quantity("energy_exponent", Dimension::Number, {0.1, 2});
  law.distance_exponent = table.quantity("distance_exponent", Dimension::Number, {0, 5});
  law.factor = table.quantity("factor", Dimension::Number, {1, 100});
  law.window = table.quantity("window", Dimension::Time, {0, 60}, law.window);
  law.least_distance = table.quantity("least_distance", Dimension::Length, {0.1, 1000}, law.least_distance);
  law.source = table.text("source");
  read_frequencies(table, law);
  table.finish();
  reading.plan.vibration = std::move(law);
}

}  // namespace

void read_site(Reading& reading, TableReader& root) {
  const Node* node = root.table("site");
  if (!node) return;
  Plan& plan = reading.plan;
  TableReader site(*node, "site", reading.complaints);
  plan.ground.friction = site.quantity("friction", Dimension::Number, {0, 2}, plan.ground.friction);
  plan.ground.restitution = site.quantity("restitution", Dimension::Number, {0, 1}, plan.ground.restitution);
  for (const bool is_utility : {false, true}) {
    const std::string key = is_utility ? "utility" : "neighbour";
    const std::vector<const Node*> tables = site.tables(key);
    if (tables.size() > limits::neighbours) {
      site.error("E209", tables[limits::neighbours]->place,
                 "more than " + std::to_string(limits::neighbours) + " of " + key);
      continue;
    }
    for (size_t i = 0; i < tables.size(); ++i) {
      TableReader table(*tables[i], key + "[" + std::to_string(i) + "]", reading.complaints);
      Neighbour n;
      n.name = table.text("name");
      n.footprint = read_footprint(table);
      n.clearance = table.find_quantity("clearance", Dimension::Length, {0, 1000});
      n.vibration_limit = table.quantity("vibration_limit", Dimension::Velocity, {0, 1, true}, 0);
      if (!is_utility) {
        const auto known = table.find_choice("building_class", {"commercial", "residential", "sensitive"});
        if (known)
          n.building_class = *known == "commercial"    ? BuildingClass::Commercial
                             : *known == "residential" ? BuildingClass::Residential
                                                       : BuildingClass::Sensitive;
      }
      n.is_utility = is_utility;
      if (const auto other = std::find_if(plan.neighbours.begin(), plan.neighbours.end(),
                                          [&n](const Neighbour& o) { return o.name == n.name; });
          !n.name.empty() && other != plan.neighbours.end())
        table.error("E208", table.place_of("name"),
                    "name: " + quoted(n.name) + " is the name of another neighbour or utility",
                    "each has findings of its own name; the other one is in line " + std::to_string(other->where.line));
      n.where = reading.complaints.position(tables[i]->place);
      table.finish();
      plan.neighbours.push_back(std::move(n));
    }
  }
  read_vibration(reading, site);
  site.finish();
}

void check_neighbours(Reading& reading) {
  const Plan& plan = reading.plan;
  std::vector<std::vector<Point>> buildings;
  if (reading.has_grid && !plan.row_offsets.empty() && !plan.frame_offsets.empty()) {
    const double x0 = plan.row_offsets.front(), x1 = plan.row_offsets.back();
    const double y0 = plan.frame_offsets.front(), y1 = plan.frame_offsets.back();
    buildings.push_back({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}});
  }
  for (const Member& m : plan.members) {
    if (m.shaft < 0 || !std::isfinite(m.start.x)) continue;
    const double radius = plan.shafts[static_cast<size_t>(m.shaft)].diameter_foot / 2;
    std::vector<Point>& ring = buildings.emplace_back();
    constexpr int corners = 48;
    for (int i = 0; i < corners; ++i) {
      const double a = 2 * std::numbers::pi * i / corners;
      ring.push_back({m.start.x + radius * std::cos(a), m.start.y + radius * std::sin(a)});
    }
  }
  constexpr double least = 1e-4;  // walls that touch have nothing in common [m²]
  for (const Neighbour& n : plan.neighbours)
    if (std::any_of(buildings.begin(), buildings.end(),
                    [&n](const std::vector<Point>& b) { return calc_overlap(n.footprint, b) > least; }))
      reading.complaints.warn("W505", {n.where.line, n.where.column, n.is_utility ? 16 : 18},
                              quoted(n.name) + ": its footprint overlaps the building");
}

void read_criteria(Reading& reading, TableReader& root) {
  const Node* node = root.table("criteria");
  if (!node) return;
  TableReader table(*node, "criteria", reading.complaints);
  Criteria& c = reading.plan.criteria;
  c.where = reading.complaints.position(node->place);
  c.mechanism = table.find_choice("mechanism", {"topple", "fold", "vertical", "progressive", "partial", "stands"});
  c.azimuth = table.find_quantity("azimuth", Dimension::Angle, {-360 * unit::deg, 360 * unit::deg});
  c.azimuth_tolerance = table.find_quantity("azimuth_tolerance", Dimension::Angle, {0, 180 * unit::deg});
  c.debris_reach = table.find_quantity("debris_reach", Dimension::Length, {0, 1000});
  c.stands_between_stages = table.find_flag("stands_between_stages");
  table.finish();
  if (c.azimuth && std::abs(std::sin(*c.azimuth)) > std::abs(std::cos(*c.azimuth))) {
    const auto& members = reading.plan.members;
    const auto along = std::count_if(members.begin(), members.end(), [](const Member& m) {
      return m.kind == MemberKind::Wall && !m.removed && m.row_a == m.row_b;
    });
    if (along > 0)
      table.complaints().warn("W511", table.place_of("azimuth"),
                              "azimuth: the fall is along y, and " + std::to_string(along) +
                                  (along == 1 ? " wall along y counts with its" : " walls along y count with their") +
                                  " weight only",
                              "walls along x alone resist; lay the grid so that the fall is along x");
  }
  if (c.azimuth && !c.azimuth_tolerance)
    table.missing("azimuth_tolerance", "add a line such as azimuth_tolerance = \"15 deg\"");
  if (c.azimuth_tolerance && !c.azimuth)
    table.error("E207", table.place_of("azimuth_tolerance"), "azimuth_tolerance: has no azimuth to go with");
}

void read_analysis(Reading& reading, TableReader& root) {
  reading.plan.analysis.duration = std::numeric_limits<double>::quiet_NaN();
  const Node* node = root.table("analysis");
  if (!node) {
    if (!root.has("analysis")) root.missing("analysis", "add [analysis] and under it duration = \"10 s\"");
    return;
  }
  TableReader table(*node, "analysis", reading.complaints);
  Analysis& a = reading.plan.analysis;
  a.duration = table.quantity("duration", Dimension::Time, limits::duration);
  const double chosen = std::numeric_limits<double>::quiet_NaN();  // by the engine
  const double step = table.quantity("step", Dimension::Time, limits::step, chosen);
  a.step = std::isnan(step) ? 0 : step;
  a.frame_rate = table.quantity("frame_rate", Dimension::Frequency, limits::frame_rate, a.frame_rate);
  a.gravity = table.quantity("gravity", Dimension::Acceleration, {0, 100, true}, a.gravity);
  a.seed =
      static_cast<std::uint64_t>(table.find_integer("seed", 0, std::numeric_limits<std::int64_t>::max()).value_or(1));
  table.finish();
}

}  // namespace topple::product
