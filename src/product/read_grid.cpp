#include <algorithm>
#include <cmath>

#include "product/plan_limits.h"
#include "product/reading.h"

namespace topple::product {

namespace {

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// One direction of the grid, { A = "0 m", B = "4 m" }, names in rising order; false after a complaint.
bool read_lines(TableReader& grid, const std::string& key, bool letters, std::vector<std::string>& names,
                std::vector<double>& offsets) {
  const std::string help =
      letters ? "add rows = { A = \"0 m\", B = \"5 m\" }" : "add frames = { 1 = \"0 m\", 2 = \"5 m\" }";
  const Node* node = grid.table(key);
  if (!node) {
    if (!grid.has(key)) grid.missing(key, help);
    return false;
  }
  if (node->entries.empty() || node->entries.size() > limits::lines) {
    grid.error("E209", node->place, key + ": has " + std::to_string(node->entries.size()) + " lines",
               "allowed: between 1 and " + std::to_string(limits::lines));
    return false;
  }
  const int errors_before = grid.complaints().error_count();
  for (const Entry& entry : node->entries) {
    const bool is_name = !entry.key.empty() && entry.key.size() <= 6 &&
                         std::all_of(entry.key.begin(), entry.key.end(), letters ? is_letter : is_digit);
    if (!is_name)
      grid.error("E208", entry.place, key + ": " + quoted(entry.key) + " cannot name a " + (letters ? "row" : "frame"),
                 letters ? "rows are named by 1 to 6 letters" : "frames are named by 1 to 6 digits");
    const double offset = read_quantity(entry.value, grid.label() + ": " + key + "." + entry.key, Dimension::Length,
                                        limits::line_offset, grid.complaints());
    if (!offsets.empty() && offset < offsets.back() + limits::line_spacing)
      grid.error("E210", entry.value.place, key + "." + entry.key + ": is not at least 0.3 m beyond " + names.back(),
                 "the lines of a grid are given in rising order");
    names.push_back(entry.key);
    offsets.push_back(offset);
  }
  return grid.complaints().error_count() == errors_before && !grid.complaints().is_full();
}

/// A dead load on a floor, given as a weight [N/m²], as the mass [kg/m²] that has this weight on Earth.
double calc_floor_mass(double weight) { return weight / unit::gravity; }

bool read_storeys(Reading& reading, TableReader& root) {
  Plan& plan = reading.plan;
  const Node* node = root.table("storeys");
  if (!node) {
    if (!root.has("storeys")) root.missing("storeys", "add [storeys] with count = 3 and height = \"3 m\"");
    return false;
  }
  TableReader table(*node, "storeys", reading.complaints);
  const int errors_before = reading.complaints.error_count();
  if (table.has("heights")) {
    const Node* list = table.find("heights");
    for (const char* key : {"count", "height"})
      if (table.find(key))
        table.error("E207", table.place_of(key), std::string(key) + ": is not possible beside heights",
                    "either heights, or count and height");
    if (list->kind != Node::Kind::Array) {
      table.error("E202", list->place, "heights: is " + name_of(list->kind) + "; a list of lengths is wanted",
                  "write heights = [\"4 m\", \"3 m\"] from the ground upwards");
    } else if (list->items.empty() || list->items.size() > most_storeys) {
      table.error("E209", list->place, "heights: has " + std::to_string(list->items.size()) + " storeys",
                  "allowed: between 1 and " + std::to_string(most_storeys));
    } else {
      for (const Node& item : list->items)
        plan.storey_heights.push_back(
            read_quantity(item, "storeys: heights", Dimension::Length, limits::storey_height, reading.complaints));
    }
  } else {
    const auto count = static_cast<size_t>(table.integer("count", 1, most_storeys));
    plan.storey_heights.assign(count, table.quantity("height", Dimension::Length, limits::storey_height));
    table.find("heights");
  }
  constexpr Range loads{0, 100e3};
  plan.storey_loads.assign(plan.storey_heights.size(), 0);
  if (const Node* load = table.find("load")) {
    reading.load_place = load->place;
    if (load->kind != Node::Kind::Array) {
      const double weight = read_quantity(*load, "storeys: load", Dimension::AreaLoad, loads, reading.complaints);
      plan.storey_loads.assign(plan.storey_heights.size(), calc_floor_mass(weight));
    } else if (load->items.size() != plan.storey_heights.size()) {
      if (!plan.storey_heights.empty())
        table.error("E205", load->place,
                    "load: has " + std::to_string(load->items.size()) + " values for " +
                        std::to_string(plan.storey_heights.size()) + " storeys",
                    "one value for all, or one for each storey from the ground upwards");
    } else {
      for (size_t i = 0; i < load->items.size(); ++i)
        plan.storey_loads[i] = calc_floor_mass(
            read_quantity(load->items[i], "storeys: load", Dimension::AreaLoad, loads, reading.complaints));
    }
  } else {
    plan.storey_loads.assign(plan.storey_heights.size(),
                             calc_floor_mass(table.quantity("load", Dimension::AreaLoad, loads, 0)));
  }
  table.finish();
  return !plan.storey_heights.empty() && reading.complaints.error_count() == errors_before;
}

}  // namespace

void read_grid(Reading& reading, TableReader& root) {
  Plan& plan = reading.plan;
  if (root.has("shafts") && !root.has("grid") && !root.has("storeys")) {
    reading.has_grid = true;  // nothing stands on one
    return;
  }
  bool has_lines = false;
  const Node* node = root.table("grid");
  if (node) {
    TableReader grid(*node, "grid", reading.complaints);
    const bool has_rows = read_lines(grid, "rows", true, plan.row_names, plan.row_offsets);
    const bool has_frames = read_lines(grid, "frames", false, plan.frame_names, plan.frame_offsets);
    grid.finish();
    has_lines = has_rows && has_frames;
  } else if (!root.has("grid")) {
    root.missing("grid",
                 "add [grid] with rows = { A = \"0 m\", B = \"5 m\" } and frames = { 1 = \"0 m\", 2 = \"5 m\" }");
  }
  reading.has_grid = read_storeys(reading, root) && has_lines;
  const size_t points = plan.row_names.size() * plan.frame_names.size() * plan.storey_heights.size();
  if (reading.has_grid && points > most_members) {
    root.error("E209", node->place, "grid: " + std::to_string(points) + " grid points over all storeys are too many",
               "allowed: at most " + std::to_string(most_members));
    reading.has_grid = false;
  }
}

}  // namespace topple::product
