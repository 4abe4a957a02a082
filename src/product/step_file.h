#pragma once
/// Exchange files of ISO 10303-21 ("STEP"), as far as IFC needs them: numbered entities with their arguments.

#include <map>
#include <string>
#include <vector>

namespace topple::product {

struct StepValue {
  enum class Kind { Null, Number, Text, Word, Reference, List };
  Kind kind = Kind::Null;  // $ and * are Null
  double number = 0;       // of a Number; the id of a Reference
  std::string text;        // UTF-8; a Word without its dots; of a typed List its type, "IFCARCINDEX"
  std::vector<StepValue> items;

  int id() const { return kind == Kind::Reference ? static_cast<int>(number) : 0; }
};

struct StepEntity {
  int id = 0;
  int line = 1;  // where it begins
  int column = 1;
  std::string type;  // upper case
  std::vector<StepValue> arguments;
  /// The i-th argument; Null beyond the last.
  const StepValue& at(size_t i) const;
};

struct StepFile {
  std::string schema;  // "IFC4"
  std::map<int, StepEntity> entities;
  /// nullptr if there is none.
  const StepEntity* find(int id) const;
  std::vector<const StepEntity*> of_type(const std::string& type) const;
};

/// Typed values such as IFCLABEL('x') read as what is inside. Throws InputError E111 with line and column.
StepFile read_step(const std::string& text, const std::string& name);

}  // namespace topple::product
