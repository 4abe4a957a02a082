#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "product/plan_limits.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double pi = 3.14159265358979323846;
constexpr size_t most_named = 1000;

/// The entries of `[key.NAME]`, with NAMEs that can be used in a plan.
std::vector<const Entry*> named_tables(TableReader& root, const std::string& key, bool required) {
  std::vector<const Entry*> list;
  const Node* node = root.table(key);
  if (!node) {
    if (required && !root.has(key)) root.missing(key, "describe one under [" + key + ".NAME]");
    return list;
  }
  if (node->entries.size() > most_named) {
    root.error("E209", node->place, key + ": more than " + std::to_string(most_named) + " entries");
    return list;
  }
  for (const Entry& entry : node->entries) {
    if (entry.key.empty() || entry.key.size() > 64) {
      root.error("E208", entry.place, key + ": a name has 1 to 64 characters");
    } else if (entry.value.kind != Node::Kind::Table) {
      root.error("E202", entry.place,
                 key + "." + entry.key + ": is " + name_of(entry.value.kind) + "; a table is wanted",
                 "write [" + key + ".NAME], then one key a line");
    } else {
      list.push_back(&entry);
    }
  }
  return list;
}

Concrete read_concrete(const Entry& entry, Complaints& complaints) {
  TableReader table(entry.value, "concrete." + entry.key, complaints);
  Concrete c;
  c.name = entry.key;
  c.fc = table.quantity("fc", Dimension::Stress, {1 * unit::MPa, 200 * unit::MPa});
  const std::optional<double> fct = table.find_quantity("fct", Dimension::Stress, {0, 20 * unit::MPa, true});
  if (fct) {
    c.fct = *fct;
  } else if (c.fc <= 8 * unit::MPa) {
    table.error("E207", table.place_of("fc"), "fct: cannot be derived from an fc of 8 N/mm2 or less",
                "add a line such as fct = \"0.4 N/mm2\"");
  } else {
    c.fct = 1.40 * unit::MPa * std::pow((c.fc / unit::MPa - 8) / 10, 2.0 / 3);
  }
  c.Ec = table.quantity("Ec", Dimension::Stress, {1 * unit::GPa, 100 * unit::GPa});
  c.eps_c1 = table.quantity("eps_c1", Dimension::Number, {0.0005, 0.02}, 2.2e-3);
  c.Gf = table.quantity("Gf", Dimension::EnergyPerArea, {1, 5000}, 73 * std::pow(c.fc / unit::MPa, 0.18));
  c.Gcl = table.quantity("Gcl", Dimension::EnergyPerArea, {100, 1e6}, 15e3);
  c.density = table.quantity("density", Dimension::Density, {300, 10000}, 2500);
  table.finish();
  // the rising branch starts with the slope Ec and must reach fc before it would as a straight line
  if (const double least = limits::least_peak_strain * c.fc / c.Ec; c.eps_c1 < least)
    table.error("E207", table.place_of(table.has("eps_c1") ? "eps_c1" : "Ec"),
                fmt::format("the strain at the peak, eps_c1, must be at least {:g} fc / Ec", limits::least_peak_strain),
                fmt::format("with these values eps_c1 must be {:.6f} or more", std::ceil(1e6 * least) / 1e6));
  if (fct && *fct >= c.fc) table.error("E207", table.place_of("fct"), "fct must be smaller than fc");
  return c;
}

Steel read_steel(const Entry& entry, Complaints& complaints) {
  TableReader table(entry.value, "steel." + entry.key, complaints);
  Steel s;
  s.name = entry.key;
  s.fy = table.quantity("fy", Dimension::Stress, {50 * unit::MPa, 2000 * unit::MPa});
  s.fu = table.quantity("fu", Dimension::Stress, {50 * unit::MPa, 3000 * unit::MPa});
  s.Es = table.quantity("Es", Dimension::Stress, {50 * unit::GPa, 300 * unit::GPa}, 200 * unit::GPa);
  s.eps_u = table.quantity("eps_u", Dimension::Number, {0.001, 0.5});
  table.finish();
  if (s.fu < s.fy) table.error("E207", table.place_of("fu"), "fu must not be smaller than fy");
  if (s.eps_u <= s.fy / s.Es) table.error("E207", table.place_of("eps_u"), "eps_u must be larger than fy / Es");
  return s;
}

/// Bars of one kind, "6 x 25 mm".
struct Layer {
  int count = 0;
  double diameter = nan;
};

Layer read_layer(TableReader& table, const std::string& key) {
  const Node* node = table.find(key);
  if (!node) return {};
  const std::string help = "write it as count x diameter, such as \"6 x 25 mm\"";
  if (node->kind != Node::Kind::String) {
    table.error("E202", node->place, key + ": is " + name_of(node->kind) + "; bars are wanted", help);
    return {};
  }
  const std::string& text = node->text;
  int count = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), count);
  size_t at = static_cast<size_t>(end - text.data());
  while (at < text.size() && text[at] == ' ') ++at;
  size_t times = 0;
  if (text.compare(at, 1, "x") == 0) times = 1;
  if (text.compare(at, 2, "\u00D7") == 0) times = 2;
  if (failure != std::errc{} || times == 0) {
    table.error("E208", node->place, key + ": " + quoted(text) + " does not name bars", help);
    return {};
  }
  if (count < 0 || count > limits::bars) {
    table.error("E205", node->place, key + ": " + std::to_string(count) + " bars are out of range",
                "allowed: between 0 and " + std::to_string(limits::bars));
    return {};
  }
  Node diameter = *node;
  diameter.text = text.substr(at + times);
  return {count, read_quantity(diameter, table.label() + ": " + key, Dimension::Length, limits::bar_diameter,
                               table.complaints())};
}

double circle(double diameter) { return pi * diameter * diameter / 4; }

/// The i-th of `count` places spread evenly from -extent to extent.
double spread(int i, int count, double extent) { return count == 1 ? 0 : extent * (2.0 * i / (count - 1) - 1); }

/// Complains unless `count` bars find room side by side between the ties.
void check_room(const TableReader& table, Place place, int count, double diameter, double extent, const char* side) {
  if (!have_room(count, diameter, extent))
    table.error("E207", place,
                std::to_string(count) + " bars do not fit into the " + side + " of the section between its ties",
                "fewer or thinner bars, less cover, or a larger section");
}

void read_bars(TableReader& table, Section& s) {
  const double inset = s.cover + s.tie_diameter;
  if (2 * inset >= std::min(s.width, s.height)) {
    for (const char* key : {"bars", "top", "bottom"}) table.find(key);
    table.error("E207", table.place_of("cover"), "cover: leaves no room for bars between the ties of this section",
                "cover and ties of both sides must be less than its width and its height");
    return;
  }
  if (table.has("bars")) {
    const Node* node = table.table("bars");
    if (!node) return;
    TableReader bars(*node, table.label() + ".bars", table.complaints());
    const int count_y = static_cast<int>(bars.integer("count_y", 2, limits::bars));
    const int count_z = static_cast<int>(bars.integer("count_z", 2, limits::bars));
    const double diameter = bars.quantity("diameter", Dimension::Length, limits::bar_diameter);
    bars.finish();
    const double y = s.width / 2 - inset - diameter / 2, z = s.height / 2 - inset - diameter / 2;
    check_room(table, node->place, count_y, diameter, y, "width");
    check_room(table, node->place, count_z, diameter, z, "height");
    for (int i = 0; i < count_y; ++i)
      for (int k = 0; k < count_z; ++k)
        if (i == 0 || k == 0 || i == count_y - 1 || k == count_z - 1)
          s.bars.push_back({spread(i, count_y, y), spread(k, count_z, z), circle(diameter), diameter});
  }
  for (const bool is_top : {true, false}) {
    const char* key = is_top ? "top" : "bottom";
    const Layer layer = read_layer(table, key);
    if (table.has(key) && table.has("bars"))
      table.error("E207", table.place_of(key), std::string(key) + ": is not possible beside bars",
                  "either bars around the section, or layers at the top and the bottom");
    // a face whose line was forgotten is not one without bars
    if (!table.has(key) && table.has(is_top ? "bottom" : "top") && !table.has("bars"))
      table.missing(key, fmt::format("add {0} = \"4 x 20 mm\", or {0} = \"0 x 20 mm\" for a face without bars", key));
    if (layer.count == 0) continue;
    const double y = s.width / 2 - inset - layer.diameter / 2, z = s.height / 2 - inset - layer.diameter / 2;
    check_room(table, table.place_of(key), layer.count, layer.diameter, y, "width");
    check_room(table, table.place_of(key), 1, layer.diameter, z, "height");
    for (int i = 0; i < layer.count; ++i)
      s.bars.push_back({spread(i, layer.count, y), is_top ? z : -z, circle(layer.diameter), layer.diameter});
  }
  const auto overlap = [](const Bar& a, const Bar& b) {
    return a.z != b.z && std::hypot(a.y - b.y, a.z - b.z) < 0.5 * (a.diameter + b.diameter) - 1e-9;
  };
  if (!table.has("bars") && std::any_of(s.bars.begin(), s.bars.end(), [&](const Bar& a) {
        return std::any_of(s.bars.begin(), s.bars.end(), [&](const Bar& b) { return overlap(a, b); });
      }))
    table.error("E207", table.place_of("bottom"), "bottom: its bars overlap those at the top",
                "make the section higher, the cover less, or the bars thinner");
  if (!table.has("bars") && !table.has("top") && !table.has("bottom"))
    table.missing("bars",
                  "add bars = { count_y = 3, count_z = 3, diameter = \"20 mm\" }, or top = \"4 x 20 mm\" and bottom");
}

Section read_section(Reading& reading, const Entry& entry) {
  TableReader table(entry.value, "section." + entry.key, reading.complaints);
  Section s;
  s.name = entry.key;
  s.width = table.quantity("width", Dimension::Length, limits::section_size);
  s.height = table.quantity("height", Dimension::Length, limits::section_size);
  s.concrete = find_named(reading.concretes, table, "concrete", table.text("concrete"), "concrete");
  s.steel = find_named(reading.steels, table, "steel", table.text("steel"), "steel");
  s.cover = table.quantity("cover", Dimension::Length, {0, 0.5});
  if (const Node* node = table.table("ties")) {
    TableReader ties(*node, table.label() + ".ties", reading.complaints);
    s.tie_diameter = ties.quantity("diameter", Dimension::Length, limits::tie_diameter);
    s.tie_spacing = ties.quantity("spacing", Dimension::Length, limits::tie_spacing);
    const std::int64_t legs = ties.find_integer("legs", 2, 50).value_or(2);
    s.tie_legs_y = static_cast<int>(ties.find_integer("legs_y", 2, 50).value_or(legs));
    s.tie_legs_z = static_cast<int>(ties.find_integer("legs_z", 2, 50).value_or(legs));
    ties.finish();
  } else if (!table.has("ties")) {
    table.missing("ties", "add ties = { diameter = \"10 mm\", spacing = \"20 cm\" }");
  }
  read_bars(table, s);
  if (const auto area = table.find_quantity("steel_area", Dimension::Area, {0.1 * unit::cm2, 1})) {
    // the measured steel area in bars of the drawn places: every bar grows or shrinks alike
    if (s.bars.empty())
      table.error("E207", table.place_of("steel_area"), "steel_area: there are no bars to hold it",
                  "give bars at their places, as drawn; the area says what they have in all");
    const double ratio = *area / s.steel_area();
    for (Bar& bar : s.bars) bar.area *= ratio, bar.diameter *= std::sqrt(ratio);
  }
  table.finish();
  if (s.steel_area() > most_steel * s.area())
    table.error("E207", table.place_of(table.has("steel_area") ? "steel_area" : "bars"),
                "the bars take more than 15 % of the section");
  return s;
}

Panel read_panel(Reading& reading, const Entry& entry, bool is_wall) {
  TableReader table(entry.value, (is_wall ? "wall." : "slab.") + entry.key, reading.complaints);
  Panel p;
  p.name = entry.key;
  p.thickness = table.quantity("thickness", Dimension::Length, limits::panel_thickness);
  const bool is_masonry = is_wall && !table.has("concrete");
  if (is_masonry) {
    table.find("concrete");
    p.density = table.quantity("density", Dimension::Density, {300, 10000});
    p.strength = table.quantity("strength", Dimension::Stress, {0.1 * unit::MPa, 200 * unit::MPa});
    p.modulus = table.quantity("modulus", Dimension::Stress, {0.1 * unit::GPa, 100 * unit::GPa});
  } else {
    p.concrete = find_named(reading.concretes, table, "concrete", table.text("concrete"), "concrete");
    if (p.concrete >= 0) {
      const Concrete& c = reading.plan.concretes[static_cast<size_t>(p.concrete)];
      p.density = c.density, p.strength = c.fc, p.modulus = c.Ec;
    }
    for (const char* key : {"density", "strength", "modulus"})
      if (is_wall && table.find(key))
        table.error("E207", table.place_of(key), std::string(key) + ": belongs to masonry; the concrete has its own",
                    "leave it out, or leave out concrete");
  }
  constexpr Range reinforcement{0, 200 * unit::cm2};
  if (is_wall) {
    p.as_top = p.as_bottom = table.quantity("as_faces", Dimension::AreaPerLength, reinforcement, 0);
  } else {
    p.as_top = table.quantity("as_top", Dimension::AreaPerLength, reinforcement, 0);
    p.as_bottom = table.quantity("as_bottom", Dimension::AreaPerLength, reinforcement, 0);
  }
  p.cover = table.quantity("cover", Dimension::Length, {0, 0.5}, 20 * unit::mm);
  const bool is_reinforced = p.as_top > 0 || p.as_bottom > 0;
  if (table.has("steel")) {
    p.steel = find_named(reading.steels, table, "steel", table.text("steel"), "steel");
  } else {
    table.find("steel");
    if (is_reinforced) table.missing("steel", "name the steel of its reinforcement");
  }
  table.finish();
  if (is_reinforced && 2 * p.cover >= p.thickness)
    table.error("E207", table.place_of("cover"), "cover: leaves no room for the reinforcement in this thickness");
  return p;
}

}  // namespace

bool have_room(int count, double diameter, double extent) {
  return !(count > 1 ? 2 * extent / (count - 1) < diameter : extent < 0);
}

int find_named(const std::map<std::string, int>& known, const TableReader& table, const std::string& key,
               const std::string& name, const std::string& what) {
  if (name.empty()) return -1;
  const auto it = known.find(name);
  if (it != known.end()) return it->second;
  std::vector<std::string> names;
  for (const auto& [n, index] : known) names.push_back(n);
  table.error("E301", table.place_of(key), key + ": there is no " + what + " " + quoted(name),
              did_you_mean(name, names, names.empty() ? "none is described" : "described are: " + list_of(names)));
  return -1;
}

void read_materials(Reading& reading, TableReader& root) {
  for (const Entry* entry : named_tables(root, "concrete", !root.has("shafts"))) {
    reading.concretes[entry->key] = static_cast<int>(reading.plan.concretes.size());
    reading.plan.concretes.push_back(read_concrete(*entry, reading.complaints));
  }
  for (const Entry* entry : named_tables(root, "steel", !root.has("shafts"))) {
    reading.steels[entry->key] = static_cast<int>(reading.plan.steels.size());
    reading.plan.steels.push_back(read_steel(*entry, reading.complaints));
  }
}

void read_sections(Reading& reading, TableReader& root) {
  for (const Entry* entry : named_tables(root, "section", !root.has("shafts"))) {
    reading.sections[entry->key] = static_cast<int>(reading.plan.sections.size());
    reading.plan.sections.push_back(read_section(reading, *entry));
    reading.section_places.push_back(entry->place);
  }
  reading.section_is_used.assign(reading.plan.sections.size(), false);
}

void read_panels(Reading& reading, TableReader& root) {
  for (const bool is_wall : {false, true})
    for (const Entry* entry : named_tables(root, is_wall ? "wall" : "slab", false)) {
      if (is_wall && reading.slabs.count(entry->key))
        root.error("E208", entry->place, "wall." + entry->key + ": a slab has this name already");
      (is_wall ? reading.walls : reading.slabs)[entry->key] = static_cast<int>(reading.plan.panels.size());
      reading.plan.panels.push_back(read_panel(reading, *entry, is_wall));
      reading.panel_places.push_back(entry->place);
    }
  reading.panel_is_used.assign(reading.plan.panels.size(), false);
}

}  // namespace topple::product
