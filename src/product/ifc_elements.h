#pragma once
/// Columns, beams, slabs, walls and bars of an IFC file as upright boxes: what an importer needs of the semantics.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/linalg.h"
#include "product/step_file.h"

namespace topple::product {

/// An element whose body, extruded profiles or a mesh, fills its box; of slabs its outline. World axes turned by
/// IfcBuilding::angle about z.
struct IfcElement {
  std::string type;      // "IFCCOLUMN"
  std::string name;      // as the file has it
  std::string material;  // empty: none given
  // of a material of layers: thickness of those of `material`, and of all [m]
  double carrying = 0, layers = 0;
  int id = 0;
  bool has_box = false;   // false: its body is not understood, for the reason `why`
  bool is_mesh = false;   // the box was found around faces
  bool is_cut = false;    // along planes
  bool is_whole = false;  // what cuts it is not read
  bool is_round = false;
  double diameter = 0;  // of a round one [m]
  bool has_opening = false;
  int openings_not_read = 0;  // of a wall: those whose body is no upright box
  std::string why;
  Vec3 low, high;     // box, of a slab its plate's [m]
  double filled = 1;  // of a wall: share of its box
  double plate = 1;   // of a slab: share of its volume that its plate has, without ribs, kerbs and drop panels
  // of upright slabs, outline and holes of each of its parts; none: its box [m]
  std::vector<std::vector<std::vector<Vec3>>> outlines;
  std::vector<std::pair<Vec3, Vec3>> openings;  // of a wall: lowest and highest corners of their boxes [m]
};

struct IfcBar {
  double diameter = 0;  // [m]
  std::string grade;
  bool is_main = true;  // not a tie or stirrup
  bool has_place = false, has_axis = false;
  Vec3 place;      // of the middle of its longest straight part, else of its placement, in the axes of elements [m]
  Vec3 low, high;  // box of its axis [m]
  int host = 0;    // element that it is part of, 0: not said
};

struct IfcBuilding {
  std::string schema, name;
  double length_unit = 1;                               // [m]
  bool has_unit = false;                                // the file names one
  double angle = 0;                                     // of the building's own axes against the file's x [rad]
  std::vector<std::pair<std::string, double>> storeys;  // name, elevation [m], rising
  std::vector<IfcElement> elements;
  std::vector<IfcBar> bars;
  int bars_left_out = 0;              // whose bodies have too many items or are part of themselves
  std::map<std::string, int> others;  // entities of other kinds, "IFCRAMP"
};

/// Reads a file of IFC2X3 or IFC4. Throws InputError: E111 no STEP file, E112 another schema or no elements.
IfcBuilding read_ifc(const std::string& text, const std::string& name);

}  // namespace topple::product
