#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "product/reading.h"

namespace topple::product {

namespace {

constexpr size_t most_shafts = 100, most_loads = 100;

bool is_plain(const std::string& name) {
  return !name.empty() && name.size() <= 40 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_'; });
}

void read_material(Reading& reading, TableReader& table, Shaft& s) {
  if (table.has("concrete")) {
    s.concrete = find_named(reading.concretes, table, "concrete", table.text("concrete"), "concrete");
    for (const char* key : {"density", "strength", "modulus"})
      if (table.find(key))
        table.error("E207", table.place_of(key), std::string(key) + ": belongs to masonry; the concrete has its own",
                    "leave it out, or leave out concrete");
  } else {
    table.find("concrete");
    s.density = table.quantity("density", Dimension::Density, {300, 10000});
    s.strength = table.quantity("strength", Dimension::Stress, {0.1 * unit::MPa, 200 * unit::MPa});
    s.modulus = table.quantity("modulus", Dimension::Stress, {0.1 * unit::GPa, 100 * unit::GPa});
  }
  constexpr Range reinforcement{0, 200 * unit::cm2};
  s.as_outer = table.quantity("as_outer", Dimension::AreaPerLength, reinforcement, 0);
  s.as_inner = table.quantity("as_inner", Dimension::AreaPerLength, reinforcement, 0);
  s.bar_diameter = table.quantity("bar_diameter", Dimension::Length, {4 * unit::mm, 80 * unit::mm}, 12 * unit::mm);
  s.cover = table.quantity("cover", Dimension::Length, {0, 0.5}, 30 * unit::mm);
  if (table.has("steel")) {
    s.steel = find_named(reading.steels, table, "steel", table.text("steel"), "steel");
  } else {
    table.find("steel");
    if (s.as_outer > 0 || s.as_inner > 0) table.missing("steel", "name the steel of its reinforcement");
  }
  if (const Node* node = table.table("hoops")) {
    TableReader hoops(*node, table.label() + ".hoops", table.complaints());
    s.hoop_diameter = hoops.quantity("diameter", Dimension::Length, {2 * unit::mm, 40 * unit::mm});
    s.hoop_spacing = hoops.quantity("spacing", Dimension::Length, {10 * unit::mm, 2});
    hoops.finish();
  }
}

void read_weights(TableReader& table, Shaft& s, double height) {
  if (const Node* node = table.table("lining")) {
    TableReader lining(*node, table.label() + ".lining", table.complaints());
    s.lining_thickness = lining.quantity("thickness", Dimension::Length, {0, 2});
    s.lining_density = lining.quantity("density", Dimension::Density, {100, 10000});
    lining.finish();
  }
  const std::vector<const Node*> loads = table.tables("load");
  if (loads.size() > most_loads) {
    table.error("E209", loads[most_loads]->place, "load: more than " + std::to_string(most_loads));
    return;
  }
  for (size_t i = 0; i < loads.size(); ++i) {
    TableReader load(*loads[i], table.label() + ".load[" + std::to_string(i) + "]", table.complaints());
    Shaft::Load l;
    l.at = load.quantity("at", Dimension::Length, {0, 1000});
    l.mass = load.quantity("weight", Dimension::Force, {0, 1e9, true}) / unit::gravity;
    load.finish();
    if (l.at > height) load.error("E306", load.place_of("at"), "at: lies above the top of the shaft");
    s.loads.push_back(l);
  }
}

void check_shape(const TableReader& table, const Shaft& s) {
  for (const double share : {0.0, 1.0}) {
    const char* key = share > 0 && table.has("thickness_top") ? "thickness_top" : "thickness";
    const double outer = s.outer(share), t = s.thickness(share);
    if (t >= 0.9 * outer) {
      table.error("E207", table.place_of(key),
                  std::string(key) + ": leaves no hollow inside; the wall may take 0.9 of the outer radius");
      return;
    }
    if (t + s.lining_thickness >= outer) {
      table.error("E207", table.place_of("lining"), "lining: fills the shaft");
      return;
    }
    if ((s.as_outer > 0 || s.as_inner > 0) && 2 * s.cover + s.bar_diameter >= t) {
      table.error("E207", table.place_of("cover"), "cover: leaves no room for the bars in this thickness");
      return;
    }
    if (s.as_outer + s.as_inner > 0.15 * t) {
      table.error("E207", table.place_of(key), "the bars take more than 15 % of the section");
      return;
    }
  }
}

constexpr double slack = 1e-9;  // round-off of sums of lengths [m]

/// Room that a member takes, upright prisms of rectangles [m].
struct Box {
  Vec3 low, high;
};

Box calc_box(const Plan& plan, const Member& m) {
  Vec3 half, low = m.start, high = m.end;
  const bool is_along_x = m.row_a != m.row_b;
  if (m.kind == MemberKind::Column || m.kind == MemberKind::Beam) {
    const Section& s = plan.sections[static_cast<size_t>(m.section)];
    if (m.kind == MemberKind::Column)
      half = {s.width / 2, s.height / 2, 0};
    else
      half = {is_along_x ? 0 : s.width / 2, is_along_x ? s.width / 2 : 0, s.height / 2};
  } else {
    const double t = plan.panels[static_cast<size_t>(m.panel)].thickness;
    if (m.kind == MemberKind::Slab)
      half.z = t / 2;
    else
      half = {is_along_x ? 0 : t / 2, is_along_x ? t / 2 : 0, 0}, high.z += m.height;
  }
  return {low - half, high + half};
}

/// A shaft and where it stands.
struct Standing {
  const Member& member;
  const Shaft& shaft;
  double outer(double z) const { return shaft.outer((z - member.start.z) / (member.end.z - member.start.z)); }
  double inner(double z) const {
    const double share = (z - member.start.z) / (member.end.z - member.start.z);
    return shaft.outer(share) - shaft.thickness(share) - shaft.lining_thickness;
  }
};

enum class Meeting { Apart, Inside, Overlaps };

/// Whether a box is apart from a shaft, inside its hollow, or neither.
Meeting compare(const Standing& s, const Box& b) {
  const double low = std::max(b.low.z, s.member.start.z), high = std::min(b.high.z, s.member.end.z);
  if (!(high - low > slack)) return Meeting::Apart;
  const Vec3& axis = s.member.start;
  const double near =
      std::hypot(axis.x - std::clamp(axis.x, b.low.x, b.high.x), axis.y - std::clamp(axis.y, b.low.y, b.high.y));
  if (!(near < std::max(s.outer(low), s.outer(high)) - slack)) return Meeting::Apart;
  const double far =
      std::hypot(std::max(axis.x - b.low.x, b.high.x - axis.x), std::max(axis.y - b.low.y, b.high.y - axis.y));
  return far <= std::min(s.inner(low), s.inner(high)) + slack ? Meeting::Inside : Meeting::Overlaps;
}

/// Whether shaft `a` is apart from `b`, inside its hollow, or neither; radii are linear, so the ends of the height that
/// they share decide.
Meeting compare(const Standing& a, const Standing& b) {
  const double low = std::max(a.member.start.z, b.member.start.z), high = std::min(a.member.end.z, b.member.end.z);
  const double apart = std::hypot(a.member.start.x - b.member.start.x, a.member.start.y - b.member.start.y);
  if (!(apart < std::max(a.outer(low) + b.outer(low), a.outer(high) + b.outer(high)) - slack)) return Meeting::Apart;
  for (const double z : {low, high})
    if (!(apart + a.outer(z) <= b.inner(z) + slack)) return Meeting::Overlaps;
  return Meeting::Inside;
}

}  // namespace

void check_shafts(Reading& reading) {
  const Plan& plan = reading.plan;
  const auto standing = [&](const Member& m) { return Standing{m, plan.shafts[static_cast<size_t>(m.shaft)]}; };
  for (const Member& m : plan.members) {
    if (m.kind != MemberKind::Shaft || m.removed) continue;
    std::vector<std::string> overlapped, held;
    const Member* holder = nullptr;
    for (const Member& other : plan.members) {
      if (&other == &m || other.removed) continue;
      if (other.kind != MemberKind::Shaft) {
        if (other.section < 0 && other.panel < 0) continue;
        const Meeting meeting = compare(standing(m), calc_box(plan, other));
        if (meeting == Meeting::Overlaps) overlapped.push_back(other.name);
        if (meeting == Meeting::Inside) held.push_back(other.name);
        continue;
      }
      const Meeting meeting = compare(standing(m), standing(other));
      if (meeting == Meeting::Inside) holder = &other;
      // of two shafts the later one is at fault
      if (meeting == Meeting::Overlaps && &other < &m && compare(standing(other), standing(m)) == Meeting::Overlaps)
        overlapped.push_back(other.name);
    }
    const Place place = reading.shaft_places[static_cast<size_t>(m.shaft)];
    if (!overlapped.empty())
      reading.complaints.error("E408", place, m.name + ": stands where others stand: " + list_of(overlapped),
                               "move it, or leave out what is not there");
    if (holder) reading.complaints.warn("W510", place, m.name + ": stands inside " + holder->name);
    if (!held.empty()) reading.complaints.warn("W510", place, list_of(held) + ": inside " + m.name);
  }
}

void read_shafts(Reading& reading, TableReader& root) {
  const std::vector<const Node*> nodes = root.tables("shafts");
  if (nodes.size() > most_shafts) {
    root.error("E209", nodes[most_shafts]->place, "more than " + std::to_string(most_shafts) + " shafts");
    return;
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    const int errors_before = reading.complaints.error_count();
    TableReader table(*nodes[i], "shafts[" + std::to_string(i) + "]", reading.complaints);
    Member m;
    Shaft s;
    m.kind = MemberKind::Shaft;
    m.where = reading.complaints.position(nodes[i]->place);
    m.name = table.text("name");
    if (!m.name.empty() && !is_plain(m.name))
      table.error("E208", table.place_of("name"), "name: " + quoted(m.name) + " cannot name a shaft",
                  "up to 40 letters, digits, - and _");
    if (reading.plan.find_member(m.name) >= 0)
      table.error("E208", table.place_of("name"), "name: " + quoted(m.name) + " is the name of another member");
    if (const Node* place = table.find("position")) {
      if (place->kind != Node::Kind::Array || place->items.size() != 2) {
        table.error("E202", place->place, "position: is not a list of two lengths",
                    "write x and y, such as position = [\"0 m\", \"0 m\"]");
      } else {
        for (int k = 0; k < 2; ++k)
          m.start[k] = read_quantity(place->items[static_cast<size_t>(k)], table.label() + ": position",
                                     Dimension::Length, {-1000, 1000}, reading.complaints);
      }
    }
    const double height = table.quantity("height", Dimension::Length, {2, 500});
    m.end = m.start + Vec3{0, 0, height};
    m.height = height;
    constexpr Range diameters{0.5, 100}, thicknesses{0.05, 5};
    s.diameter_foot = table.quantity("diameter", Dimension::Length, diameters);
    s.diameter_top = table.quantity("diameter_top", Dimension::Length, diameters, s.diameter_foot);
    s.thickness_foot = table.quantity("thickness", Dimension::Length, thicknesses);
    s.thickness_top = table.quantity("thickness_top", Dimension::Length, thicknesses, s.thickness_foot);
    read_material(reading, table, s);
    read_weights(table, s, height);
    const double spacing =
        table.quantity("joint_spacing", Dimension::Length, {0.5, 500}, std::numeric_limits<double>::quiet_NaN());
    s.joint_spacing = std::isnan(spacing) ? 0 : spacing;
    table.finish();
    if (table.is_table()) check_shape(table, s);
    // of a place that is not known nothing is said beside others
    if (reading.complaints.error_count() != errors_before)
      m.start.x = m.start.y = m.end.x = m.end.y = std::numeric_limits<double>::quiet_NaN();
    m.shaft = static_cast<int>(reading.plan.shafts.size());
    reading.shaft_places.push_back(table.place_of("position"));
    reading.plan.shafts.push_back(std::move(s));
    reading.plan.members.push_back(std::move(m));
  }
}

}  // namespace topple::product
