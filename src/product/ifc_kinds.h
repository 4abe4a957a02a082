#pragma once
/// Of which kinds the entities of an IFC file are, and of which materials.

#include <map>
#include <set>
#include <string>

#include "product/step_file.h"

namespace topple::product {

/// Columns, beams, slabs and walls, and parts of the structure that are told as left out, in all their spellings.
const std::set<std::string>& element_types();
/// Parts of buildings that are only counted.
const std::set<std::string>& other_types();

struct IfcMaterial {
  std::string name;
  double carrying = 0, layers = 0;  // thickness of the layers of this material, and of all [units of the file]
};
/// Materials by the ids of elements and types. Of several layers the thickest one of concrete or masonry carries, else
/// the thickest one.
std::map<int, IfcMaterial> read_materials(const StepFile&);

}  // namespace topple::product
