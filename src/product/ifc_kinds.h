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

/// Names of materials by the ids of elements and types.
std::map<int, std::string> read_materials(const StepFile&);

}  // namespace topple::product
