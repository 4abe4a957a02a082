#pragma once
/// One grid of hexahedra over all members: its lines follow the members' faces; docs/fe.md, "Mesh".

#include <array>
#include <string>
#include <vector>

#include "farfield/boxes.h"

namespace topple::farfield {

/// Of the grid, empty ones counted: numbers of nodes and cells are ints, and each takes memory.
inline constexpr double kMostCells = 1e9;

struct GridOptions {
  double size = 0.4;         // aimed at; edges are at most 1.25 times as long; the grid has at most kMostCells [m]
  double snap_share = 0.25;  // of the size: faces that lie nearer together share a line ...
  double snap_most = 0.1;    // ... if they are no farther apart than this, the thickness of thin walls [m]
  int least_across = 2;      // cells over the width and depth of columns and the depth of beams, floors there included
};

struct Cell {
  std::array<int, 8> node{};  // corners in the order of fem::ExplicitElement
  int member = -1;
  Vec3 centre;  // mean of the corners [m]
};

/// How the grid meets a member.
struct MemberFit {
  int cells = 0;
  double volume = 0;       // of its cells [m³]
  double plan_volume = 0;  // what the plan's mass fills; beams and slabs share room, compared by storey [m³]
  double shift = 0;        // largest distance of a face from its place [m]
};

struct Grid {
  std::array<std::vector<double>, 3> lines;  // rising [m]
  std::vector<Vec3> nodes;
  std::vector<Cell> cells;
  std::vector<MemberFit> fits;  // (plan's members)
};

/// Faces within the snap of each other share a line of the grid; its nodes then lie where the member wants them that
/// claims room first (columns, beams, slabs, walls, destroyed lengths), so that a face moves only where two members
/// meet that want different places. Throws InputError (E670 to E672), one complaint for each line of the plan: members
/// without a cell, with a volume off by more than half, or with cells turned inside out; E676: too many cells.
Grid make_grid(const product::Plan&, const GridOptions&);

/// Mass of a member and of what lies on it before the first charge [kg].
double calc_loaded_mass(const product::Plan&, const product::Member&);

}  // namespace topple::farfield
