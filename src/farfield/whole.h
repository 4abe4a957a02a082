#pragma once
/// The whole building as explicit finite elements, from the same plan as the multibody model.

#include <string>
#include <vector>

#include "collapse/manager.h"
#include "farfield/charges.h"
#include "farfield/grid.h"
#include "fem/explicit_model.h"

namespace topple::farfield {

/// Where a member stands on the ground: nodes that are held, and the elements that press on them.
struct Foot {
  int member = -1;
  std::vector<int> nodes, elements;
  std::vector<double> shares;  // of each node's weight: others stand on it too (nodes)
  std::vector<int> bars;       // that end in the ground, of charges at the foot
  Vec3 p_W;                    // middle of the nodes [m]
};

struct Whole {
  Grid grid;
  fem::ExplicitModel fe;                 // elements in the order of the grid's cells; their part is the manager's body
  std::vector<std::vector<int>> bodies;  // that share each element alike, its part first (elements)
  std::vector<unsigned char> is_stump;   // of what stands on the ground below a charge and bears nothing (elements)
  std::vector<ChargeElements> charges;   // in the order of fe.releases
  std::vector<Foot> feet;
  std::vector<std::string> notes;  // what was left out, in sentences
};

/// Throws InputError like make_grid and the laws of materials; E673 without anything that stands on the ground.
///   model, map  the manager's: elements are told to which of its bodies they belong
Whole make_whole(const product::Plan&, const collapse::Knowledge&, const GridOptions&, const mbs::Model& model,
                 const collapse::ModelMap& map);

/// Bodies of the manager in which each cell lies: whose boxes hold its centre, or are nearest to it. Several where the
/// centre lies on their border: to give it to one of them would tell left from right. (cells)
std::vector<std::vector<int>> find_bodies(const product::Plan&, const Grid&, const mbs::Model&,
                                          const collapse::ModelMap&);

/// What is said of a mesh: counts, edges, step, and how its members fit the plan.
struct MeshReport {
  fem::ExplicitMeshSummary mesh;
  double smallest_fit = 1, largest_fit = 1;  // volume of a member's cells over the plan's
  std::string smallest_member, largest_member;
  double largest_shift = 0;  // [m]
  std::string shifted_member, smallest_edge_member, critical_member;
};
MeshReport calc_mesh_report(const product::Plan&, const Whole&);
/// Lines for people.
std::vector<std::string> describe(const MeshReport&);

}  // namespace topple::farfield
