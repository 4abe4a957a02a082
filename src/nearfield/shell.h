#pragma once
/// Zones of slabs and walls as shells of many layers, per metre of hinge line: concrete or masonry through the
/// thickness, meshes of bars in any direction at their depths, membrane force and bending; docs/theory/rcc.md,
/// "Shells".

#include <string>
#include <vector>

#include "nearfield/rcc.h"

namespace topple::nearfield {

/// One zone across a hinge line.
struct ShellInput {
  /// Parallel bars. Those at an angle to the normal of the hinge line work with the square of its cosine.
  struct Mesh {
    double at = 0;        // from the middle plane, positive towards the face that a positive moment pulls [m]
    double area = 0;      // per metre across the bars [m²/m]
    double angle = 0;     // between the bars and the normal of the hinge line [rad]
    double diameter = 0;  // of the bars, which buckle over the zone's length; 0: they do not [m]
  };
  std::string name;
  double thickness = 0;        // [m]
  product::Concrete concrete;  // or masonry, see make_masonry
  product::Steel steel;        // without mesh: unused
  std::vector<Mesh> mesh;
  double length = 0;  // over which curvature localises, at a right angle to the hinge line [m]
};

/// Masonry as a concrete, docs/theory/rcc.md (24) and (32).
///   strength, modulus  in compression [Pa]
product::Concrete make_masonry(double strength, double modulus);

/// A panel of a plan: its faces' bars run along the span, the hinge line across it. Throws InputError as
/// make_panel_rcc.
///   length  of the zone [m]; 0: one thickness
ShellInput make_shell_input(const product::Panel&, const product::Concrete*, const product::Steel*, double length = 0);

/// All values per metre of hinge line.
struct ShellRcc {
  MomentFamily pos, neg;            // moments [N·m/m] over total rotation, membrane forces [N/m]
  AxialCurve compression, tension;  // [m], [N/m]
  double EA = 0;                    // membrane stiffness of the transformed section times length [N/m]
  double EI = 0;                    // uncracked bending stiffness [N·m²/m]
  double length = 0;

  /// Effective bending stiffness yield_moment / (yield_rotation / length) at the membrane force N [N·m²/m].
  double calc_EI_effective(double N) const;
};

/// Throws InputError: a shell that cannot be computed, a zone at or above calc_largest_zone_length of its concrete.
ShellRcc make_shell_rcc(const ShellInput&);

}  // namespace topple::nearfield
