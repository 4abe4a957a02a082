#pragma once
/// Buildings and sites out of the files of other programs, as text of a plan with its gaps marked "?".

#include <string>
#include <vector>

#include "product/ifc_elements.h"

namespace topple::product {

/// What became of what was in the file, in sentences.
struct ImportReport {
  std::vector<std::string> taken, guessed, missing;
};
struct Import {
  std::string text;  // TOML
  ImportReport report;
};

/// A plan on the grid of the building's columns. What the file does not say stands as "?", which read_plan refuses
/// (E211).
Import make_plan_text(const IfcBuilding&, const std::string& file_name);

/// Closed outlines of a DXF drawing as [[site.neighbour]] and [[site.utility]] (layers whose names say so). `unit` [m]
/// of the drawing's numbers, 0: as its header says. Throws InputError E113.
Import make_site_text(const std::string& dxf, const std::string& file_name, double unit);

}  // namespace topple::product
