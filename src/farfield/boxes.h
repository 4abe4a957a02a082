#pragma once
/// The plan's members as boxes along W's axes, in the order in which they claim room from each other.

#include <string>
#include <vector>

#include "product/plan.h"

namespace topple::farfield {

/// A face of a box that grid lines have to follow, or not.
struct Box {
  Vec3 low, high;   // in W [m]
  int member = -1;  // index into Plan::members
  int rank = 0;     // who claims a cell first and whose faces stay first: 0 columns, 1 beams, 2 slabs, 3 walls
  // faces that make no grid line of their own: [axis][0: low, 1: high]
  bool is_soft[3][2] = {{false, false}, {false, false}, {false, false}};
};

/// Boxes of the members that stand before the first charge. Columns go through to the floor above, beams run between
/// the grid points under it, slabs from grid line to grid line, walls between the faces of columns around their
/// openings.
std::vector<Box> make_boxes(const product::Plan&);

/// Length of a member that a charge destroys.
struct DestroyedLength {
  int stage = 0, charge = 0;  // indices into the plan
  int member = -1;
  int axis = 2;             // of W along the member
  double from = 0, to = 0;  // along it in W [m]
};
/// Of every charge, those that fail too.
std::vector<DestroyedLength> find_destroyed_lengths(const product::Plan&);

/// W's axis along a column, beam or wall.
int axis_of(const product::Member&);

}  // namespace topple::farfield
