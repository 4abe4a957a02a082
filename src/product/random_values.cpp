#include "product/random_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "product/read_fuzzy_values.h"

namespace topple::product {
namespace {

constexpr int most_runs = 1000000;
constexpr std::size_t most_statistics = 100;
constexpr Range anything{-1e12, 1e12};

/// A number, or the name of a fuzzy value.
std::optional<RandomParameter> read_parameter(const Node& node, const std::string& label,
                                              std::optional<Dimension> dimension, Complaints& complaints) {
  RandomParameter p;
  p.place = node.place;
  if (node.kind == Node::Kind::String && (!dimension || is_plain_name(node.text))) {
    if (!is_plain_name(node.text)) {
      complaints.error("E202", node.place, label + ": a number or the name of a fuzzy input is wanted");
      return std::nullopt;
    }
    p.name = node.text;
    return p;
  }
  if (dimension) {
    const int before = complaints.error_count();
    p.value = read_quantity(node, label, *dimension, anything, complaints);
    if (complaints.error_count() > before) return std::nullopt;
    return p;
  }
  if ((node.kind != Node::Kind::Integer && node.kind != Node::Kind::Float) || !std::isfinite(node.number)) {
    complaints.error("E202", node.place, label + ": a number or the name of a fuzzy input is wanted");
    return std::nullopt;
  }
  p.value = node.number;
  return p;
}

std::vector<std::string> names_of_distributions() {
  std::vector<std::string> names;
  for (const Distribution& d : distributions) names.emplace_back(d.name);
  return names;
}

}  // namespace

const Distribution* find_distribution(const std::string& name) {
  for (const Distribution& d : distributions)
    if (name == d.name) return &d;
  return nullptr;
}

std::string find_distribution_fault(const Distribution& d, double first, double second) {
  const std::string name = d.name;
  if (!std::isfinite(first) || !std::isfinite(second)) return "a parameter is not finite";
  if (name == "uniform") return first <= second ? "" : "the lower end lies above the upper end";
  if (name == "weibull") {
    if (!(first > 0)) return "the scale is not above 0";
    return second > 0 ? "" : "the shape is not above 0";
  }
  if (name == "lognormal" && !(first > 0)) return "the mean is not above 0";
  return second >= 0 ? "" : "the standard deviation is below 0";
}

bool is_plain_name(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !name.empty() && is_letter(name[0]) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

bool says_distribution(const Node& node) {
  return node.kind == Node::Kind::Table && std::any_of(std::begin(distributions), std::end(distributions),
                                                       [&](const Distribution& d) { return node.find(d.name); });
}

std::optional<RandomValue> read_distribution(TableReader& table, std::optional<Dimension> dimension) {
  RandomValue v;
  v.place = table.place();
  const Node* list = nullptr;
  for (const Distribution& d : distributions) {
    const Node* node = table.find(d.name);
    if (!node) continue;
    if (list) {
      table.error("E207", node->place, fmt::format("{} and {}: one of them is wanted", v.distribution->name, d.name));
      return std::nullopt;
    }
    list = node, v.distribution = &d;
  }
  if (!list) {
    table.error("E207", table.place(), "a distribution is wanted: " + list_of(names_of_distributions()), random_help);
    return std::nullopt;
  }
  const Distribution& d = *v.distribution;
  if (list->kind != Node::Kind::Array || list->items.size() != 2) {
    table.error("E202", list->place,
                fmt::format("{}: a list of two is wanted: {} and {}", d.name, d.parameters[0], d.parameters[1]),
                "each a number or the name of a fuzzy value");
    return std::nullopt;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const bool is_shape = d.has_shape && i == 1;
    const auto p =
        read_parameter(list->items[i], fmt::format("{}: {}", table.label(), d.parameters[i]),
                       is_shape && dimension ? std::optional(Dimension::Number) : dimension, table.complaints());
    if (!p) return std::nullopt;
    v.parameters[i] = *p;
  }
  return v;
}

RandomSettings read_random_settings(TableReader& parent) {
  RandomSettings out;
  const Node* node = parent.table("randomness");
  if (!node) return out;
  TableReader table(*node, parent.label().empty() ? "randomness" : parent.label() + ": randomness",
                    parent.complaints());
  out.is_given = true;
  out.place = node->place;
  out.runs = static_cast<int>(table.integer("runs", 2, most_runs));
  out.seed =
      static_cast<std::uint64_t>(table.find_integer("seed", 0, std::numeric_limits<std::int64_t>::max()).value_or(1));
  out.most_failed = table.quantity("most_failed", Dimension::Number, {0, 1}, 0);
  out.statistics = table.required_words("statistics", "[\"mean(tilt)\", \"q95(tilt)\", \"p(tilt > 3)\"]");
  if (out.statistics.size() > most_statistics)
    table.error("E209", table.place_of("statistics"), fmt::format("more than {} statistics", most_statistics));
  table.finish();
  return out;
}

void check_distribution(const RandomValue& v, const std::array<std::array<double, 2>, 2>& ends,
                        const std::string& label, Complaints& complaints) {
  const Distribution& d = *v.distribution;
  for (const double first : ends[0])
    for (const double second : ends[1]) {
      const std::string fault = find_distribution_fault(d, first, second);
      if (fault.empty()) continue;
      // the parameter that is named, or the list
      const bool is_second = fault.find(d.parameters[1]) != std::string::npos;
      const RandomParameter& p = v.parameters[is_second ? 1 : 0];
      complaints.error(
          "E207", p.place,
          fmt::format("{}: {}{}", label, fault, p.name.empty() ? std::string() : " somewhere within " + quoted(p.name)),
          "parameters must give a distribution everywhere within their fuzzy numbers");
      return;
    }
}

}  // namespace topple::product
