#pragma once
/// The direction of a building's own axes, from its edges and where its columns stand.

#include <vector>

#include "base/linalg.h"

namespace topple::product {

/// Of the directions of the edges, modulo a right angle, the one along which columns stand in the fewest rows and
/// frames: what stands askew beside them does not turn it. Else that of most edges, by their length. Round meshes have
/// faces in all directions; where columns stand better along x and y, these are taken. In (-45, 45] deg [rad].
///   edges    in plan [m];  columns  their middles [m]
double find_grid_angle(const std::vector<Vec3>& edges, const std::vector<Vec3>& columns);

}  // namespace topple::product
