#include "collapse/edit_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"

namespace topple::collapse {

namespace {

using Json = nlohmann::ordered_json;
using Kind = Edit::Kind;

constexpr Kind kKinds[] = {Kind::Fire,      Kind::SetDelay, Kind::AddCharge,   Kind::RemoveCharge,
                           Kind::AddPreCut, Kind::AddCable, Kind::RemoveCable, Kind::SetFriction};
constexpr int kMostItems = 1000000;
constexpr int kDeepest = 32;  // copies of what is nested go as deep

[[noreturn]] void refuse(const std::string& message, const std::string& help = {}) {
  throw InputError("E912", message, help);
}

const Json* find(const Json& command, const char* key) {
  const auto it = command.find(key);
  return it == command.end() || it->is_null() ? nullptr : &*it;
}

const Json& demand(const Json& command, const char* key) {
  const Json* value = find(command, key);
  if (value == nullptr) refuse(fmt::format("\"{}\" is missing", key));
  return *value;
}

double number_of(const Json& value, const char* key) {
  if (!value.is_number()) refuse(fmt::format("\"{}\" must be a number", key));
  const double x = value.get<double>();
  if (!std::isfinite(x)) refuse(fmt::format("\"{}\" must be finite", key));
  return x;
}

std::optional<double> read_optional(const Json& command, const char* key) {
  const Json* value = find(command, key);
  if (value == nullptr) return std::nullopt;
  return number_of(*value, key);
}

}  // namespace

Json parse_command(const std::string& text) {
  const auto check_depth = [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepest) throw InputError("E910", fmt::format("nested more than {} levels deep", kDeepest));
    return true;
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::out_of_range&) {
    throw InputError("E910", "a number is larger than any (1.8e308)");
  } catch (const Json::parse_error&) { return Json(Json::value_t::discarded); }
}

double read_number(const Json& command, const char* key) { return number_of(demand(command, key), key); }

double read_number(const Json& command, const char* key, double otherwise) {
  return read_optional(command, key).value_or(otherwise);
}

int read_integer(const Json& command, const char* key, int low, int high) {
  const Json& value = demand(command, key);
  if (!value.is_number_integer()) refuse(fmt::format("\"{}\" must be a whole number", key));
  const bool fits = value.is_number_unsigned()
                        ? value.get<std::uint64_t>() <= static_cast<std::uint64_t>(std::max(high, 0))
                        : value.get<std::int64_t>() <= high;
  if (!fits || (!value.is_number_unsigned() && value.get<std::int64_t>() < low) ||
      (value.is_number_unsigned() && static_cast<std::int64_t>(value.get<std::uint64_t>()) < low))
    refuse(fmt::format("\"{}\" must be {} to {}", key, low, high));
  return value.get<int>();
}

std::string read_text(const Json& command, const char* key) {
  const Json& value = demand(command, key);
  if (!value.is_string()) refuse(fmt::format("\"{}\" must be a text", key));
  return value.get<std::string>();
}

std::string read_text(const Json& command, const char* key, const std::string& otherwise) {
  return find(command, key) == nullptr ? otherwise : read_text(command, key);
}

bool read_flag(const Json& command, const char* key, bool otherwise) {
  const Json* value = find(command, key);
  if (value == nullptr) return otherwise;
  if (!value->is_boolean()) refuse(fmt::format("\"{}\" must be true or false", key));
  return value->get<bool>();
}

void check_keys(const Json& command, const std::vector<std::string>& known) {
  static const std::vector<std::string> common{"id", "command", "session", "branch"};
  for (const auto& [key, value] : command.items()) {
    if (std::count(common.begin(), common.end(), key) || std::count(known.begin(), known.end(), key)) continue;
    std::vector<std::string> all = known;
    all.insert(all.end(), common.begin(), common.end());
    const std::string near = nearest_name(key, all);
    refuse("unknown key \"" + key + "\"", near.empty() ? "" : "did you mean \"" + near + "\"?");
  }
}

std::vector<std::string> edit_words() {
  std::vector<std::string> words;
  for (const Kind k : kKinds) words.emplace_back(word_of(k));
  return words;
}

bool is_edit(const std::string& command) {
  return std::any_of(std::begin(kKinds), std::end(kKinds), [&](Kind k) { return command == word_of(k); });
}

Edit read_edit(const Json& command) {
  Edit e;
  const std::string word = read_text(command, "command");
  const auto it = std::find_if(std::begin(kKinds), std::end(kKinds), [&](Kind k) { return word == word_of(k); });
  if (it == std::end(kKinds)) throw InputError("E911", "\"" + word + "\" is not an edit");
  e.kind = *it;
  const auto keys = [&](std::vector<std::string> known) {
    known.insert(known.end(), {"name", "in_place"});
    check_keys(command, known);
  };
  const auto charge = [&] { e.charge = read_integer(command, "charge", 0, kMostItems); };
  switch (e.kind) {
    case Kind::Fire:
    case Kind::RemoveCharge:
      keys({"charge"});
      charge();
      break;
    case Kind::SetDelay:
      keys({"charge", "stage", "delay", "time"});
      if (find(command, "charge") != nullptr) charge();
      if (find(command, "stage") != nullptr) e.stage = read_integer(command, "stage", 0, kMostItems);
      e.delay = read_optional(command, "delay");
      e.time = read_optional(command, "time");
      break;
    case Kind::AddCharge:
      keys({"member", "position", "destroyed_length", "residual_bars", "residual_concrete", "transition_damage",
            "time"});
      e.member = read_text(command, "member");
      e.position = read_number(command, "position");
      e.destroyed_length = read_number(command, "destroyed_length");
      e.residual_bars = read_number(command, "residual_bars", 0);
      e.residual_concrete = read_number(command, "residual_concrete", 0);
      e.transition_damage = read_number(command, "transition_damage", 0);
      e.time = read_optional(command, "time");
      break;
    case Kind::AddPreCut:
      keys({"member", "at", "cut_bars", "cut_concrete"});
      e.member = read_text(command, "member");
      e.position = read_number(command, "at");
      e.cut_bars = read_number(command, "cut_bars", 0);
      e.cut_concrete = read_number(command, "cut_concrete", 0);
      break;
    case Kind::AddCable: {
      keys({"member", "position", "anchor", "stiffness", "pretension", "strength"});
      e.member = read_text(command, "member");
      e.position = read_number(command, "position");
      const Json& anchor = demand(command, "anchor");
      if (!anchor.is_array() || anchor.size() != 3) refuse("\"anchor\" must be three numbers");
      e.anchor = {number_of(anchor[0], "anchor"), number_of(anchor[1], "anchor"), number_of(anchor[2], "anchor")};
      e.stiffness = read_number(command, "stiffness");
      e.pretension = read_number(command, "pretension", 0);
      e.strength = read_number(command, "strength", 0);
      break;
    }
    case Kind::RemoveCable:
      keys({"cable"});
      e.cable = read_text(command, "cable");
      break;
    case Kind::SetFriction:
      keys({"ground", "bodies"});
      e.ground = read_optional(command, "ground");
      e.bodies = read_optional(command, "bodies");
      break;
  }
  return e;
}

}  // namespace topple::collapse
