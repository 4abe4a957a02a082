#include "product/read_fuzzy_values.h"

#include <fmt/format.h>

#include <limits>

#include "product/reading.h"

namespace topple::product {

namespace {

constexpr int most_samples = 100000000;
constexpr size_t most_corners = 50, most_levels = 50, most_cuts = 25;
constexpr Range anything{-1e12, 1e12};

/// Whether the list has from `least` to `most` items.
bool is_list(const Node& node, size_t least, size_t most) {
  return node.kind == Node::Kind::Array && node.items.size() >= least && node.items.size() <= most;
}

/// x rises, and μ rises from 0 to 1 and falls to 0.
void check_corners(const TableReader& table, Place where, const FuzzyValue& value) {
  bool rises = true, is_hill = true, has_top = false, falls = false;
  for (size_t i = 0; i < value.corners.size(); ++i) {
    const auto& [x, mu] = value.corners[i];
    has_top = has_top || mu == 1;
    if (i == 0) continue;
    rises = rises && x >= value.corners[i - 1].first;
    if (mu < value.corners[i - 1].second) falls = true;
    if (falls && mu > value.corners[i - 1].second) is_hill = false;
  }
  if (!rises)
    table.error("E207", where, "the values must rise from left to right",
                "the least possible value first, then the core, then the largest possible one");
  if (!has_top || !is_hill || value.corners.front().second != 0 || value.corners.back().second != 0)
    table.error("E207", where, "the membership must go from 0 up to 1 and down to 0");
}

}  // namespace

FuzzyUnits fuzzy_units(Dimension d) {
  switch (d) {
    case Dimension::Number:
      return {};
    case Dimension::Length:
      return {unit::mm, unit::cm, "cm", "m"};
    case Dimension::Area:
      return {unit::mm2, unit::cm2, "cm2", "m2"};
    case Dimension::AreaPerLength:
      return {unit::mm2, unit::cm2, "cm2/m", "m2/m"};
    case Dimension::Time:
      return {1, 1, "s", "s"};
    case Dimension::Mass:
      return {1, 1, "kg", "kg"};
    case Dimension::Force:
      return {1, unit::kN, "kN", "N"};
    case Dimension::AreaLoad:
      return {unit::MPa, unit::kPa, "kN/m2", "Pa"};
    case Dimension::Stress:
      return {unit::MPa, unit::MPa, "N/mm2", "Pa"};
    case Dimension::Density:
      return {1, 1, "kg/m3", "kg/m3"};
    case Dimension::Energy:
      return {1, 1, "J", "J"};
    case Dimension::EnergyPerArea:
      return {1e3, 1e3, "N/mm", "J/m2"};
    case Dimension::Velocity:
      return {unit::mm, unit::mm, "mm/s", "m/s"};
    case Dimension::Acceleration:
      return {1, 1, "m/s2", "m/s2"};
    case Dimension::Angle:
      return {1, unit::deg, "deg", "rad"};
    case Dimension::Frequency:
      return {1, 1, "Hz", "Hz"};
    case Dimension::StiffnessPerLength:
      return {1e3, 1e6, "kN/mm", "N/m"};
    case Dimension::Moment:
      return {1e-3, unit::kNm, "kNm", "Nm"};
  }
  return {};
}

std::pair<double, double> core_of(const FuzzyValue& v) {
  double left = std::numeric_limits<double>::quiet_NaN(), right = left;
  for (const auto& [x, mu] : v.corners) {
    if (mu != 1) continue;
    if (!(left <= x)) left = x;
    right = x;
  }
  return {left, right};
}

std::string text_of(const FuzzyValue& v, double x) {
  return fmt::format("{} = {:.6g}{}{}", v.name, x / v.unit, v.symbol.empty() ? "" : " ", v.symbol);
}

std::string find_fuzzy_way(const TableReader& table, Place where) {
  std::string way;
  int count = 0;
  for (const char* key : fuzzy_ways)
    if (table.has(key)) way = key, ++count;
  if (count == 1) return way;
  table.error("E207", where, "exactly one of triangular, trapezoidal, polygonal, tabulated, formula is wanted");
  return {};
}

void read_corners(TableReader& table, Dimension dimension, FuzzyValue& value) {
  const auto number = [&](const Node& node, const char* key) {
    return read_quantity(node, table.label() + ": " + key, dimension, anything, table.complaints());
  };
  const auto degree = [&](const Node& node, const std::string& words) {
    return read_quantity(node, table.label() + ": " + words, Dimension::Number, fraction, table.complaints());
  };
  const int errors_before = table.complaints().error_count();
  Place where = table.place();
  for (const auto& [key, count] : {std::pair{"triangular", 3U}, {"trapezoidal", 4U}}) {
    const Node* list = table.find(key);
    if (!list) continue;
    where = list->place;
    if (!is_list(*list, count, count)) {
      table.error("E202", list->place, fmt::format("{}: a list of {} values is wanted", key, count),
                  count == 3 ? "left end, core and right end" : "left end, core from, core to and right end");
      return;
    }
    for (size_t i = 0; i < count; ++i)
      value.corners.emplace_back(number(list->items[i], key), i == 0 || i + 1 == count ? 0 : 1);
  }
  if (const Node* list = table.find("polygonal")) {
    where = list->place;
    if (!is_list(*list, 3, most_corners)) {
      table.error("E202", list->place, "polygonal: a list of 3 to 50 corners is wanted",
                  "each a pair of the value and its membership, from 0 up to 1 and down to 0");
      return;
    }
    for (const Node& item : list->items) {
      if (!is_list(item, 2, 2)) {
        table.error("E202", item.place, "polygonal: a pair of a value and its membership is wanted");
        return;
      }
      value.corners.emplace_back(number(item.items[0], "polygonal"), degree(item.items[1], "polygonal: membership"));
    }
  }
  if (const Node* list = table.find("tabulated")) {
    where = list->place;
    const char* help = "each [alpha, left, right], alpha rising from 0 to 1";
    if (!is_list(*list, 2, most_cuts)) {
      table.error("E202", list->place, "tabulated: a list of 2 to 25 cuts is wanted", help);
      return;
    }
    std::vector<std::pair<double, double>> right;
    double last = -1;
    for (const Node& item : list->items) {
      if (!is_list(item, 3, 3)) {
        table.error("E202", item.place, "tabulated: a cut of three values is wanted", help);
        return;
      }
      const double alpha = degree(item.items[0], "tabulated: alpha");
      if (alpha <= last) table.error("E207", item.items[0].place, "tabulated: alpha must rise", help);
      last = alpha;
      value.corners.emplace_back(number(item.items[1], "tabulated"), alpha);
      right.emplace_back(number(item.items[2], "tabulated"), alpha);
    }
    value.corners.insert(value.corners.end(), right.rbegin(), right.rend());
  }
  if (table.complaints().error_count() == errors_before) check_corners(table, where, value);
}

std::vector<double> centre_of(const std::vector<FuzzyValue>& values) {
  std::vector<double> centre;
  for (const FuzzyValue& v : values) centre.push_back(0.5 * (core_of(v).first + core_of(v).second));
  return centre;
}

void try_ends(const std::vector<FuzzyValue>& values, const FuzzyRefusal& refusal, const std::string& prefix,
              const std::function<Place(const FuzzyValue&)>& place_of, Complaints& complaints) {
  const std::vector<double> centre = centre_of(values);
  for (size_t i = 0; i < values.size(); ++i) {
    const FuzzyValue& v = values[i];
    for (const double end : {v.corners.front().first, v.corners.back().first}) {
      std::vector<double> point = centre;
      point[i] = end;
      const std::string why = refusal(point);
      if (why.empty()) continue;
      complaints.error("E205", place_of(v),
                       fmt::format("{}{}: {} is not possible: {}", prefix, v.path, text_of(v, end), why));
      break;
    }
  }
}

RefusedCorners try_corners(const std::vector<FuzzyValue>& values, const FuzzyRefusal& refusal) {
  const auto is_crisp = [&](size_t i) { return values[i].corners.front().first == values[i].corners.back().first; };
  unsigned crisp = 0;  // has one end only
  for (size_t i = 0; i < values.size(); ++i) crisp |= is_crisp(i) ? 1U << i : 0;
  RefusedCorners out;
  int refused = 0, corners = 0;
  for (unsigned corner = 0; corner < 1U << values.size(); ++corner) {
    if (corner & crisp) continue;
    ++corners;
    std::vector<double> point;
    std::string words;
    for (size_t i = 0; i < values.size(); ++i) {
      const auto& hill = values[i].corners;
      point.push_back(corner >> i & 1U ? hill.back().first : hill.front().first);
      words.append(i ? ", " : "").append(text_of(values[i], point.back()));
    }
    const std::string why = refusal(point);
    if (why.empty()) continue;
    if (refused++ == 0) out.first = words.append(": ").append(why);
  }
  if (refused > 0) out.count = fmt::format("{} of {} corners", refused, corners);
  return out;
}

FuzzySearch read_search(TableReader& parent, bool is_of_plan) {
  FuzzySearch out;
  const Node* node = parent.table("search");
  if (!node) return out;
  TableReader table(*node, "search", parent.complaints());
  if (const Node* list = table.find("levels")) {
    if (!is_list(*list, 1, most_levels)) {
      table.error("E202", list->place, "levels: a list of 1 to 50 numbers is wanted", "such as [0, 0.5, 1]");
    } else {
      for (const Node& item : list->items)
        out.levels.push_back(read_quantity(item, "search: levels", Dimension::Number, fraction, parent.complaints()));
    }
  }
  out.limit = static_cast<int>(table.find_integer("samples", 10, most_samples).value_or(0));
  out.seed =
      static_cast<std::uint64_t>(table.find_integer("seed", 0, std::numeric_limits<std::int64_t>::max()).value_or(1));
  if (is_of_plan) out.after = table.quantity("after", Dimension::Time, {0.01, 600}, 0);
  table.finish();
  return out;
}

std::optional<Expression> parse_formula(const Node& node, size_t first, size_t count, const std::string& label,
                                        const std::vector<std::string>& names, Complaints& complaints) {
  const std::string text = node.text.substr(first, count);
  ExpressionFault fault;
  Expression e = Expression::parse(text, names, fault);
  if (fault.message.empty()) return e;
  Place place = node.place;
  place.column += 1 + static_cast<int>(first + fault.offset);  // behind the quotation mark
  place.width = std::max(1, std::min(place.width - 2 - static_cast<int>(first), static_cast<int>(text.size())) -
                                static_cast<int>(fault.offset));
  complaints.error("E208", place, label + ": " + fault.message, fault.help);
  return std::nullopt;
}

Expression read_formula(const Node& node, const std::string& path, const std::vector<std::string>& names,
                        Complaints& complaints) {
  return parse_formula(node, 0, std::string::npos, path + ": formula", names, complaints).value_or(Expression{});
}

}  // namespace topple::product
