#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "product/read_fuzzy_values.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr double accepted_difference = 1e-3;  // between a value of the plan and the core

/// A quantity of the plan and the ways to write its path.
struct Target {
  std::vector<std::vector<std::string>> words;  // for each step the words that lead there: a number, a name
  DocumentPath place;
  Dimension dimension = Dimension::Number;
  double value = 0;
  size_t owner = 0;  // steps up to what the value belongs to: concrete.NAME, stage.N.charge.M, site
};

std::string join(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

/// With the first word of each step; keys that are not bare stand in quotes.
std::string path_of(const Target& t) {
  std::string path;
  for (const auto& w : t.words) {
    const std::string& word = w.front();
    const bool is_bare = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
      return std::isalnum(c) || c == '-' || c == '_';
    });
    path += (path.empty() ? "" : ".") + (is_bare ? word : '"' + word + '"');
  }
  return path;
}

/// "ties_diameter" for section.NAME.ties.diameter.
std::string name_of(const Target& t) {
  std::vector<std::string> words;
  for (size_t i = t.owner; i < t.words.size(); ++i) words.push_back(t.words[i].front());
  return join(words, "_");
}

/// A path as a name in formulas.
std::string word_of(std::string path) {
  for (char& c : path)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return path;
}

bool has_named_tables(const std::string& group) {
  return group == "concrete" || group == "steel" || group == "section" || group == "slab" || group == "wall";
}

/// All quantities that readers asked for, with their paths.
class TargetFinder {
 public:
  TargetFinder(const Node& document, const std::vector<AskedQuantity>& asked) {
    for (const AskedQuantity& a : asked) asked_[a.node ? a.node : a.table].push_back(&a);
    visit(document);
  }
  std::vector<Target> targets;

 private:
  void add(const AskedQuantity& a) {
    Target t{words_, place_, a.dimension, a.value, 1};
    if (!words_.empty() && has_named_tables(words_[0].front())) t.owner = 2;
    for (size_t i = 0; i + 1 < place_.size(); ++i)
      if (place_[i].item >= 0) t.owner = std::max(t.owner, i + 1);
    targets.push_back(std::move(t));
  }
  void visit(const Node& node) {
    if (const auto here = asked_.find(&node); here != asked_.end()) {
      for (const AskedQuantity* a : here->second) {
        if (!a->node) words_.push_back({a->key}), place_.push_back({a->key, -1});
        add(*a);
        if (!a->node) words_.pop_back(), place_.pop_back();
      }
    }
    for (const Entry& e : node.entries) {
      if (place_.empty() && e.key == "fuzzy") continue;
      words_.push_back({e.key}), place_.push_back({e.key, -1});
      visit(e.value);
      words_.pop_back(), place_.pop_back();
    }
    for (size_t i = 0; i < node.items.size(); ++i) {
      std::vector<std::string> words{std::to_string(i + 1)};
      if (const Entry* name = node.items[i].find("name")) words.push_back(name->value.text);
      words_.push_back(std::move(words)), place_.push_back({{}, static_cast<int>(i)});
      visit(node.items[i]);
      words_.pop_back(), place_.pop_back();
    }
  }

  std::unordered_map<const Node*, std::vector<const AskedQuantity*>> asked_;
  std::vector<std::vector<std::string>> words_;
  DocumentPath place_;
};

bool is_match(const std::string& word, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& w) { return matches(word, w); });
}

/// Whether the path leads to the target, or, if it is shorter, towards it.
bool leads_to(const std::vector<std::string>& path, const Target& t) {
  if (path.size() > t.words.size()) return false;
  for (size_t i = 0; i < path.size(); ++i)
    if (!is_match(path[i], t.words[i])) return false;
  return true;
}

/// What is judged or shown, and never felt by a run.
bool is_without_effect(const Target& t) {
  const std::string &group = t.words.front().front(), &key = t.words.back().front();
  // studies judge all their runs by the plan's own factor and band
  if (group == "site" && t.words.size() > 2 && t.words[1].front() == "vibration" &&
      (t.words[2].front() == "factor" || t.words[2].front() == "frequency"))
    return true;
  return group == "criteria" || (group == "analysis" && (key == "duration" || key == "frame_rate")) ||
         (group == "site" && (key == "clearance" || key == "vibration_limit"));
}

struct FuzzyReader {
  FuzzyPlan& out;
  Complaints& complaints;
  std::vector<Target> targets;
  bool is_whole;

  struct Formula {
    const Node* node;
    size_t target;
  };
  std::vector<Formula> formulas;     // of the derived values
  std::vector<size_t> first_target;  // of the inputs
  std::vector<bool> has_own_name;    // of the inputs
  std::vector<std::pair<size_t, SourcePosition>> taken;
  std::vector<std::vector<DocumentPath>> derived_places;
  std::vector<std::string> derived_si;
  struct Random {
    RandomValue random;
    FuzzyValue value;
    size_t target;
    bool has_own_name;
    std::vector<DocumentPath> places;
  };
  std::vector<Random> randoms = {};  // until they are put behind the other inputs
  bool is_reading_random = false;    // the table is [fuzzy.random]

  void read_entry(const Entry&, std::vector<std::string>& path);
  void read_leaf(const Entry&, const std::vector<std::string>& path, const std::vector<size_t>& found);
  bool take(size_t target, Place where, const std::string& path);
  bool take_all(const TableReader&, const std::vector<size_t>& found, Place where, const std::string& words);
  FuzzyValue make_value(TableReader&, Place where, const std::string& words, const Target& first);
  void read_random_leaf(TableReader&, const Entry&, const std::string& words, const std::vector<size_t>& found);
  void read_parameters(TableReader& fuzzy);
  void read_random(TableReader& fuzzy);
  void check_interaction_names();
  void name_inputs();
  void parse_formula(size_t i);
  void read_interaction(TableReader& table);
  void compare();
};

void FuzzyReader::read_entry(const Entry& entry, std::vector<std::string>& path) {
  path.push_back(entry.key);
  std::vector<size_t> found;
  bool leads_on = false;
  for (size_t i = 0; i < targets.size(); ++i) {
    if (!leads_to(path, targets[i])) continue;
    if (path.size() == targets[i].words.size()) found.push_back(i);
    leads_on = leads_on || path.size() < targets[i].words.size();
  }
  for (size_t level = 0; level < path.size() && !found.empty(); ++level) {
    if (path[level].find_first_of("*?") != std::string::npos) continue;
    const auto is_place = [&](size_t t) { return targets[t].words[level].front() == path[level]; };
    if (std::all_of(found.begin(), found.end(), is_place) || std::none_of(found.begin(), found.end(), is_place))
      continue;
    complaints.error("E203", entry.place,
                     "fuzzy: " + quoted(join(path, ".")) + ": " + quoted(path[level]) +
                         " is the place of one item and the name of another",
                     "give the item another name");
    path.pop_back();
    return;
  }
  const bool is_table = entry.value.kind == Node::Kind::Table;
  const bool says_how =
      is_table && (is_reading_random ? says_distribution(entry.value)
                                     : std::any_of(std::begin(fuzzy_ways), std::end(fuzzy_ways),
                                                   [&](const char* way) { return entry.value.find(way) != nullptr; }));
  if (!found.empty() || says_how) {
    read_leaf(entry, path, found);
  } else if (is_table && (leads_on || !is_whole)) {
    if (entry.value.entries.empty())
      complaints.error("E201", entry.place, "fuzzy: " + join(path, ".") + ": is an empty table", fuzzy_help);
    for (const Entry& inner : entry.value.entries) read_entry(inner, path);
  } else if (is_whole) {
    std::vector<std::string> known;
    for (const Target& t : targets) known.push_back(path_of(t));
    complaints.error("E203", entry.place, "fuzzy: " + quoted(join(path, ".")) + " is no value of this plan",
                     did_you_mean(join(path, "."), known, "known here: " + list_of(known)));
  }
  path.pop_back();
}

/// A value may be fuzzy once.
bool FuzzyReader::take(size_t target, Place where, const std::string& path) {
  if (is_without_effect(targets[target])) {
    complaints.error("E207", where, "fuzzy: " + path_of(targets[target]) + ": no run depends on it",
                     "it is judged or shown afterwards; leave it out");
    return false;
  }
  for (const auto& [t, position] : taken) {
    if (t != target) continue;
    complaints.error("E207", where, "fuzzy: " + path + ": " + path_of(targets[t]) + " is given a second time",
                     fmt::format("first on line {}", position.line));
    return false;
  }
  taken.emplace_back(target, complaints.position(where));
  return true;
}

/// All that a path leads to, which must have one unit.
bool FuzzyReader::take_all(const TableReader& table, const std::vector<size_t>& found, Place where,
                           const std::string& words) {
  const Target& first = targets[found.front()];
  for (const size_t i : found) {
    if (!take(i, where, words)) return false;
    if (targets[i].dimension != first.dimension) {
      table.error("E207", where, path_of(first) + " and " + path_of(targets[i]) + " have different units");
      return false;
    }
  }
  return true;
}

/// With its name and units, without corners.
FuzzyValue FuzzyReader::make_value(TableReader& table, Place where, const std::string& words, const Target& first) {
  const FuzzyUnits units = fuzzy_units(first.dimension);
  FuzzyValue v;
  v.path = words, v.symbol = units.symbol, v.unit = units.shown;
  v.where = complaints.position(where);
  const bool is_named = table.has("name");
  v.name = is_named ? table.text("name") : name_of(first);
  if (is_named && !is_plain_name(v.name))
    table.error("E208", table.place_of("name"), "name: " + quoted(v.name) + " cannot be a name in formulas",
                "letters, digits and _, a letter first");
  return v;
}

void FuzzyReader::read_random_leaf(TableReader& table, const Entry& entry, const std::string& words,
                                   const std::vector<size_t>& found) {
  const Target& first = targets[found.front()];
  auto random = read_distribution(table, first.dimension);
  if (!random || !take_all(table, found, entry.place, words)) return;
  Random r{std::move(*random), {}, found.front(), table.has("name"), {}};
  r.value = make_value(table, entry.place, words, first);
  r.random.place = entry.place;
  table.finish();
  for (const size_t i : found) r.places.push_back(targets[i].place);
  randoms.push_back(std::move(r));
}

/// Fuzzy parameters of random values have the units of the values.
void FuzzyReader::read_parameters(TableReader& fuzzy) {
  const Node* node = fuzzy.table("parameters");
  if (!node) return;
  for (const Entry& entry : node->entries) {
    TableReader table(entry.value, "fuzzy: parameters." + entry.key, complaints);
    if (!table.is_table()) continue;
    if (!is_plain_name(entry.key)) {
      complaints.error("E208", entry.place, "fuzzy: " + quoted(entry.key) + " cannot be the name of a parameter",
                       "letters, digits and _, a letter first");
      continue;
    }
    std::optional<Dimension> dimension;
    for (const Random& r : randoms)
      for (size_t i = 0; i < 2; ++i) {
        if (r.random.parameters[i].name != entry.key) continue;
        const bool is_shape = r.random.distribution->has_shape && i == 1;
        const Dimension own = is_shape ? Dimension::Number : targets[r.target].dimension;
        if (dimension && *dimension != own)
          complaints.error("E207", r.random.parameters[i].place,
                           "fuzzy: " + quoted(entry.key) + " is a parameter of values with different units");
        dimension = own;
      }
    if (!dimension) {
      complaints.error("E207", entry.place, "fuzzy: no random value has the parameter " + quoted(entry.key),
                       "name it in a distribution of [fuzzy.random], or leave it out");
      continue;
    }
    const FuzzyUnits units = fuzzy_units(*dimension);
    FuzzyValue v;
    v.path = v.name = entry.key, v.symbol = units.symbol, v.unit = units.shown;
    v.where = complaints.position(entry.place);
    read_corners(table, *dimension, v);
    if (v.corners.empty() && complaints.error_count() == 0)
      table.error("E207", entry.place, "one of triangular, trapezoidal, polygonal, tabulated is wanted", fuzzy_help);
    table.finish();
    out.inputs.push_back(std::move(v));
    out.places.emplace_back();
    out.si.emplace_back();
    out.input_unit.push_back(units.formula);
    first_target.push_back(0);
    has_own_name.push_back(true);
  }
}

/// Random values with their parameters, behind the other inputs.
void FuzzyReader::read_random(TableReader& fuzzy) {
  const size_t count = out.inputs.size();
  std::vector<std::string> names;
  for (size_t i = 0; i < count; ++i)
    if (out.places[i].empty()) names.push_back(out.inputs[i].name);
  for (Random& r : randoms) {
    std::array<std::array<double, 2>, 2> ends{};
    std::array<double, 2> middle{};
    bool is_known = true;
    for (size_t i = 0; i < 2; ++i) {
      const RandomParameter& p = r.random.parameters[i];
      ends[i] = {p.value, p.value}, middle[i] = p.value;
      if (p.name.empty()) continue;
      size_t k = 0;
      while (k < count && (out.inputs[k].name != p.name || !out.places[k].empty())) ++k;
      if (k == count) {
        is_known = false;
        complaints.error("E207", p.place, "fuzzy: random: there is no parameter " + quoted(p.name),
                         did_you_mean(p.name, names,
                                      "add it to a table [fuzzy.parameters], such as " + p.name +
                                          " = { triangular = [left, core, right] }"));
        continue;
      }
      const auto& corners = out.inputs[k].corners;
      if (corners.empty()) return;
      ends[i] = {corners.front().first, corners.back().first};
      middle[i] = 0.5 * (core_of(out.inputs[k]).first + core_of(out.inputs[k]).second);
    }
    if (!is_known) continue;
    check_distribution(r.random, ends, "fuzzy: random: " + r.value.path, complaints);
    const double x = std::string(r.random.distribution->name) == "uniform" ? 0.5 * (middle[0] + middle[1]) : middle[0];
    r.value.corners = {{x, 0}, {x, 1}, {x, 0}};
    r.random.name = r.value.path;
    const FuzzyUnits units = fuzzy_units(targets[r.target].dimension);
    out.inputs.push_back(r.value);
    out.places.push_back(r.places);
    out.si.emplace_back(units.si);
    out.input_unit.push_back(units.formula);
    first_target.push_back(r.target);
    has_own_name.push_back(r.has_own_name);
    out.random.push_back(r.random);
  }
  out.randomness = read_random_settings(fuzzy);
  if (!randoms.empty() && !out.randomness.is_given)
    fuzzy.missing("randomness", "such as runs = 50 and statistics = [\"p(topple)\"] below it");
  if (randoms.empty() && out.randomness.is_given)
    complaints.error("E207", out.randomness.place, "fuzzy: randomness: no value is random",
                     "add a table [fuzzy.random] with a line such as site.friction = { normal = [0.6, 0.05] }");
}

void FuzzyReader::check_interaction_names() {
  const auto check = [&](const Expression& e, Place place, const char* what) {
    for (const int used : e.used()) {
      const auto i = static_cast<size_t>(used);
      const bool is_input = i < out.inputs.size();
      if (is_input ? i < out.fuzzy_count() : !follows_from_random(out, i - out.inputs.size())) continue;
      complaints.error("E207", place,
                       fmt::format("fuzzy: interaction: {}: {} is random", what,
                                   is_input ? out.inputs[i].name : out.derived[i - out.inputs.size()].name),
                       "it may use fuzzy values, parameters and what follows from them");
    }
  };
  for (const Constraint& c : out.interaction.constraints)
    check(c.left, c.place, "constraint"), check(c.right, c.place, "constraint");
  if (out.interaction.joint) check(*out.interaction.joint, out.interaction.joint_place, "membership");
}

void FuzzyReader::read_leaf(const Entry& entry, const std::vector<std::string>& path,
                            const std::vector<size_t>& found) {
  const std::string words = join(path, ".");
  if (found.empty()) {
    if (!is_whole) return;
    std::vector<std::string> known;
    for (const Target& t : targets) known.push_back(path_of(t));
    complaints.error("E203", entry.place, "fuzzy: " + quoted(words) + " is no value of this plan that can be fuzzy",
                     std::find(known.begin(), known.end(), words) != known.end()
                         ? "write it without quotes, its dots lead into the plan"
                         : did_you_mean(words, known, "quantities of the plan can be, words and whole numbers cannot"));
    return;
  }
  if (entry.value.kind != Node::Kind::Table) {
    complaints.error("E202", entry.value.place,
                     "fuzzy: " + words + ": is " + name_of(entry.value.kind) + "; a table is wanted",
                     is_reading_random ? random_help : fuzzy_help);
    return;
  }
  TableReader table(entry.value, "fuzzy: " + words, complaints);
  if (is_reading_random) return read_random_leaf(table, entry, words, found);
  const std::string way = find_fuzzy_way(table, entry.place);
  if (way.empty()) return;
  const Target& first = targets[found.front()];
  if (!take_all(table, found, entry.place, words)) return;
  const FuzzyUnits units = fuzzy_units(first.dimension);
  if (way == "formula") {
    const std::string text = table.text("formula");
    table.finish();
    if (text.empty()) return;
    for (const size_t i : found) {
      DerivedValue d;
      d.path = path_of(targets[i]), d.name = name_of(targets[i]), d.symbol = units.symbol, d.unit = units.shown;
      d.text = text, d.where = complaints.position(entry.place);
      out.derived.push_back(std::move(d));
      out.derived_unit.push_back(units.formula);
      derived_places.push_back({targets[i].place});
      derived_si.emplace_back(units.si);
      formulas.push_back({table.find("formula"), i});
    }
    return;
  }
  const bool is_named = table.has("name");
  FuzzyValue v = make_value(table, entry.place, words, first);
  read_corners(table, first.dimension, v);
  table.finish();
  out.inputs.push_back(std::move(v));
  out.places.emplace_back();
  for (const size_t i : found) out.places.back().push_back(targets[i].place);
  out.si.emplace_back(units.si);
  out.input_unit.push_back(units.formula);
  first_target.push_back(found.front());
  has_own_name.push_back(is_named);
}

/// Names are unique: what shares its name with another is called by its path, with _ between its words.
void FuzzyReader::name_inputs() {
  std::vector<std::string> names;
  for (const FuzzyValue& v : out.inputs) names.push_back(v.name);
  for (size_t i = 0; i < names.size(); ++i) {
    if (std::count(names.begin(), names.end(), names[i]) < 2) continue;
    if (has_own_name[i]) {
      complaints.error("E102", {out.inputs[i].where.line, out.inputs[i].where.column, 1},
                       "fuzzy: " + out.inputs[i].path + ": the name " + quoted(names[i]) + " is given twice");
    } else {
      out.inputs[i].name = word_of(path_of(targets[first_target[i]]));
    }
  }
}

/// A formula sees the values that stand beside its own, and all fuzzy values by their names.
void FuzzyReader::parse_formula(size_t i) {
  const Target& own = targets[formulas[i].target];
  std::vector<std::string> names;
  std::vector<FuzzyOperand> operands;
  const auto add = [&](const std::string& name, const FuzzyOperand& o) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name), operands.push_back(o);
  };
  const auto is_beside = [&](const Target& t) {
    if (t.owner != own.owner) return false;
    for (size_t k = 0; k < own.owner; ++k)
      if (t.place[k].key != own.place[k].key || t.place[k].item != own.place[k].item) return false;
    return true;
  };
  const auto is_at = [](const DocumentPath& a, const DocumentPath& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const DocumentStep& x, const DocumentStep& y) { return x.key == y.key && x.item == y.item; });
  };
  for (const Target& t : targets) {
    if (!is_beside(t)) continue;
    const auto has = [&](const std::vector<DocumentPath>& places) {
      return std::any_of(places.begin(), places.end(), [&](const DocumentPath& p) { return is_at(p, t.place); });
    };
    const double unit = fuzzy_units(t.dimension).formula;
    int input = -1;
    for (size_t k = 0; k < out.inputs.size(); ++k)
      if (has(out.places[k])) input = static_cast<int>(k);
    if (input < 0 && (std::isnan(t.value) || std::any_of(derived_places.begin(), derived_places.end(), has))) continue;
    add(name_of(t), {input, t.value, unit});
  }
  for (size_t k = 0; k < out.inputs.size(); ++k) add(out.inputs[k].name, {static_cast<int>(k), 0, out.input_unit[k]});
  out.derived[i].expression = read_formula(*formulas[i].node, "fuzzy: " + out.derived[i].path, names, complaints);
  out.operands.push_back(std::move(operands));
}

/// Constraints and the joint membership see fuzzy values and what follows from them.
void FuzzyReader::read_interaction(TableReader& table) {
  std::vector<std::string> names;
  for (const FuzzyValue& v : out.inputs) names.push_back(v.name);
  const size_t inputs = names.size();
  for (const DerivedValue& d : out.derived) names.push_back(d.name);
  const std::vector<std::string> own = names;
  for (size_t i = inputs; i < names.size(); ++i)
    if (std::count(own.begin(), own.end(), own[i]) > 1) names[i] = word_of(out.derived[i - inputs].path);
  out.interaction = product::read_interaction(table, names);
}

/// The plan as it stands is a run of its own; the analysis has its own middle. Both should be the same building.
void FuzzyReader::compare() {
  const auto differs = [](double a, double b) {
    return std::abs(a - b) > accepted_difference * std::max(std::abs(a), std::abs(b));
  };
  const std::string help = "topple run takes the plan's value, a study its fuzzy values";
  for (size_t i = 0; i < out.fuzzy_count(); ++i) {
    const FuzzyValue& v = out.inputs[i];
    const auto [left, right] = core_of(v);
    for (const auto& [t, where] : taken) {
      const double x = targets[t].value;
      if (where.line != v.where.line || where.column != v.where.column || std::isnan(x)) continue;
      if ((x < left && differs(x, left)) || (x > right && differs(x, right)))
        complaints.warn("W508", {where.line, where.column, 1},
                        fmt::format("fuzzy: {}: the plan says {}, outside the core of the fuzzy value",
                                    path_of(targets[t]), text_of(v, x)),
                        help);
    }
  }
  const std::vector<double> derived = calc_derived(out, calc_centre(out));
  for (size_t i = 0; i < derived.size(); ++i) {
    const DerivedValue& d = out.derived[i];
    const double x = targets[formulas[i].target].value;
    if (std::isnan(x) || !std::isfinite(derived[i]) || !differs(x, derived[i])) continue;
    complaints.warn("W508", {d.where.line, d.where.column, 1},
                    fmt::format("fuzzy: {}: the plan says {:.6g} {}, the formula gives {:.6g} at the core", d.path,
                                x / d.unit, d.symbol, derived[i] / d.unit),
                    help);
  }
}

}  // namespace

void read_fuzzy(Reading& reading, TableReader& root, const Node& document, const std::vector<AskedQuantity>& asked,
                bool is_whole) {
  const Node* node = root.table("fuzzy");
  if (!node) return;
  Complaints& complaints = reading.complaints;
  FuzzyPlan& out = reading.plan.fuzzy;
  const int errors_before = complaints.error_count();
  TableReader table(*node, "fuzzy", complaints);
  out.search = read_search(table, true);
  FuzzyReader reader{out, complaints, TargetFinder(document, asked).targets, is_whole, {}, {}, {}, {}, {}, {}};
  std::vector<std::string> path;
  for (const Entry& entry : node->entries)
    if (entry.key != "search" && entry.key != "interaction" && entry.key != "random" && entry.key != "parameters" &&
        entry.key != "randomness")
      reader.read_entry(entry, path);
  if (const Node* random = table.table("random")) {
    reader.is_reading_random = true;
    for (const Entry& entry : random->entries) reader.read_entry(entry, path);
    reader.is_reading_random = false;
  }
  if (complaints.error_count() > errors_before || !is_whole) return;
  reader.read_parameters(table);
  reader.read_random(table);
  if (complaints.error_count() > errors_before) return;
  if (out.fuzzy_count() == 0)
    complaints.error(
        "E201", node->place, "fuzzy: nothing is fuzzy",
        "add a line such as concrete.NAME.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }");
  if (out.inputs.size() > most_fuzzy_inputs)
    complaints.error("E209", node->place, fmt::format("fuzzy: more than {} fuzzy values", most_fuzzy_inputs));
  reader.name_inputs();
  for (size_t i = 0; i < out.derived.size(); ++i) reader.parse_formula(i);
  out.places.insert(out.places.end(), reader.derived_places.begin(), reader.derived_places.end());
  out.si.insert(out.si.end(), reader.derived_si.begin(), reader.derived_si.end());
  reader.read_interaction(table);
  if (complaints.error_count() == errors_before) reader.check_interaction_names();
  if (complaints.error_count() > errors_before) return;
  const std::vector<double> values = calc_interacting(out, calc_centre(out));
  if (std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }))
    check_interaction(out.interaction, values, "fuzzy: interaction", "the fuzzy values", complaints);
  if (complaints.error_count() == errors_before) reader.compare();
}

}  // namespace topple::product
