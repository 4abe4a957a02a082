#pragma once
/// Faces of hexahedra and their neighbours: which faces are outside.

#include <array>
#include <cstdint>
#include <vector>

#include "fem/explicit_model.h"

namespace topple::fem {

/// Corners of the faces of a hexahedron, anticlockwise seen from outside: -ξ, +ξ, -η, +η, -ζ, +ζ.
inline constexpr int kFaces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                     {2, 3, 7, 6}, {0, 3, 2, 1}, {4, 5, 6, 7}};

struct OuterSurface {
  std::vector<std::array<int, 6>> neighbour;  // element behind a face, -1: none
};

/// Throws InputError: a face of more than two elements.
OuterSurface make_outer_surface(const ExplicitModel&);

}  // namespace topple::fem
