#pragma once
/// What the reinforcing bars of an IFC file say about the section of the member that they lie in.

#include <string>
#include <vector>

#include "product/ifc_elements.h"

namespace topple::product {

/// Bars of one kind; none if `count` is 0.
struct BarGroup {
  int count = 0;
  double diameter = 0;         // of bars of the same area in all [m]
  bool has_diameters = false;  // bars of different diameters
};

struct MemberBars {
  BarGroup all, top, bottom;  // bars along the member; top and bottom: of beams
  int count_y = 0,
      count_z = 0;  // of columns, along x and y, corners counted in both; 0: they do not lie along the faces
  int middle = 0;   // of beams, between both layers, not counted above
  int inner_top = 0, inner_bottom = 0;     // of those at the top and the bottom: more than a diameter off the outermost
  double depth_top = 0, depth_bottom = 0;  // how far the deepest of them lies off it [m]
  BarGroup ties;
  double tie_spacing = 0;                                 // 0: not known [m]
  double least_tie_spacing = 0, largest_tie_spacing = 0;  // [m]
  double cover = 0, largest_cover = 0;                    // clear, of the ties, least and largest of the faces [m]
  bool has_cover = false;
  std::string grade;
};

/// Bars that are part of the element, or lie in it where they are part of none. A column's section is that at the
/// middle of its height, clear of laps; a beam's is the richer one of those at a tenth of its length from its ends,
/// where it turns.
MemberBars find_bars(const IfcElement&, const std::vector<IfcBar>&);

/// Cover and ties that leave no room for bars in a section are not known.
void drop_thick_cover(MemberBars&, double width, double height);

/// What a plan would not take of the bars in a section, as far as cover and ties are known: "its bars, which take 20 %
/// of it"; empty if they fit.
std::string find_misfit(const MemberBars&, double width, double height, bool is_column);

}  // namespace topple::product
