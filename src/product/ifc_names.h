#pragma once
/// What the names of materials in an IFC file say, and what a plan calls them.

#include <map>
#include <optional>
#include <set>
#include <string>

namespace topple::product {

/// A class of Eurocode 2.
struct ConcreteClass {
  std::string name;  // "C20/25"
  int fck = 0;       // [N/mm2]
  bool is_light = false;
};

/// The first class in the name of a material: C8/10 to C100/115, LC likewise. Numbers beyond are no class.
std::optional<ConcreteClass> find_class(const std::string& name);

/// Yield strength that a grade names in N/mm2: its only number of 200 to 690 (of 420/500 the first one); none in
/// other units.
std::string find_yield(const std::string& grade);

bool is_masonry(const std::string& name);
/// Whether the name is a word for concrete, with a class or without.
bool is_concrete(const std::string& name);

/// Names of materials as keys of a plan, each of its own.
class Keys {
 public:
  const std::string& of(const std::string& name);

 private:
  std::map<std::string, std::string> keys_;
  std::set<std::string> taken_;
};

}  // namespace topple::product
