#include "product/plan_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "product/read_fuzzy_values.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr int most_corner_members = 200000;  // members that are read for all corners together

/// The value at a place, made if only its key is missing.
void set_value(Node& document, const DocumentPath& place, const std::string& text) {
  Node* node = &document;
  for (const DocumentStep& step : place) {
    if (step.item >= 0) {
      node = &node->items[static_cast<size_t>(step.item)];
      continue;
    }
    auto entry =
        std::find_if(node->entries.begin(), node->entries.end(), [&](const Entry& e) { return e.key == step.key; });
    if (entry == node->entries.end()) {
      Entry added{step.key, node->place, {}};
      added.value.place = node->place;
      entry = node->entries.insert(entry, std::move(added));
    }
    node = &entry->value;
  }
  node->kind = Node::Kind::String;
  node->text = text;
}

Plan read_sample(const FuzzyPlan& fuzzy, const Node& document, const std::string& path, std::span<const double> point) {
  Node changed = document;
  const auto put = [&](size_t i, double value) {
    const std::string text = fmt::format("{} {}", value, fuzzy.si[i]);
    for (const DocumentPath& place : fuzzy.places[i]) set_value(changed, place, text);
  };
  for (size_t i = 0; i < fuzzy.inputs.size(); ++i) put(i, point[i]);
  const std::vector<double> derived = calc_derived(fuzzy, point);
  for (size_t i = 0; i < derived.size(); ++i) {
    if (!std::isfinite(derived[i]))
      throw InputError("E207", fuzzy.derived[i].path + ": the formula has no value", fuzzy.derived[i].text);
    put(fuzzy.inputs.size() + i, derived[i]);
  }
  Complaints complaints(path);
  Plan plan = read_plan_document(changed, path, complaints, true);
  if (complaints.error_count() > 0) {
    complaints.sort();
    std::vector<Diagnostic> errors;
    for (const Diagnostic& d : complaints.all())
      if (d.severity == Severity::Error) errors.push_back(d);
    throw InputError(errors);
  }
  return plan;
}

}  // namespace

std::vector<double> calc_derived(const FuzzyPlan& f, std::span<const double> point) {
  std::vector<double> out, values;
  for (size_t i = 0; i < f.derived.size(); ++i) {
    values.clear();
    for (const FuzzyOperand& o : f.operands[i])
      values.push_back((o.input >= 0 ? point[static_cast<size_t>(o.input)] : o.value) / o.unit);
    out.push_back(f.derived[i].expression.evaluate(values) * f.derived_unit[i]);
  }
  return out;
}

bool follows_from_random(const FuzzyPlan& f, std::size_t derived) {
  const std::vector<int>& used = f.derived[derived].expression.used();
  return std::any_of(used.begin(), used.end(), [&](int i) {
    return f.operands[derived][static_cast<std::size_t>(i)].input >= static_cast<int>(f.fuzzy_count());
  });
}

std::vector<double> calc_interacting(const FuzzyPlan& f, std::span<const double> point) {
  std::vector<double> values;
  for (size_t i = 0; i < f.inputs.size(); ++i) values.push_back(point[i] / f.input_unit[i]);
  const std::vector<double> derived = calc_derived(f, point);
  for (size_t i = 0; i < derived.size(); ++i) values.push_back(derived[i] / f.derived_unit[i]);
  return values;
}

bool is_possible(const FuzzyPlan& f, std::span<const double> point) {
  return f.interaction.is_empty() || is_possible(f.interaction, calc_interacting(f, point));
}

std::vector<double> calc_centre(const FuzzyPlan& f) { return centre_of(f.inputs); }

PlanSampler make_sampler(const Plan& plan) {
  PlanSampler s{plan.fuzzy, plan.path, plan.text, parse_document(plan.text, plan.path)};
  std::erase_if(s.document.entries, [](const Entry& e) { return e.key == "fuzzy"; });
  return s;
}

Plan make_sample(const PlanSampler& s, std::span<const double> point) {
  Plan plan = read_sample(s.fuzzy, s.document, s.path, point);
  plan.text = s.text;
  return plan;
}

void try_samples(const Plan& plan, const Node& document, Complaints& complaints) {
  const FuzzyPlan& fuzzy = plan.fuzzy;
  if (fuzzy.is_empty()) return;
  const size_t n = fuzzy.inputs.size();
  const std::vector<double> centre = calc_centre(fuzzy);
  const auto refusal = [&](const std::vector<double>& point) -> std::string {
    if (!is_possible(fuzzy, point)) return {};  // no sample is there
    try {
      read_sample(fuzzy, document, plan.path, point);
      return {};
    } catch (const InputError& e) {
      const Diagnostic& first = e.first_error();
      return first.help.empty() ? first.message : first.message + " (" + first.help + ")";
    }
  };
  const auto place_of = [](const FuzzyValue& v) {
    return Place{v.where.line, v.where.column, static_cast<int>(v.name.size())};
  };
  if (const std::string why = refusal(centre); !why.empty()) {
    const SourcePosition& where = n > 0 ? fuzzy.inputs[0].where : fuzzy.derived[0].where;
    complaints.error("E207", {where.line, where.column, 1},
                     "fuzzy: the plan is refused in the middle of the fuzzy values: " + why);
    return;
  }
  try_ends(fuzzy.inputs, refusal, "fuzzy: ", place_of, complaints);
  if (complaints.error_count() > 0 || n > most_corner_inputs || plan.members.size() << n > most_corner_members) return;
  const RefusedCorners corners = try_corners(fuzzy.inputs, refusal);
  if (corners.count.empty()) return;
  complaints.warn("W507", place_of(fuzzy.inputs[0]),
                  "fuzzy: " + corners.count + " of the fuzzy values are no plan; samples there count as failed",
                  "first: " + corners.first);
}

}  // namespace topple::product
