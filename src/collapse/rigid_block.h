#pragma once
/// The upper block as one rigid body that pivots on plastic hinges: what the multibody result is compared with.

#include <vector>

namespace topple::collapse {

struct RigidBlock {
  double mass = 0;            // [kg]
  double inertia = 0;         // about the hinge line [kg·m²]
  double ahead = 0;           // of the mass centre before the hinge line in the direction of fall [m]
  double above = 0;           // of the mass centre over the hinge line [m]
  double plastic_moment = 0;  // of all hinges together [N·m]
  double gravity = 9.81;      // [m/s²]
  double release = 0;         // from rest at this time [s]
};

/// Angle at each time: inertia θ'' = mass gravity (ahead cos θ + above sin θ) - plastic_moment. It does not start when
/// the plastic moment holds it, and it ends lying at π/2.
std::vector<double> calc_rigid_block(const RigidBlock&, const std::vector<double>& time);

}  // namespace topple::collapse
