#pragma once
/// Stress resultants on a plane p · n = 0 through a mesh, by integrating stresses; docs/theory/fem.md (16), (17).

#include <vector>

#include "fem/system.h"

namespace topple::fem {

/// Plane through a point with the normal n of unit length; the part ahead of n acts on the part behind it.
struct Plane {
  Vec3 point, normal;
};

/// One piece of the cut.
struct CutPoint {
  Vec3 at;          // [m]
  double area = 0;  // [m²]
  Voigt stress{};   // of the solid [Pa]
  int hex = -1;     // element it lies in
};
struct CutBar {
  Vec3 at;            // [m]
  double stress = 0;  // [Pa]
  double area = 0;    // [m²]
  int bar = -1;       // element
};

struct Cut {
  Vec3 force, moment;  // on the part behind, moment about Plane::point [N], [N·m]
  double area = 0;     // of the solid [m²]
  std::vector<CutPoint> points;
  std::vector<CutBar> bars;
};

/// Stresses are interpolated trilinearly from the integration points, exact for equilibrium at the middle of bricks.
/// A plane that runs through element faces takes the elements behind it; bars in the plane do not count.
Cut make_cut(const System&, const Response&, const Plane&);

}  // namespace topple::fem
