#pragma once
/// A validator of JSON Schema, as much of it as docs/mbs-model.schema.json uses.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>

namespace topple::mbs::test {

class Schema {
 public:
  using Json = nlohmann::ordered_json;
  explicit Schema(Json root) : root_(std::move(root)) {}
  const Json& root() const { return root_; }

  /// Empty if the value is valid, else the first thing that is wrong with it. Throws on a keyword it does not know.
  std::string fault(const Json& value) const { return fault(value, root_, "file"); }

 private:
  static bool has_type(const Json& v, const std::string& type) {
    if (type == "object") return v.is_object();
    if (type == "array") return v.is_array();
    if (type == "string") return v.is_string();
    if (type == "boolean") return v.is_boolean();
    if (type == "integer") return v.is_number_integer();
    if (type == "number") return v.is_number();
    if (type == "null") return v.is_null();
    throw std::logic_error("schema: type " + type);
  }

  int count_valid(const Json& v, const Json& alternatives, const std::string& at) const {
    return static_cast<int>(std::count_if(alternatives.begin(), alternatives.end(),
                                          [&](const Json& s) { return fault(v, s, at).empty(); }));
  }

  std::string fault(const Json& v, const Json& schema, const std::string& at) const {
    if (schema.is_boolean()) return schema.get<bool>() ? "" : at + " must not be";
    for (const auto& [keyword, rule] : schema.items())
      if (const std::string f = fault_of(keyword, rule, v, schema, at); !f.empty()) return f;
    return "";
  }

  std::string fault_of(const std::string& keyword, const Json& rule, const Json& v, const Json& schema,
                       const std::string& at) const {
    static const std::set<std::string> silent = {"$schema", "title", "description", "default", "$defs", "then", "else"};
    if (silent.contains(keyword)) return "";
    const auto wrong = [&](bool is_wrong) {
      return is_wrong ? at + ": " + keyword + " " + rule.dump() : std::string();
    };
    if (keyword == "$ref") return fault(v, root_["$defs"].at(rule.get<std::string>().substr(8)), at);
    if (keyword == "type") {
      if (rule.is_string()) return wrong(!has_type(v, rule));
      return wrong(std::none_of(rule.begin(), rule.end(), [&](const Json& t) { return has_type(v, t); }));
    }
    if (keyword == "const") return wrong(v != rule);
    if (keyword == "enum") return wrong(std::find(rule.begin(), rule.end(), v) == rule.end());
    if (keyword == "minimum") return wrong(v.is_number() && v.get<double>() < rule.get<double>());
    if (keyword == "maximum") return wrong(v.is_number() && v.get<double>() > rule.get<double>());
    if (keyword == "exclusiveMinimum") return wrong(v.is_number() && v.get<double>() <= rule.get<double>());
    if (keyword == "minLength") return wrong(v.is_string() && v.get<std::string>().size() < rule.get<size_t>());
    if (keyword == "minItems") return wrong(v.is_array() && v.size() < rule.get<size_t>());
    if (keyword == "maxItems") return wrong(v.is_array() && v.size() > rule.get<size_t>());
    if (keyword == "anyOf") return wrong(count_valid(v, rule, at) < 1);
    if (keyword == "oneOf") return wrong(count_valid(v, rule, at) != 1);
    if (keyword == "allOf") return wrong(count_valid(v, rule, at) != static_cast<int>(rule.size()));
    if (keyword == "not") return wrong(fault(v, rule, at).empty());
    if (keyword == "if") {
      const char* branch = fault(v, rule, at).empty() ? "then" : "else";
      return schema.contains(branch) ? fault(v, schema[branch], at) : "";
    }
    if (keyword == "items") {
      for (size_t i = 0; v.is_array() && i < v.size(); ++i)
        if (const std::string f = fault(v[i], rule, at + "[" + std::to_string(i) + "]"); !f.empty()) return f;
      return "";
    }
    if (!v.is_object() && (keyword == "required" || keyword == "properties" || keyword == "additionalProperties" ||
                           keyword == "dependentRequired"))
      return "";
    if (keyword == "required")
      return wrong(
          std::any_of(rule.begin(), rule.end(), [&](const Json& k) { return !v.contains(k.get<std::string>()); }));
    if (keyword == "dependentRequired") {
      for (const auto& [key, others] : rule.items())
        for (const Json& other : others)
          if (v.contains(key) && !v.contains(other.get<std::string>())) return wrong(true);
      return "";
    }
    if (keyword == "properties") {
      for (const auto& [key, rule_of_key] : rule.items())
        if (v.contains(key))
          if (const std::string f = fault(v[key], rule_of_key, at + "." + key); !f.empty()) return f;
      return "";
    }
    if (keyword == "additionalProperties" && rule == false) {
      for (const auto& [key, value] : v.items())
        if (!schema["properties"].contains(key)) return at + ": unknown key " + key;
      return "";
    }
    throw std::logic_error("schema: keyword " + keyword);
  }

  Json root_;
};

}  // namespace topple::mbs::test
