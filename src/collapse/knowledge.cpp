#include "collapse/knowledge.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/error.h"
#include "collapse/knowledge_data.h"
#include "mbs/json_document.h"
#include "mbs/laws.h"

namespace topple::collapse {

namespace {

using Field = double Knowledge::*;

const std::map<std::string, Field>& fields() {
  static const std::map<std::string, Field> table{
      {"zone.length_by_depth", &Knowledge::zone_length_by_depth},
      {"zone.length_by_span", &Knowledge::zone_length_by_span},
      {"zone.length_by_bar", &Knowledge::zone_length_by_bar},
      {"zone.length_at_most", &Knowledge::zone_length_at_most},
      {"zone.rupture_rotation", &Knowledge::zone_rupture_rotation},
      {"zone.slip_softening", &Knowledge::zone_slip_softening},
      {"zone.slip_rupture", &Knowledge::zone_slip_rupture},
      {"zone.rupture_rotation_pressed", &Knowledge::zone_rupture_rotation_pressed},
      {"zone.twist_rupture", &Knowledge::zone_twist_rupture},
      {"zone.biaxial_exponent", &Knowledge::zone_biaxial_exponent},
      {"zone.damping_ratio", &Knowledge::zone_damping_ratio},
      {"zone.elongation_share", &Knowledge::zone_elongation_share},
      {"member.uncracked_share", &Knowledge::member_uncracked_share},
      {"slab.flange_share", &Knowledge::slab_flange_share},
      {"slab.distribution_share", &Knowledge::slab_distribution_share},
      {"slab.elongation_lengths", &Knowledge::slab_elongation_lengths},
      {"wall.stiffness_share", &Knowledge::wall_stiffness_share},
      {"wall.axial_share", &Knowledge::wall_axial_share},
      {"wall.crush_share", &Knowledge::wall_crush_share},
      {"charge.release_time", &Knowledge::charge_release_time},
      {"charge.cage_rupture_rotation", &Knowledge::charge_cage_rupture_rotation},
      {"charge.transition_reach", &Knowledge::charge_transition_reach},
      {"charge.scatter_limit", &Knowledge::charge_scatter_limit},
      {"body.least_radius_of_gyration", &Knowledge::body_least_radius_of_gyration},
      {"body.highest_frequency", &Knowledge::body_highest_frequency},
      {"contact.gap", &Knowledge::contact_gap},
      {"contact.body_friction", &Knowledge::contact_body_friction},
      {"contact.body_restitution", &Knowledge::contact_body_restitution},
      {"contact.frequency", &Knowledge::contact_frequency},
      {"rest.speed", &Knowledge::rest_speed},
      {"rest.time", &Knowledge::rest_time},
      {"stands.displacement", &Knowledge::stands_displacement},
      {"stands.drift", &Knowledge::stands_drift},
      {"mechanism.moved_displacement", &Knowledge::mechanism_moved_displacement},
      {"mechanism.stands_share", &Knowledge::mechanism_stands_share},
      {"mechanism.partial_share", &Knowledge::mechanism_partial_share},
      {"mechanism.topple_rear_share", &Knowledge::mechanism_topple_rear_share},
      {"mechanism.topple_rotation", &Knowledge::mechanism_topple_rotation},
      {"mechanism.coherent_share", &Knowledge::mechanism_coherent_share},
      {"mechanism.fold_share", &Knowledge::mechanism_fold_share},
      {"mechanism.fold_rotation", &Knowledge::mechanism_fold_rotation},
      {"mechanism.direction_tolerance", &Knowledge::mechanism_direction_tolerance},
      {"mechanism.together_share", &Knowledge::mechanism_together_share},
      {"mechanism.aborted_rotation", &Knowledge::mechanism_aborted_rotation},
      {"verification.energy_error", &Knowledge::verification_energy_error},
      {"verification.step_time", &Knowledge::verification_step_time},
      {"verification.step_tilt", &Knowledge::verification_step_tilt},
      {"verification.equilibrium_residual", &Knowledge::verification_equilibrium_residual},
  };
  return table;
}

/// Of rules that the multibody model, or what they mean, bounds on both sides. Sound crosses 4 cm of concrete in the
/// time of 1/1e5 s.
const std::map<std::string, std::pair<double, double>>& ranges() {
  static const std::map<std::string, std::pair<double, double>> list = {
      {"member.uncracked_share", {0, 1}},     {"slab.flange_share", {0, 1}},    {"slab.distribution_share", {0, 1}},
      {"contact.body_restitution", {0, 1}},   {"zone.damping_ratio", {0, 0.2}}, {"zone.biaxial_exponent", {1, 10}},
      {"body.highest_frequency", {300, 1e5}}, {"contact.frequency", {0, 1e5}}};
  return list;
}

/// Unit of each rule, as the program's own set has it.
const std::map<std::string, std::string>& units() {
  static const std::map<std::string, std::string> list = [] {
    std::map<std::string, std::string> all;
    const nlohmann::json document = nlohmann::json::parse(kKnowledgeText);
    for (const nlohmann::json& rule : document["rules"]) all[rule["id"]] = rule["unit"];
    return all;
  }();
  return list;
}

}  // namespace

Knowledge read_knowledge(const std::string& text, const std::string& name) {
  using nlohmann::json;
  std::vector<Diagnostic> complaints;
  constexpr const char* help = "`topple rules --json` writes a whole set";
  std::optional<mbs::JsonDocument> places;
  try {
    places.emplace(text, name);
  } catch (const InputError& e) {
    complaints = e.diagnostics();
    for (Diagnostic& d : complaints) d.help = help;
    throw InputError(complaints);
  }
  std::string at;  // path of the rule in hand
  const auto complain = [&](const std::string& what) {
    complaints.push_back(places->make_diagnostic("E661", at, what, help));
  };
  Knowledge knowledge{};
  const json document = json::parse(text);
  if (!document.is_object() || !document.contains("rules") || !document["rules"].is_array()) {
    complain("is not a JSON object with a list \"rules\"");
    throw InputError(complaints);
  }
  std::map<std::string, bool> seen;
  for (const json& entry : document["rules"]) {
    at = "rules[" + std::to_string(&entry - &document["rules"].front()) + "]";
    Rule rule;
    const auto word = [&](const char* key) {
      return entry.is_object() && entry.contains(key) && entry[key].is_string() ? entry[key].get<std::string>()
                                                                                : std::string();
    };
    rule.id = word("id"), rule.unit = word("unit"), rule.text = word("text"), rule.reason = word("reason");
    if (rule.id.empty() || rule.text.empty() || rule.reason.empty()) {
      complain("a rule without id, text or reason: " + entry.dump().substr(0, 80));
      continue;
    }
    const auto field = fields().find(rule.id);
    if (field == fields().end()) {
      std::vector<std::string> known;
      for (const auto& [id, f] : fields()) known.push_back(id);
      const std::string near = nearest_name(rule.id, known);
      complain("there is no rule \"" + rule.id + "\"" + (near.empty() ? "" : "; did you mean \"" + near + "\"?"));
      continue;
    }
    if (seen[rule.id]) {
      complain("rule \"" + rule.id + "\" is given twice");
      continue;
    }
    seen[rule.id] = true;
    if (const std::string& unit = units().at(rule.id); rule.unit != unit) {
      const std::string whole = at;
      if (entry.contains("unit")) at += ".unit";
      complain(fmt::format("rule \"{}\" has the unit \"{}\", not \"{}\"", rule.id, unit, rule.unit));
      at = whole;
    }
    const auto limits = ranges().find(rule.id);
    const auto [low, high] = limits == ranges().end() ? std::pair{0.0, mbs::kUnlimited} : limits->second;
    const bool may_be_zero = rule.id == "zone.elongation_share" || (low == 0 && high == 1);
    const double value = entry.contains("value") && entry["value"].is_number() ? entry["value"].get<double>() : -1;
    if (!std::isfinite(value) || value < low || value > high || (value == 0 && !may_be_zero)) {
      at += ".value";
      complain(fmt::format("rule \"{}\" needs a value {}", rule.id,
                           low > 0 || (may_be_zero && high < mbs::kUnlimited)
                               ? fmt::format("from {:g} to {:g}", low, high)
                           : may_be_zero            ? ">= 0"
                           : high < mbs::kUnlimited ? fmt::format("> 0, at most {:g}", high)
                                                    : "> 0"));
      continue;
    }
    rule.value = value;
    knowledge.*(field->second) = rule.value;
    knowledge.rules.push_back(std::move(rule));
  }
  at.clear();
  for (const auto& [id, field] : fields())
    if (!seen[id]) complain("rule \"" + id + "\" is missing");
  if (!complaints.empty()) throw InputError(complaints);
  return knowledge;
}

const Knowledge& default_knowledge() {
  static const Knowledge knowledge = read_knowledge(kKnowledgeText, "data/knowledge.json");
  return knowledge;
}

}  // namespace topple::collapse
