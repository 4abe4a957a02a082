#include <algorithm>
#include <cctype>
#include <cmath>

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

}  // namespace

void read_shafts(Reading& reading, TableReader& root) {
  const std::vector<const Node*> nodes = root.tables("shafts");
  if (nodes.size() > most_shafts) {
    root.error("E209", nodes[most_shafts]->place, "more than " + std::to_string(most_shafts) + " shafts");
    return;
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
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
    s.joint_spacing = table.quantity("joint_spacing", Dimension::Length, {0.5, 500}, 0);
    table.finish();
    if (table.is_table()) check_shape(table, s);
    m.shaft = static_cast<int>(reading.plan.shafts.size());
    reading.plan.shafts.push_back(std::move(s));
    reading.plan.members.push_back(std::move(m));
  }
}

}  // namespace topple::product
