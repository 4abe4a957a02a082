#pragma once
/// A JSON text whose values know their path and place, for complaints: strict JSON, keys given once, bounded nesting.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/linalg.h"

namespace topple::mbs {

using Json = nlohmann::ordered_json;

class JsonNode;

class JsonDocument {
 public:
  /// `name` stands for the file. Throws InputError (E611) with line and column: not JSON, empty, a key given twice in
  /// an object, nested deeper than 32, a number too large for a double.
  JsonDocument(std::string text, std::string name);
  JsonDocument(const JsonDocument&) = delete;
  JsonDocument& operator=(const JsonDocument&) = delete;

  JsonNode root() const;

  /// A complaint at a path such as "joints[3].X_PF.q"; placed at the deepest part of the path that the text has.
  Diagnostic make_diagnostic(std::string code, std::string_view path, std::string message, std::string help = {}) const;

 private:
  friend class JsonNode;
  std::string path_of(const Json& value) const;

  std::string text_, name_;
  Json root_;
};

/// A value of a document. Every access that does not fit throws InputError (E610) naming path, line and column.
class JsonNode {
 public:
  JsonNode(const Json& json, const JsonDocument& document) : json_(&json), document_(&document) {}

  [[noreturn]] void fail(const std::string& what, const std::string& help = {}) const;
  /// About the value of a key, or about the object if it has none of this name.
  [[noreturn]] void fail_at(const std::string& key, const std::string& what, const std::string& help = {}) const;
  std::string path() const;

  bool has(const char* key) const { return json_->is_object() && json_->contains(key); }
  bool is_number() const { return json_->is_number(); }
  bool is_text() const { return json_->is_string(); }
  bool is_list() const { return json_->is_array(); }
  bool is_object() const { return json_->is_object(); }
  bool is_null() const { return json_->is_null(); }
  /// The value of a required key.
  JsonNode operator[](const char* key) const;
  std::vector<JsonNode> items() const;
  double number() const;
  double positive() const;
  /// A whole number from `low` to a hundred million.
  int integer(int low) const;
  bool flag() const;
  std::string text() const;
  std::vector<double> numbers() const;
  Vec3 vec3() const;
  /// A direction, made a unit vector.
  Vec3 direction() const;
  Mat3 mat3() const;
  /// {"p": [..], "q": [..]}, or a turn by an angle about an axis instead of q; what is left out is no shift, no turn.
  Pose pose() const;
  /// One of `words`, the nearest of which is proposed otherwise; its index.
  int word(const std::vector<std::string>& words) const;
  /// Keys beyond those known are typing errors.
  void only(const std::vector<std::string>& known) const;

 private:
  const Json* json_;
  const JsonDocument* document_;
};

inline JsonNode JsonDocument::root() const { return {root_, *this}; }

}  // namespace topple::mbs
