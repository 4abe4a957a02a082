#pragma once
/// Nodes, eight-node hexahedra and two-node bars that share nodes (perfect bond). Knows no building.

#include <array>
#include <vector>

#include "base/linalg.h"

namespace topple::fem {

/// Corners in the order (-,-,-) (+,-,-) (+,+,-) (-,+,-) and the same four at ζ = +1.
struct Hex {
  std::array<int, 8> node{};
  int law = 0;      // index into Model::solids
  double fill = 1;  // share of the volume that is there, 0..1: bars take their place in it
};

struct Truss {
  std::array<int, 2> node{};
  double area = 0;  // [m²]
  int law = 0;      // index into Model::steels
};

struct Mesh {
  std::vector<Vec3> nodes;  // [m]
  std::vector<Hex> hexes;
  std::vector<Truss> bars;
};

/// Grid of (x-1)(y-1)(z-1) bricks on rising coordinates; node (i, j, k) has index i + x (j + y k).
Mesh make_grid(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z);

/// Throws InputError: nodes that do not exist, elements turned inside out, bars without length or area.
void check_mesh(const Mesh&);

}  // namespace topple::fem
