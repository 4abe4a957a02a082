#include "study/inputs_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "product/expression.h"
#include "product/interaction.h"
#include "product/read_fuzzy_values.h"
#include "product/table_reader.h"

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
  std::vector<std::string> names;    // inputs, then formulas that were read
  std::vector<Expression> formulas;  // each may use inputs and the formulas before it
  std::vector<Place> formula_places;
  product::Interaction interaction;

  /// Numbers of a list, or nothing after a complaint.
  std::optional<std::vector<double>> read_numbers(const Node& node, const std::string& label, std::size_t count) {
    if (node.kind != Node::Kind::Array || (count > 0 && node.items.size() != count)) {
      complaints.error("E202", node.place, fmt::format("{}: a list of {} numbers is wanted", label, count));
      return std::nullopt;
    }
    std::vector<double> numbers;
    for (const Node& item : node.items) {
      if ((item.kind != Node::Kind::Integer && item.kind != Node::Kind::Float) || !std::isfinite(item.number)) {
        complaints.error("E202", item.place, label + ": a finite number without a unit is wanted",
                         "give the unit beside it: unit = \"N/mm2\"");
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
    const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const bool is_name = !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
      return is_letter(c) || (c >= '0' && c <= '9');
    });
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
        names.push_back(entry.key);
        out.derived.push_back({entry.key, unit, 1});
      }
    }
  }

  /// Gives the problem its functions, and tries them at the middle.
  void finish() {
    if (!formulas.empty())
      out.calc_derived = [formulas = formulas](const Point& x) {
        std::vector<double> values = x, derived;
        for (const Expression& f : formulas) {
          derived.push_back(f.evaluate(values));
          values.push_back(derived.back());
        }
        return derived;
      };
    const auto complete = [calc = out.calc_derived](const Point& x) {
      std::vector<double> values = x;
      if (calc)
        for (const double v : calc(x)) values.push_back(v);
      return values;
    };
    const auto shared = std::make_shared<const product::Interaction>(interaction);
    for (std::size_t i = 0; i < shared->constraints.size(); ++i)
      out.space.constraints.emplace_back(
          [complete, shared, i](const Point& x) { return product::calc_excess(*shared, i, complete(x)); });
    if (shared->joint)
      out.space.joint = [complete, shared](const Point& x) { return product::calc_joint(*shared, complete(x)); };
    const Point centre = uncertainty::calc_centre(out.space);
    const std::vector<double> values = complete(centre);
    for (std::size_t i = 0; i < out.derived.size(); ++i)
      if (!std::isfinite(values[centre.size() + i]))
        complaints.error("E207", formula_places[i],
                         out.derived[i].name + ": the formula has no value in the middle of the inputs");
    product::check_interaction(interaction, values, "interaction", "the inputs", complaints);
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
  if (complaints.error_count() == 0) {
    reader.read_formulas(root);
    reader.interaction = product::read_interaction(root, reader.names);
  } else {
    root.table("derived"), root.table("interaction");
  }
  const product::FuzzySearch search = product::read_search(root);
  out.levels = search.levels, out.limit = search.limit, out.seed = search.seed;
  root.finish();
  if (complaints.error_count() == 0) reader.finish();
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  return out;
}

void set_evaluator(Problem& p, const std::string& command, double timeout, bool is_one_shot) {
  p.kind = "evaluator";
  p.identity = nlohmann::ordered_json{{"command", command}}.dump();
  p.settings = nlohmann::ordered_json{{"timeout", timeout}, {"one_shot", is_one_shot}}.dump();
}

}  // namespace topple::study
