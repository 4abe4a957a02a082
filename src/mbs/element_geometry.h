#pragma once
/// Deformations of an element from the poses of its markers, and the forces on its bodies from its resultants
/// (docs/theory/zones.md, "Geometry"; docs/theory/multibody.md, eq. 4).

#include "base/linalg.h"

namespace topple::mbs {

/// Six deformations or resultants: x y z translation, x y z rotation.
struct Six {
  double c[6] = {0, 0, 0, 0, 0, 0};
};

/// Factor of the double cross product in the rate of a rotation vector (eq. 4), valid below a full turn.
///   angle2  square of the rotation vector [rad²]
double calc_kappa(double angle2);

/// Torque conjugate to the rate of the rotation vector r with the moments m (eq. 4), all in the axes that r begins in.
Vec3 calc_conjugate_torque(const Vec3& r, const Vec3& m);

/// Where the stations of a whole member are: x of the one on a's side and of the one on b's side, from the markers [m].
/// Both the same: no member.
struct Span {
  double a = 0, b = 0;
  bool is_member() const { return a < b; }
  double length() const { return b - a; }
};

struct ElementGeometry {
  Span span;
  Six deformation;  // [m], [rad]
  Mat3 axes;        // of the resultants, in W; halfway between F and M, of a member between both laid along its chord
  Vec3 p_a, p_b;    // where the force acts on a and on b, in W
  Vec3 turn_a, turn_b;  // rotation vectors from a to `axes` and on to b, in `axes`; of a member without its twist
  Vec3 way;             // without a member: from F to M, in `axes` [m]
  double length = 0;    // between the stations of a member [m]
};

/// Force on a, on b its opposite; torque on a about p_a and the opposite of that on b about p_b. All in W.
struct ElementForces {
  Vec3 force, torque_a, torque_b;
};

/// Of markers F on a and M on b. An element with one station or none deforms by the way from F to M in axes halfway
/// between both, and by the rotation vector from F to M; a member by its chord: from its station on a to that on b, by
/// what the chord lengthens, by the rotations of a and of b against it, and by what b is twisted about it against a.
ElementGeometry measure_element(const Pose& X_WF, const Pose& X_WM, const Span&);

/// The forces that do the work of the resultants on the rates of the deformations.
///   resultants  N, V_y, V_z [N], T, M_y, M_z [N·m]
ElementForces calc_element_forces(const ElementGeometry&, const Six& resultants);

}  // namespace topple::mbs
