#pragma once
/// The eight-node hexahedron with assumed strains, docs/theory/fem.md (1) to (6): no volumetric and no shear locking,
/// no zero-energy modes, no parameters of its own to be condensed.

#include <array>
#include <cstddef>
#include <vector>

#include "base/linalg.h"

namespace topple::fem {

inline constexpr int kPoints = 8;  // integration points, 2 x 2 x 2; bit 0, 1, 2 of the index: sign of ξ, η, ζ

/// Strains of one element's shape. Voigt xx yy zz xy yz zx with engineering shear, in the frame of the coordinates.
struct HexShape {
  std::array<std::array<double, std::size_t{6} * 24>, kPoints>
      B{};                               // strain from displacements x1 y1 z1 x2 ..., column by column [1/m]
  std::array<double, kPoints> volume{};  // of each point [m³]
};

/// `lateral`, 0..0.5: the Poisson number with which strains that vary linearly over the element pass on to the lateral
/// directions, (4). Poisson's number of the material makes bending exact and does not lock; 0 leaves the displacements'
/// own normal strains, for cracked concrete.
HexShape make_hex_shape(const std::array<Vec3, 8>& nodes, double lateral);

/// Smallest determinant of the Jacobian at the integration points, over the largest; <= 0: turned inside out.
double calc_smallest_jacobian(const std::array<Vec3, 8>& nodes);

/// Natural coordinates of an integration point.
Vec3 find_natural_point(int point);
/// Trilinear functions at natural coordinates.
std::array<double, 8> calc_shape_functions(const Vec3& natural);

}  // namespace topple::fem
