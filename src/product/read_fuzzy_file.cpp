#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "product/fuzzy_file.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr int most_inputs = 20, most_corner_inputs = 10, most_samples = 1000000;
constexpr size_t most_corners = 50, most_levels = 50;

/// A value of a section file that may be fuzzy.
struct Target {
  const char* path;
  const char* name;  // in formulas
  Dimension dimension;
  double (*value)(const SectionFile&);  // what a formula sees when it is not fuzzy; nullptr: nothing
};

constexpr Target targets[] = {
    {"concrete.fc", "fc", Dimension::Stress, [](const SectionFile& f) { return f.concrete.fc; }},
    {"concrete.fct", "fct", Dimension::Stress, nullptr},  // may follow from fc
    {"concrete.Ec", "Ec", Dimension::Stress, [](const SectionFile& f) { return f.concrete.Ec; }},
    {"concrete.eps_c1", "eps_c1", Dimension::Number, [](const SectionFile& f) { return f.concrete.eps_c1; }},
    {"concrete.Gf", "Gf", Dimension::EnergyPerArea, nullptr},  // may follow from fc
    {"concrete.Gcl", "Gcl", Dimension::EnergyPerArea, [](const SectionFile& f) { return f.concrete.Gcl; }},
    {"steel.fy", "fy", Dimension::Stress, [](const SectionFile& f) { return f.steel.fy; }},
    {"steel.fu", "fu", Dimension::Stress, [](const SectionFile& f) { return f.steel.fu; }},
    {"steel.Es", "Es", Dimension::Stress, [](const SectionFile& f) { return f.steel.Es; }},
    {"steel.eps_u", "eps_u", Dimension::Number, [](const SectionFile& f) { return f.steel.eps_u; }},
    {"section.width", "width", Dimension::Length, [](const SectionFile& f) { return f.section.width; }},
    {"section.height", "height", Dimension::Length, [](const SectionFile& f) { return f.section.height; }},
    {"section.cover", "cover", Dimension::Length, [](const SectionFile& f) { return f.section.cover; }},
    {"section.steel_area", "steel_area", Dimension::Area, [](const SectionFile& f) { return f.section.steel_area(); }},
    {"section.ties.diameter", "ties_diameter", Dimension::Length,
     [](const SectionFile& f) { return f.section.tie_diameter; }},
    {"section.ties.spacing", "ties_spacing", Dimension::Length,
     [](const SectionFile& f) { return f.section.tie_spacing; }},
    {"section.bars.diameter", "bars_diameter", Dimension::Length, nullptr},
    {"zone.length", "length", Dimension::Length, [](const SectionFile& f) { return f.length; }},
    {"zone.cut_bars", "cut_bars", Dimension::Number, [](const SectionFile& f) { return f.cut_bars; }},
    {"zone.cut_concrete", "cut_concrete", Dimension::Number, [](const SectionFile& f) { return f.cut_concrete; }},
    {"zone.transition_damage", "transition_damage", Dimension::Number,
     [](const SectionFile& f) { return f.concrete_loss; }},
};

const char* si_name(Dimension d) {
  switch (d) {
    case Dimension::Stress:
      return "Pa";
    case Dimension::Length:
      return "m";
    case Dimension::Area:
      return "m2";
    case Dimension::EnergyPerArea:
      return "J/m2";
    default:
      return "";
  }
}

/// Units of formulas, N and mm, and those that people read in results.
struct Units {
  double formula = 1, shown = 1;
  const char* symbol = "";
};
Units units_of_target(Dimension d) {
  switch (d) {
    case Dimension::Stress:
      return {unit::MPa, unit::MPa, "N/mm2"};
    case Dimension::Length:
      return {unit::mm, unit::cm, "cm"};
    case Dimension::Area:
      return {unit::mm2, unit::cm2, "cm2"};
    case Dimension::EnergyPerArea:
      return {1e3, 1e3, "N/mm"};
    default:
      return {};
  }
}

const Target* find_target(const std::string& path) {
  for (const Target& t : targets)
    if (path == t.path) return &t;
  return nullptr;
}

struct Reader {
  const SectionFile& section;
  FuzzyFile& out;
  Complaints& complaints;
  std::vector<const Node*> formula_nodes;

  void read_group(TableReader& root, const std::string& group);
  void read_value(const Entry&, const std::string& path);
  void read_corners(TableReader&, const Target&, FuzzyValue&);
  bool find_place(const Target&, Place, ValuePlace&);
  void read_search(TableReader& root);
  void parse_formulas();
  void try_samples(std::vector<Diagnostic>& warnings);
};

/// Where the value stands in the section's document: the material's and the section's name come in between.
bool Reader::find_place(const Target& t, Place where, ValuePlace& place) {
  std::vector<std::string> keys;
  const std::string path = t.path;
  for (size_t begin = 0; begin <= path.size();) {
    const size_t end = std::min(path.find('.', begin), path.size());
    keys.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  const std::string& group = keys.front();
  const std::string name = group == "concrete"  ? section.concrete.name
                           : group == "steel"   ? section.steel.name
                           : group == "section" ? section.section.name
                                                : std::string();
  if (!name.empty()) keys.insert(keys.begin() + 1, name);
  if (keys.size() > 3 && group == "section") {
    const Node* node = &out.section;
    for (size_t i = 0; i + 1 < keys.size(); ++i) {
      const Entry* entry = node->find(keys[i]);
      if (!entry || entry->value.kind != Node::Kind::Table) {
        complaints.error("E302", where, std::string(t.path) + ": the section has no " + quoted(keys[i]));
        return false;
      }
      node = &entry->value;
    }
  }
  place = {keys, si_name(t.dimension)};
  return true;
}

void Reader::read_corners(TableReader& table, const Target& t, FuzzyValue& value) {
  constexpr Range anything{-1e12, 1e12};
  const auto number = [&](const Node& node, const char* key) {
    return read_quantity(node, table.label() + ": " + key, t.dimension, anything, complaints);
  };
  const int errors_before = complaints.error_count();
  Place where = table.place();
  for (const auto& [key, count] : {std::pair{"triangular", 3U}, {"trapezoidal", 4U}}) {
    const Node* list = table.find(key);
    if (!list) continue;
    where = list->place;
    if (list->kind != Node::Kind::Array || list->items.size() != count) {
      table.error("E202", list->place, fmt::format("{}: a list of {} values is wanted", key, count),
                  count == 3 ? "left end, core and right end" : "left end, core from, core to and right end");
      return;
    }
    for (size_t i = 0; i < count; ++i)
      value.corners.emplace_back(number(list->items[i], key), i == 0 || i + 1 == count ? 0 : 1);
  }
  if (const Node* list = table.find("polygonal")) {
    where = list->place;
    if (list->kind != Node::Kind::Array || list->items.size() < 3 || list->items.size() > most_corners) {
      table.error("E202", list->place, "polygonal: a list of 3 to 50 corners is wanted",
                  "each a pair of the value and its membership, from 0 up to 1 and down to 0");
      return;
    }
    for (const Node& item : list->items) {
      if (item.kind != Node::Kind::Array || item.items.size() != 2) {
        table.error("E202", item.place, "polygonal: a pair of a value and its membership is wanted");
        return;
      }
      value.corners.emplace_back(number(item.items[0], "polygonal"),
                                 read_quantity(item.items[1], table.label() + ": polygonal: membership",
                                               Dimension::Number, fraction, complaints));
    }
  }
  if (complaints.error_count() != errors_before) return;
  bool rises = true, is_hill = true, has_top = false, falls = false;
  for (size_t i = 0; i < value.corners.size(); ++i) {
    const auto& [x, mu] = value.corners[i];
    has_top = has_top || mu == 1;
    if (i == 0) continue;
    rises = rises && x >= value.corners[i - 1].first;
    if (mu < value.corners[i - 1].second) falls = true;
    if (falls && mu > value.corners[i - 1].second) is_hill = false;
  }
  if (!rises) table.error("E207", where, "the values must rise from left to right");
  if (!has_top || !is_hill || value.corners.front().second != 0 || value.corners.back().second != 0)
    table.error("E207", where, "the membership must go from 0 up to 1 and down to 0");
}

void Reader::read_value(const Entry& entry, const std::string& path) {
  const Target* t = find_target(path);
  if (!t) {
    std::vector<std::string> known;
    for (const Target& k : targets) known.emplace_back(k.path);
    complaints.error("E203", entry.place, quoted(path) + " is no value of a section that can be fuzzy",
                     did_you_mean(path, known, "known here: " + list_of(known)));
    return;
  }
  if (entry.value.kind != Node::Kind::Table) {
    complaints.error("E202", entry.value.place, path + ": is " + name_of(entry.value.kind) + "; a table is wanted",
                     "{ triangular = [left, core, right] }, trapezoidal, polygonal, or { formula = \"...\" }");
    return;
  }
  TableReader table(entry.value, path, complaints);
  int ways = 0;
  for (const char* key : {"triangular", "trapezoidal", "polygonal", "formula"}) ways += table.has(key);
  ValuePlace place;
  const bool has_place = find_place(*t, entry.place, place);
  const Units units = units_of_target(t->dimension);
  if (ways == 1 && table.has("formula")) {
    DerivedValue d;
    d.path = path, d.name = t->name, d.symbol = units.symbol, d.unit = units.shown;
    d.where = complaints.position(entry.place);
    d.text = table.text("formula");
    formula_nodes.push_back(table.find("formula"));
    out.derived.push_back(std::move(d));
  } else if (ways == 1) {
    FuzzyValue v;
    v.path = path, v.name = t->name, v.symbol = units.symbol, v.unit = units.shown;
    v.where = complaints.position(entry.place);
    read_corners(table, *t, v);
    // inputs stand before derived values
    if (has_place) out.places.insert(out.places.begin() + static_cast<std::ptrdiff_t>(out.inputs.size()), place);
    out.inputs.push_back(std::move(v));
  }
  if (ways == 1 && table.has("formula") && has_place) out.places.push_back(place);
  table.finish();
  if (ways != 1)
    complaints.error("E207", entry.place,
                     path + ": exactly one of triangular, trapezoidal, polygonal, formula is wanted");
}

void Reader::read_group(TableReader& root, const std::string& group) {
  const Node* node = root.table(group);
  if (!node) return;
  for (const Entry& entry : node->entries) {
    const std::string path = group + "." + entry.key;
    if (group == "section" && (entry.key == "ties" || entry.key == "bars") && entry.value.kind == Node::Kind::Table) {
      for (const Entry& inner : entry.value.entries) read_value(inner, path + "." + inner.key);
    } else {
      read_value(entry, path);
    }
  }
}

void Reader::read_search(TableReader& root) {
  const Node* node = root.table("search");
  if (!node) return;
  TableReader table(*node, "search", complaints);
  if (const Node* list = table.find("levels")) {
    if (list->kind != Node::Kind::Array || list->items.empty() || list->items.size() > most_levels) {
      table.error("E202", list->place, "levels: a list of 1 to 50 numbers is wanted", "such as [0, 0.5, 1]");
    } else {
      for (const Node& item : list->items)
        out.levels.push_back(read_quantity(item, "search: levels", Dimension::Number, fraction, complaints));
    }
  }
  out.limit = static_cast<int>(table.find_integer("samples", 10, most_samples).value_or(0));
  out.seed =
      static_cast<std::uint64_t>(table.find_integer("seed", 0, std::numeric_limits<std::int64_t>::max()).value_or(1));
  table.finish();
}

/// Formulas may use fuzzy inputs and the other values of the section.
void Reader::parse_formulas() {
  std::vector<std::string> names;
  const auto formula_unit = [&](const std::string& path) {
    return units_of_target(find_target(path)->dimension).formula;
  };
  for (const FuzzyValue& v : out.inputs) names.push_back(v.name), out.formula_unit.push_back(formula_unit(v.path));
  for (const DerivedValue& d : out.derived) out.formula_unit.push_back(formula_unit(d.path));
  for (const Target& t : targets) {
    const auto is_it = [&t](const auto& v) { return v.path == t.path; };
    if (!t.value || std::any_of(out.inputs.begin(), out.inputs.end(), is_it) ||
        std::any_of(out.derived.begin(), out.derived.end(), is_it))
      continue;
    names.emplace_back(t.name);
    out.crisp.push_back(t.value(section) / formula_unit(t.path));
  }
  for (size_t i = 0; i < out.derived.size(); ++i) {
    DerivedValue& d = out.derived[i];
    if (d.text.empty()) continue;
    ExpressionFault fault;
    d.expression = Expression::parse(d.text, names, fault);
    if (fault.message.empty()) continue;
    Place place = formula_nodes[i]->place;
    place.column += 1 + static_cast<int>(fault.offset);  // behind the quotation mark
    complaints.error("E208", place, d.path + ": formula: " + fault.message, fault.help);
  }
}

/// A value in the words of the file.
std::string text_of(const FuzzyValue& v, double x) {
  return fmt::format("{} = {:.6g}{}{}", v.name, x / v.unit, v.symbol.empty() ? "" : " ", v.symbol);
}

/// The centre and each end alone must give a section; corners that do not are told, since their samples will fail.
void Reader::try_samples(std::vector<Diagnostic>& warnings) {
  const size_t n = out.inputs.size();
  std::vector<double> centre;
  for (const FuzzyValue& v : out.inputs) {
    double left = 0, right = 0;
    bool has_left = false;
    for (const auto& [x, mu] : v.corners) {
      if (mu != 1) continue;
      if (!has_left) left = x, has_left = true;
      right = x;
    }
    centre.push_back(0.5 * (left + right));
  }
  const auto refusal = [&](const std::vector<double>& point) -> std::string {
    const std::vector<double> derived = calc_derived(out, point);
    for (size_t i = 0; i < derived.size(); ++i)
      if (!std::isfinite(derived[i])) return out.derived[i].path + ": the formula has no value there";
    try {
      make_sample(section, out, point);
      return {};
    } catch (const InputError& e) { return e.diagnostics().front().message; }
  };
  if (const std::string why = refusal(centre); !why.empty())
    complaints.error("E207", {}, "the section is refused in the middle of the fuzzy inputs: " + why);
  for (size_t i = 0; i < n; ++i) {
    const FuzzyValue& v = out.inputs[i];
    for (const double end : {v.corners.front().first, v.corners.back().first}) {
      std::vector<double> point = centre;
      point[i] = end;
      const std::string why = refusal(point);
      if (why.empty()) continue;
      complaints.error("E205", {v.where.line, v.where.column, static_cast<int>(v.path.size())},
                       v.path + ": " + text_of(v, end) + " is not possible: " + why);
      break;
    }
  }
  if (complaints.error_count() > 0 || n > most_corner_inputs) return;
  int refused = 0;
  std::string example;
  for (unsigned corner = 0; corner < 1U << n; ++corner) {
    std::vector<double> point;
    std::string words;
    for (size_t i = 0; i < n; ++i) {
      const auto& corners = out.inputs[i].corners;
      point.push_back(corner >> i & 1U ? corners.back().first : corners.front().first);
      words.append(i ? ", " : "").append(text_of(out.inputs[i], point.back()));
    }
    const std::string why = refusal(point);
    if (why.empty()) continue;
    if (refused++ == 0) example = words.append(": ").append(why);
  }
  if (refused == 0) return;
  Complaints more(out.path);
  more.warn("W507", {},
            fmt::format("{} of {} corners of the fuzzy inputs are no section; samples there count as failed", refused,
                        1U << n),
            "first: " + example);
  warnings.insert(warnings.end(), more.all().begin(), more.all().end());
}

/// The value of `keys`, made where it is missing.
void set_value(Node& document, const ValuePlace& place, double si) {
  Node* node = &document;
  for (const std::string& key : place.keys) {
    auto entry = std::find_if(node->entries.begin(), node->entries.end(), [&](const Entry& e) { return e.key == key; });
    if (entry == node->entries.end()) {
      node->entries.push_back({key, node->place, {}});
      node->entries.back().value.place = node->place;
      entry = node->entries.end() - 1;
    }
    node = &entry->value;
  }
  node->kind = Node::Kind::String;
  node->text = fmt::format("{:.17g} {}", si, place.si);
}

}  // namespace

std::vector<double> calc_derived(const FuzzyFile& f, std::span<const double> point) {
  std::vector<double> values;
  for (size_t i = 0; i < f.inputs.size(); ++i) values.push_back(point[i] / f.formula_unit[i]);
  values.insert(values.end(), f.crisp.begin(), f.crisp.end());
  std::vector<double> out;
  for (size_t i = 0; i < f.derived.size(); ++i)
    out.push_back(f.derived[i].expression.evaluate(values) * f.formula_unit[f.inputs.size() + i]);
  return out;
}

SectionFile make_sample(const SectionFile& section, const FuzzyFile& f, std::span<const double> point) {
  Node document = f.section;
  for (size_t i = 0; i < f.inputs.size(); ++i) set_value(document, f.places[i], point[i]);
  const std::vector<double> derived = calc_derived(f, point);
  for (size_t i = 0; i < derived.size(); ++i) {
    if (!std::isfinite(derived[i]))
      throw InputError("E207", f.derived[i].path + ": the formula has no value", f.derived[i].text);
    set_value(document, f.places[f.inputs.size() + i], derived[i]);
  }
  std::vector<Diagnostic> ignored;
  return read_section_document(document, section.path, ignored);
}

FuzzyFile read_fuzzy_text(const std::string& text, const std::string& name, const SectionFile& section,
                          std::vector<Diagnostic>& warnings) {
  FuzzyFile out;
  out.path = name;
  out.text = text;
  out.section = parse_document(section.text, section.path);
  const Node document = parse_document(text, name);
  Complaints complaints(name);
  TableReader root(document, "", complaints);
  out.title = root.text("title", section.title);
  Reader reader{section, out, complaints, {}};
  for (const char* group : {"concrete", "steel", "section", "zone"}) reader.read_group(root, group);
  reader.read_search(root);
  root.finish();
  if (complaints.error_count() == 0 && out.inputs.empty())
    complaints.error("E201", document.place, "nothing is fuzzy",
                     "add a line such as concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }");
  if (out.inputs.size() > most_inputs)
    complaints.error("E209", document.place, fmt::format("more than {} fuzzy inputs", most_inputs));
  if (complaints.error_count() == 0) reader.parse_formulas();
  if (complaints.error_count() == 0) reader.try_samples(warnings);
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  return out;
}

FuzzyFile read_fuzzy_file(const std::string& path, const SectionFile& section, std::vector<Diagnostic>& warnings,
                          std::string& text_out) {
  text_out.clear();
  text_out = read_input(path, "fuzzy input");
  if (text_out.starts_with("\xEF\xBB\xBF")) text_out = text_out.substr(3);
  return read_fuzzy_text(text_out, path, section, warnings);
}

}  // namespace topple::product
