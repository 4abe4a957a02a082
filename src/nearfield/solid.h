#pragma once
/// Resistance curves by finite elements, solid route: a zone of a member as bricks of concrete with its bars and ties,
/// a constant normal force, and a rotation that rises; docs/theory/solid.md. Forces are positive in tension.

#include <string>
#include <vector>

#include "base/linalg.h"
#include "base/progress.h"
#include "fem/mesh.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

struct SolidOptions {
  double element_size =
      0;  // largest edge of an element; 0: a tenth of the section's shorter side; at least a hundredth [m]
  double largest_rotation = 0.03;  // of the zone, or drift of a cantilever; at most π [rad]
  std::vector<double> path;      // rotations to be visited one after the other, for unloading; empty: largest_rotation
  int steps = 150;               // at least, from one turn of the path to the next
  std::vector<double> pictures;  // rotations at which a state is kept (first time they are passed)
  double crushing_length = 0;    // over which concrete crushes together; 0: the zone's length, over which curvature
                               // localises by definition, as in the layered route; below an element's length: that [m]
  double largest_lag = 0.005;  // error of the extrapolated history that a step may have, over the element forces
  int threads = 1;             // of the element loop, 0: all of the machine; results do not depend on it
};

/// What a picture needs. Places in the section (y, z) and along the zone (x) from its start.
struct SolidState {
  struct Point {
    double y = 0, z = 0, area = 0;  // [m], [m²]
    double stress = 0;              // along the member [Pa]
  };
  struct Bar {
    double y = 0, z = 0;            // [m]
    double stress = 0, strain = 0;  // [Pa]
  };
  double rotation = 0, moment = 0, elongation = 0;
  double cut_at = 0;                // x of the cut: middle of the elements nearest to half of the length [m]
  std::vector<Point> cut;           // concrete, one for each element cut
  std::vector<Bar> bars;            // longitudinal bars there
  Vec3 cut_force, cut_moment;       // integrated over the cut: N, V; M about the section's centre [N], [N·m]
  std::vector<double> crack_width;  // widest in each element [m] (hexes)
  std::vector<double> crushing;     // largest share of strength lost in each element, 0..1 (hexes)
  std::vector<double> bar_stress;   // all bars and ties [Pa] (bars)
  std::vector<Vec3> displacement;   // [m] (nodes)
};

/// One march. J points, the first at no rotation under the normal force alone.
struct SolidMarch {
  std::vector<double> rotation, moment;         // about the axis, signed by the direction: magnitudes while loading (J)
  std::vector<double> cross_moment;             // about the axis at a right angle [N·m] (J)
  std::vector<double> elongation;               // of the zone's axis [m] (J)
  double yield_rotation = 0, yield_moment = 0;  // first of: a bar yields in tension, the edge's mean strain reaches
                                                // ε_c1, 0.75 of the peak; 0: none
  std::vector<SolidState> states;
  fem::Mesh mesh;
  bool complete = false;  // the path was walked to its end, or no moment was left
  std::string ending;  // "complete", "no moment left at φ = ...", "did not converge at φ = ..., last residual ...",
                       // "cancelled at ..."
  int degrees_of_freedom = 0, steps = 0, failed_steps = 0, iterations = 0;
  double largest_lag = 0;                       // largest error of extrapolation of a step, over its forces
  double external_work = 0, internal_work = 0;  // after the normal force was applied [J]
  double element_time = 0, factor_time = 0, solve_time = 0;  // [s]
};

/// The zone between two plane sections that stay plane and may widen: N constant, rotation about an axis in the section
/// at `axis_angle` from y towards z (0: about y), in `direction` +1 or -1. Throws InputError.
SolidMarch march_solid(const ZoneInput&, double N, double axis_angle, int direction, const SolidOptions&,
                       const Progress&);

/// Force against shortening at no bending: `moment` holds the axial force (magnitude), `rotation` the shortening over
/// the length (direction -1) or elongation (+1), up to largest_rotation. Throws InputError.
SolidMarch march_solid_axially(const ZoneInput&, int direction, const SolidOptions&, const Progress&);

/// Curves for several normal forces as a family, at `rotations` (rising from 0): moments 0 beyond the end of a march.
/// Throws InputError: forces or rotations that do not rise.
struct SolidFamily {
  MomentFamily family;
  std::vector<SolidMarch> marches;  // one for each force
};
SolidFamily make_solid_family(const ZoneInput&, const std::vector<double>& normal_forces,
                              const std::vector<double>& rotations, double axis_angle, int direction,
                              const SolidOptions&, const Progress&);

/// Plastic part of an axial march as in AxialCurve, from 0.75 of its peak on. EA of the section [N].
AxialCurve make_axial_curve(const SolidMarch&, double EA, double length);

/// A whole column clamped at its foot, pushed sideways along z at its top under a constant force, with the P-Δ moment.
struct CantileverInput {
  ZoneInput zone;         // section, materials; zone.length is not used
  double length = 0;      // from foot to load [m]
  double N = 0;           // [N]
  bool founded = true;    // on an elastic block of its concrete, one section deep and two wide; false: a rigid foot
  bool bars_slip = true;  // bars are free in the foundation over calc_slip_length
};
/// Strain penetration of Paulay & Priestley (1992), 0.022 f_y d_b (f_y in MPa, the thickest bar) [m].
double calc_slip_length(const ZoneInput&);
/// `rotation` holds the drift (displacement over length), `moment` the lateral force [N]. Throws InputError.
SolidMarch march_cantilever(const CantileverInput&, const SolidOptions&, const Progress&);

}  // namespace topple::nearfield
