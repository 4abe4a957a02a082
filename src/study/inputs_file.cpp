#include "study/inputs_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "product/expression.h"
#include "product/interaction.h"
#include "product/random_values.h"
#include "product/read_fuzzy_values.h"
#include "product/table_reader.h"
#include "study/randomness.h"
#include "study/tie.h"

namespace topple::study {
namespace {

using product::Complaints;
using product::Entry;
using product::Expression;
using product::Node;
using product::Place;
using product::TableReader;
using uncertainty::FuzzyNumber;

constexpr std::size_t most_inputs = 50, most_corners = 1000;

struct Reader {
  Problem& out;
  Complaints& complaints;
  std::vector<std::string> names;    // inputs, random ones, then formulas that were read
  std::vector<Expression> formulas;  // each may use inputs and the formulas before it
  std::vector<Place> formula_places;
  product::Interaction interaction;
  std::vector<product::RandomValue> randoms = {};
  std::vector<Quantity> random_quantities = {}, formula_quantities = {};
  std::vector<std::string> formula_texts = {};
  std::vector<bool> is_random = {};  // of `names`: random, or follows from what is

  /// Numbers of a list, or nothing after a complaint.
  std::optional<std::vector<double>> read_numbers(const Node& node, const std::string& label, std::size_t count) {
    if (node.kind != Node::Kind::Array || (count > 0 && node.items.size() != count)) {
      complaints.error("E202", node.place, fmt::format("{}: a list of {} numbers is wanted", label, count));
      return std::nullopt;
    }
    std::vector<double> numbers;
    for (const Node& item : node.items) {
      if ((item.kind != Node::Kind::Integer && item.kind != Node::Kind::Float) || !std::isfinite(item.number)) {
        const bool has_unit =
            item.kind == Node::Kind::String && item.text.find_first_of("0123456789") != std::string::npos;
        complaints.error("E202", item.place, label + ": a finite number without a unit is wanted",
                         has_unit ? "give the unit beside it: unit = \"N/mm2\"" : "numbers alone, as in [10, 25, 45]");
        return std::nullopt;
      }
      numbers.push_back(item.number);
    }
    return numbers;
  }

  /// Lists of `count` numbers each.
  std::optional<std::vector<std::vector<double>>> read_rows(const Node& node, const std::string& label,
                                                            std::size_t count, const char* what) {
    if (node.kind != Node::Kind::Array || node.items.empty() || node.items.size() > most_corners) {
      complaints.error("E202", node.place, fmt::format("{}: a list of {} is wanted", label, what));
      return std::nullopt;
    }
    std::vector<std::vector<double>> rows;
    for (const Node& item : node.items) {
      const auto row = read_numbers(item, label, count);
      if (!row) return std::nullopt;
      rows.push_back(*row);
    }
    return rows;
  }

  bool check_name(const std::string& name, Place place) {
    const bool is_name = product::is_plain_name(name);
    if (!is_name)
      complaints.error("E203", place, product::quoted(name) + " is no name of an input",
                       "a letter, then letters, digits and _");
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      complaints.error("E203", place, product::quoted(name) + " is an input already");
      return false;
    }
    return is_name;
  }

  std::optional<FuzzyNumber> read_number(TableReader& table) {
    const Node* given = nullptr;
    std::string way;
    for (const char* key : {"triangular", "trapezoidal", "polygonal", "tabulated", "value"})
      if (const Node* node = table.find(key)) {
        if (given) {
          table.error("E207", node->place, fmt::format("{} and {}: one of them is wanted", way, key));
          return std::nullopt;
        }
        given = node;
        way = key;
      }
    const std::string label = table.label() + ": " + way;
    if (!given) {
      table.error("E207", table.place(), "one of triangular, trapezoidal, polygonal, tabulated, value is wanted",
                  "such as { triangular = [10, 25, 45] }");
      return std::nullopt;
    }
    try {
      if (way == "triangular") {
        if (const auto v = read_numbers(*given, label, 3))
          return uncertainty::make_triangular((*v)[0], (*v)[1], (*v)[2]);
      } else if (way == "trapezoidal") {
        if (const auto v = read_numbers(*given, label, 4))
          return uncertainty::make_trapezoidal((*v)[0], (*v)[1], (*v)[2], (*v)[3]);
      } else if (way == "polygonal") {
        std::vector<std::pair<double, double>> corners;
        if (const auto rows = read_rows(*given, label, 2, "pairs [value, membership]")) {
          for (const auto& r : *rows) corners.emplace_back(r[0], r[1]);
          return uncertainty::make_polygonal(corners);
        }
      } else if (way == "tabulated") {
        std::vector<uncertainty::AlphaCut> cuts;
        if (const auto rows = read_rows(*given, label, 3, "triples [alpha, left, right]")) {
          for (const auto& r : *rows) cuts.push_back({r[0], r[1], r[2]});
          return FuzzyNumber(std::move(cuts));
        }
      } else {
        Node list;
        list.kind = Node::Kind::Array;
        list.place = given->place;
        list.items = {*given};
        if (const auto v = read_numbers(list, label, 1))
          return FuzzyNumber(std::vector<uncertainty::AlphaCut>{{0, (*v)[0], (*v)[0]}, {1, (*v)[0], (*v)[0]}});
      }
    } catch (const InputError& e) { complaints.error("E207", given->place, label + ": " + e.first_error().message); }
    return std::nullopt;
  }

  void read_inputs(TableReader& root) {
    const Node* node = root.table("inputs");
    if (!node) {
      root.missing("inputs", "add a table [inputs] with a line such as fc = { triangular = [10, 25, 45] }");
      return;
    }
    if (node->entries.empty()) {
      complaints.error("E203", node->place, "there is no input in [inputs]",
                       "add a line such as fc = { triangular = [10, 25, 45] }");
      return;
    }
    if (node->entries.size() > most_inputs)
      complaints.error("E209", node->place, fmt::format("more than {} fuzzy inputs", most_inputs));
    for (const Entry& entry : node->entries) {
      check_name(entry.key, entry.place);
      TableReader table(entry.value, "inputs." + entry.key, complaints);
      if (!table.is_table()) continue;
      if (auto number = read_number(table)) {
        out.space.inputs.push_back(*number);
        out.inputs.push_back({entry.key, table.text("unit", ""), 1});
        names.push_back(entry.key);
      } else {
        table.text("unit", "");
      }
      table.finish();
    }
  }

  /// Distributions; their parameters are looked for when formulas are known.
  void read_random(TableReader& root) {
    is_random.assign(names.size(), false);
    const Node* node = root.table("random");
    if (!node) return;
    if (node->entries.empty())
      complaints.error("E203", node->place, "there is no random input in [random]",
                       "add a line such as fc = { normal = [\"mean_fc\", 3] }, or leave the table out");
    for (const Entry& entry : node->entries) {
      const bool is_name = check_name(entry.key, entry.place);
      TableReader table(entry.value, "random." + entry.key, complaints);
      if (!table.is_table()) continue;
      auto value = product::read_distribution(table, std::nullopt);
      const std::string unit = table.text("unit", "");
      table.finish();
      if (!value || !is_name) continue;
      value->name = entry.key;
      randoms.push_back(std::move(*value));
      random_quantities.push_back({entry.key, unit, 1});
      names.push_back(entry.key);
      is_random.push_back(true);
    }
    if (names.size() > most_inputs)
      complaints.error("E209", node->place, fmt::format("more than {} inputs", most_inputs));
  }

  void read_formulas(TableReader& root) {
    const Node* node = root.table("derived");
    if (!node) return;
    for (const Entry& entry : node->entries) {
      if (!check_name(entry.key, entry.place)) continue;
      const std::string label = "derived." + entry.key;
      const Node* text = &entry.value;
      std::string unit;
      std::optional<TableReader> table;
      if (entry.value.kind == Node::Kind::Table) {
        table.emplace(entry.value, label, complaints);
        text = table->find("formula");
        unit = table->text("unit", "");
        table->finish();
      }
      if (!text || text->kind != Node::Kind::String) {
        complaints.error("E202", entry.value.place, label + ": a formula is wanted", "such as \"1.4 * fc^(2/3)\"");
        continue;
      }
      if (auto e = product::parse_formula(*text, 0, std::string::npos, label, names, complaints)) {
        formulas.push_back(*e);
        formula_places.push_back(text->place);
        formula_texts.push_back(text->text);
        names.push_back(entry.key);
        formula_quantities.push_back({entry.key, unit, 1});
        const bool follows = uses_random(*e);
        is_random.push_back(follows);
        if (!follows) out.derived.push_back(formula_quantities.back());
      }
    }
  }

  bool uses_random(const Expression& e) const {
    return std::any_of(e.used().begin(), e.used().end(),
                       [this](int i) { return is_random[static_cast<std::size_t>(i)]; });
  }

  /// The interaction ties fuzzy inputs, and what follows from them.
  void check_interaction_names() {
    const auto check = [&](const Expression& e, Place place, const char* what) {
      for (const int i : e.used())
        if (is_random[static_cast<std::size_t>(i)])
          complaints.error("E207", place,
                           fmt::format("interaction: {}: {} is random", what, names[static_cast<std::size_t>(i)]),
                           "it may use fuzzy inputs and what follows from them");
    };
    for (const product::Constraint& c : interaction.constraints)
      check(c.left, c.place, "constraint"), check(c.right, c.place, "constraint");
    if (interaction.joint) check(*interaction.joint, interaction.joint_place, "membership");
  }

  /// Values of all names that are not random; the others are no numbers.
  auto make_complete() const {
    return [formulas = formulas, is_random = is_random, fuzzy = out.inputs.size(),
            randoms = randoms.size()](const Point& x) {
      std::vector<double> values = x;
      values.resize(fuzzy + randoms, std::nan(""));
      for (const Expression& f : formulas)
        values.push_back(is_random[values.size()] ? std::nan("") : f.evaluate(values));
      return values;
    };
  }

  /// Gives the problem its functions, and tries them at the middle.
  void finish() {
    const auto complete = make_complete();
    const std::size_t first = out.inputs.size() + randoms.size();
    if (!out.derived.empty())
      out.calc_derived = [complete, is_random = is_random, first](const Point& x) {
        const std::vector<double> values = complete(x);
        std::vector<double> derived;
        for (std::size_t i = first; i < values.size(); ++i)
          if (!is_random[i]) derived.push_back(values[i]);
        return derived;
      };
    tie(out.space, interaction, complete);
    const Point centre = uncertainty::calc_centre(out.space);
    const std::vector<double> values = complete(centre);
    for (std::size_t i = 0; i < formulas.size(); ++i)
      if (!is_random[first + i] && !std::isfinite(values[first + i]))
        complaints.error("E207", formula_places[i],
                         formula_quantities[i].name + ": the formula has no value in the middle of the inputs");
    product::check_interaction(interaction, values, "interaction", "the inputs", complaints);
    if (interaction.joint && complaints.error_count() == 0) check_joint(complete);
  }

  /// A joint membership above 1 would count as 1 without a word. Looked at in corners and at spread points.
  template <typename Complete>
  void check_joint(const Complete& complete) {
    const uncertainty::Box support = uncertainty::make_box(out.space, 0);
    const int n = out.space.size();
    std::vector<Point> points;
    if (n <= 10) points = uncertainty::make_corners(support);
    for (const Point& u : uncertainty::make_sobol_points(n, 1, 200, 1))
      points.push_back(uncertainty::place_in(support, u));
    for (const Point& x : points) {
      if (!uncertainty::is_allowed(out.space, x)) continue;
      const double mu = interaction.joint->evaluate(complete(x));
      if (!(mu > 1 + 1e-9)) continue;
      std::string place;
      for (int i = 0; i < n; ++i)
        place += fmt::format("{}{} = {:.4g}", i > 0 ? ", " : "", out.inputs[static_cast<std::size_t>(i)].name,
                             x[static_cast<std::size_t>(i)]);
      complaints.error("E207", interaction.joint_place,
                       fmt::format("interaction: membership: {:.4g} at {}; 1 at most", mu, place),
                       "a joint membership lies between 0 and 1; min(1, ...) holds it there");
      return;
    }
  }

  /// Turns a study with random inputs into one of statistics.
  void finish_random(const product::RandomSettings& settings) {
    Randomness r;
    const std::vector<double> middle = make_complete()(uncertainty::calc_centre(out.space));
    for (std::size_t k = 0; k < randoms.size(); ++k) {
      const product::RandomValue& v = randoms[k];
      RandomInput x{random_quantities[k], v.distribution, {}};
      std::array<std::array<double, 2>, 2> ends{};
      bool is_known = true;
      for (std::size_t i = 0; i < 2; ++i) {
        const product::RandomParameter& p = v.parameters[i];
        x.parameters[i].value = p.value;
        ends[i] = {p.value, p.value};
        if (p.name.empty()) continue;
        const auto found = std::find(names.begin(), names.end(), p.name);
        const auto at = static_cast<std::size_t>(found - names.begin());
        if (found == names.end() || is_random[at]) {
          is_known = false;
          complaints.error(
              "E207", p.place,
              fmt::format("random.{}: {}", v.name,
                          found == names.end() ? "there is no input " + product::quoted(p.name)
                                               : product::quoted(p.name) + " is random itself"),
              product::did_you_mean(p.name, fuzzy_names(), "known here: " + product::list_of(fuzzy_names())));
          continue;
        }
        const std::size_t first = out.inputs.size() + randoms.size();
        x.parameters[i].place = static_cast<int>(at < first ? at : at - randoms.size() - count_random(first, at));
        if (at < first)
          ends[i] = {out.space.inputs[at].support().left, out.space.inputs[at].support().right};
        else
          ends[i] = {middle[at], middle[at]};  // elsewhere points fail
      }
      if (is_known) product::check_distribution(v, ends, "random." + v.name, complaints);
      r.inputs.push_back(std::move(x));
    }
    for (std::size_t i = 0; i < formulas.size(); ++i)
      r.formulas.push_back({formula_quantities[i].name, formula_texts[i]});
    r.runs = settings.runs, r.seed = settings.seed, r.most_failed = settings.most_failed;
    r.statistics = read_statistics(settings, out, complaints);
    if (complaints.error_count() == 0) set_random(out, std::move(r));
  }

  std::vector<std::string> fuzzy_names() const {
    std::vector<std::string> list;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (!is_random[i]) list.push_back(names[i]);
    return list;
  }
  std::size_t count_random(std::size_t from, std::size_t to) const {
    return static_cast<std::size_t>(std::count(is_random.begin() + static_cast<std::ptrdiff_t>(from),
                                               is_random.begin() + static_cast<std::ptrdiff_t>(to), true));
  }
};

Node parse(const std::string& text, const std::string& name) {
  try {
    return product::parse_document(text, name);
  } catch (const InputError& e) {
    std::vector<Diagnostic> all = e.diagnostics();
    for (Diagnostic& d : all)
      if (d.code == "E104") {
        d.message = "the file of fuzzy inputs is empty";
        d.help = "add a table [inputs] with a line such as fc = { triangular = [10, 25, 45] }";
      }
    throw InputError(all);
  }
}

}  // namespace

Problem read_inputs_text(const std::string& text, const std::string& name) {
  Problem out;
  const Node document = parse(text, name);
  Complaints complaints(name);
  TableReader root(document, "", complaints);
  Reader reader{out, complaints, {}, {}, {}, {}};
  out.title = root.text("title", "");
  reader.read_inputs(root);
  if (complaints.error_count() == 0) reader.read_random(root);
  const product::RandomSettings randomness = product::read_random_settings(root);
  if (complaints.error_count() == 0) {
    reader.read_formulas(root);
    reader.interaction = product::read_interaction(root, reader.names);
  } else {
    root.table("random"), root.table("derived"), root.table("interaction");
  }
  const product::FuzzySearch search = product::read_search(root);
  out.levels = search.levels, out.limit = search.limit, out.seed = search.seed;
  root.finish();
  const bool is_random = !reader.randoms.empty();
  if (complaints.error_count() == 0 && is_random && !randomness.is_given)
    root.missing("randomness", "such as runs = 100 and statistics = [\"mean(tilt)\", \"q95(tilt)\"] below it");
  if (complaints.error_count() == 0 && !is_random && randomness.is_given)
    complaints.error("E207", randomness.place, "randomness: no input is random",
                     "add a table [random] with a line such as fc = { normal = [\"mean_fc\", 3] }");
  if (complaints.error_count() == 0) reader.check_interaction_names();
  if (complaints.error_count() == 0) reader.finish();
  if (complaints.error_count() == 0 && is_random) reader.finish_random(randomness);
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  return out;
}

void set_evaluator(Problem& p, const std::string& command, double timeout, bool is_one_shot) {
  nlohmann::ordered_json identity{{"command", command}};
  if (p.random)
    identity["random"] = nlohmann::ordered_json::parse(p.identity).at("random");
  else
    p.kind = "evaluator";
  p.identity = identity.dump();
  p.settings = nlohmann::ordered_json{{"timeout", timeout}, {"one_shot", is_one_shot}}.dump();
}

}  // namespace topple::study
