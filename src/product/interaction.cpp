#include "product/interaction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "product/read_fuzzy_values.h"

namespace topple::product {
namespace {

std::optional<Constraint> read_constraint(const Node& item, const std::string& label,
                                          const std::vector<std::string>& names, Complaints& complaints) {
  const size_t sign = item.kind == Node::Kind::String ? item.text.find_first_of("<>") : std::string::npos;
  if (sign == std::string::npos || sign + 1 >= item.text.size() || item.text[sign + 1] != '=') {
    complaints.error("E202", item.place, label + ": constraints: a text with <= or >= is wanted",
                     "such as \"x1 + x2 <= 3\"");
    return std::nullopt;
  }
  const auto left = parse_formula(item, 0, sign, label + ": constraint", names, complaints);
  const auto right = parse_formula(item, sign + 2, std::string::npos, label + ": constraint", names, complaints);
  if (!left || !right) return std::nullopt;
  return Constraint{*left, *right, item.text[sign] == '>', item.place, item.text};
}

/// Whether what a formula uses has values; where one has none the run fails, which is no matter of the interaction.
bool has_values(const Expression& e, std::span<const double> values) {
  return std::ranges::none_of(e.used(), [&](int i) { return std::isnan(values[static_cast<size_t>(i)]); });
}

}  // namespace

double calc_excess(const Interaction& interaction, size_t constraint, std::span<const double> values) {
  const Constraint& c = interaction.constraints[constraint];
  if (!has_values(c.left, values) || !has_values(c.right, values)) return 0;
  const double left = c.left.evaluate(values), right = c.right.evaluate(values);
  const double g =
      (c.is_at_least ? right - left : left - right) - Interaction::slack * std::max(std::abs(left), std::abs(right));
  return std::isnan(g) ? std::numeric_limits<double>::infinity() : g;
}

double calc_joint(const Interaction& interaction, std::span<const double> values) {
  if (!interaction.joint || !has_values(*interaction.joint, values)) return 1;
  const double mu = interaction.joint->evaluate(values);
  if (std::isnan(mu)) return 0;
  return mu >= 1 - Interaction::slack ? 1 : std::max(mu, 0.0);
}

bool is_possible(const Interaction& interaction, std::span<const double> values) {
  for (size_t i = 0; i < interaction.constraints.size(); ++i)
    if (calc_excess(interaction, i, values) > 0) return false;
  return calc_joint(interaction, values) > 0;
}

Interaction read_interaction(TableReader& parent, const std::vector<std::string>& names) {
  Interaction out;
  const Node* node = parent.table("interaction");
  if (!node) return out;
  Complaints& complaints = parent.complaints();
  TableReader table(*node, parent.label().empty() ? "interaction" : parent.label() + ": interaction", complaints);
  if (const Node* list = table.find("constraints")) {
    if (list->kind != Node::Kind::Array) {
      table.error("E202", list->place, "constraints: a list of texts is wanted", "such as [\"x1 + x2 <= 3\"]");
    } else {
      for (const Node& item : list->items)
        if (auto c = read_constraint(item, table.label(), names, complaints)) out.constraints.push_back(std::move(*c));
    }
  }
  if (const Node* text = table.find("membership")) {
    out.joint_place = text->place, out.joint_text = text->text;
    if (text->kind != Node::Kind::String)
      table.error("E202", text->place, "membership: a formula is wanted");
    else
      out.joint = parse_formula(*text, 0, std::string::npos, table.label() + ": membership", names, complaints);
  }
  table.finish();
  return out;
}

void check_interaction(const Interaction& interaction, std::span<const double> values, const std::string& label,
                       const std::string& middle, Complaints& complaints) {
  for (size_t i = 0; i < interaction.constraints.size(); ++i)
    if (calc_excess(interaction, i, values) > 0)
      complaints.error("E207", interaction.constraints[i].place,
                       fmt::format("{}: the middle of {} breaks this constraint", label, middle),
                       "the most possible values must keep every constraint");
  if (!interaction.joint) return;
  const double mu = interaction.joint->evaluate(values);
  if (!(std::abs(mu - 1) <= Interaction::slack))
    complaints.error("E207", interaction.joint_place,
                     fmt::format("{}: membership: {} in the middle of {}; 1 is wanted", label, mu, middle),
                     "a joint membership lies between 0 and 1");
}

}  // namespace topple::product
