#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/utf8.h"
#include "product/fuzzy_file.h"
#include "product/read_fuzzy_values.h"
#include "product/reading.h"

namespace topple::product {

namespace {

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
  bool find_place(const Target&, Place, ValuePlace&);
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
  place = {keys, fuzzy_units(t.dimension).si};
  return true;
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
                     fuzzy_help);
    return;
  }
  TableReader table(entry.value, path, complaints);
  const std::string way = find_fuzzy_way(table, entry.place);
  ValuePlace place;
  const bool has_place = find_place(*t, entry.place, place);
  const FuzzyUnits units = fuzzy_units(t->dimension);
  if (way == "formula") {
    DerivedValue d;
    d.path = path, d.name = t->name, d.symbol = units.symbol, d.unit = units.shown;
    d.where = complaints.position(entry.place);
    d.text = table.text("formula");
    formula_nodes.push_back(table.find("formula"));
    out.derived.push_back(std::move(d));
  } else if (!way.empty()) {
    FuzzyValue v;
    v.path = path, v.name = t->name, v.symbol = units.symbol, v.unit = units.shown;
    v.where = complaints.position(entry.place);
    read_corners(table, t->dimension, v);
    // inputs stand before derived values
    if (has_place) out.places.insert(out.places.begin() + static_cast<std::ptrdiff_t>(out.inputs.size()), place);
    out.inputs.push_back(std::move(v));
  }
  if (way == "formula" && has_place) out.places.push_back(place);
  if (!way.empty()) table.finish();
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

/// Formulas may use fuzzy inputs and the other values of the section.
void Reader::parse_formulas() {
  std::vector<std::string> names;
  const auto formula_unit = [&](const std::string& path) { return fuzzy_units(find_target(path)->dimension).formula; };
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
    d.expression = read_formula(*formula_nodes[i], d.path, names, complaints);
  }
}

/// The centre and each end alone must give a section; corners that do not are told, since their samples will fail.
void Reader::try_samples(std::vector<Diagnostic>& warnings) {
  const size_t n = out.inputs.size();
  const auto refusal = [&](const std::vector<double>& point) -> std::string {
    if (!is_possible(out.interaction, calc_interacting(out, point))) return {};  // no sample is there
    const std::vector<double> derived = calc_derived(out, point);
    for (size_t i = 0; i < derived.size(); ++i)
      if (!std::isfinite(derived[i])) return out.derived[i].path + ": the formula has no value there";
    try {
      make_sample(section, out, point);
      return {};
    } catch (const InputError& e) { return e.first_error().message; }
  };
  if (const std::string why = refusal(centre_of(out.inputs)); !why.empty())
    complaints.error("E207", {}, "the section is refused in the middle of the fuzzy inputs: " + why);
  const auto place_of = [](const FuzzyValue& v) {
    return Place{v.where.line, v.where.column, static_cast<int>(v.path.size())};
  };
  try_ends(out.inputs, refusal, "", place_of, complaints);
  if (complaints.error_count() > 0 || n > most_corner_inputs) return;
  const RefusedCorners corners = try_corners(out.inputs, refusal);
  if (corners.count.empty()) return;
  Complaints more(out.path);
  more.warn("W507", {}, corners.count + " of the fuzzy inputs are no section; samples there count as failed",
            "first: " + corners.first);
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

std::vector<double> calc_interacting(const FuzzyFile& f, std::span<const double> point) {
  std::vector<double> values(point.begin(), point.end());
  const std::vector<double> derived = calc_derived(f, point);
  values.insert(values.end(), derived.begin(), derived.end());
  for (size_t i = 0; i < values.size(); ++i) values[i] /= f.formula_unit[i];
  return values;
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
  const Node document =
      parse_document(text, name, "the file of fuzzy inputs",
                     "add a line such as concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }");
  out.section = parse_document(section.text, section.path);
  Complaints complaints(name);
  TableReader root(document, "", complaints);
  out.title = root.text("title", section.title);
  Reader reader{section, out, complaints, {}};
  for (const char* group : {"concrete", "steel", "section", "zone"}) reader.read_group(root, group);
  std::vector<std::string> names;
  for (const FuzzyValue& v : out.inputs) names.push_back(v.name);
  for (const DerivedValue& d : out.derived) names.push_back(d.name);
  out.interaction = read_interaction(root, names);
  static_cast<FuzzySearch&>(out) = read_search(root);
  root.finish();
  if (complaints.error_count() == 0 && out.inputs.empty())
    complaints.error("E201", document.place, "nothing is fuzzy",
                     "add a line such as concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }");
  if (out.inputs.size() > most_fuzzy_inputs)
    complaints.error("E209", document.place, fmt::format("more than {} fuzzy inputs", most_fuzzy_inputs));
  if (complaints.error_count() == 0) reader.parse_formulas();
  if (complaints.error_count() == 0) {
    const std::vector<double> values = calc_interacting(out, centre_of(out.inputs));
    if (std::ranges::all_of(values, [](double v) { return std::isfinite(v); }))
      check_interaction(out.interaction, values, "interaction", "the fuzzy inputs", complaints);
  }
  if (complaints.error_count() == 0) reader.try_samples(warnings);
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  return out;
}

FuzzyFile read_fuzzy_file(const std::string& path, const SectionFile& section, std::vector<Diagnostic>& warnings,
                          std::string& text_out) {
  text_out.clear();
  text_out = without_mark(read_input(path, "fuzzy input"));
  return read_fuzzy_text(text_out, path, section, warnings);
}

}  // namespace topple::product
