#pragma once
/// What engines in relative coordinates cannot express, whichever they are.

#include <vector>

#include "engines/engine.h"

namespace topple::engines {

/// Of an inertia, rising [kg·m²].
Vec3 calc_principal_moments(const Mat3&);

/// Inertias that no distribution of mass has: a principal moment larger than the sum of the two others.
std::vector<Unsupported> find_impossible_inertias(const mbs::Model&);

/// Joints that the velocities at the start would open (a run that begins with the equilibrium has none): the native
/// engine closes them by a blow in its first step.
std::vector<Unsupported> find_opening_joints(const mbs::Model&, const mbs::Options&);

/// Whether bodies of the model can touch the ground; each other.
bool can_touch_ground(const mbs::Model&);
bool can_touch_bodies(const mbs::Model&);

/// Of engines without models that keep to a plane.
std::vector<Unsupported> find_planes(const mbs::Model&);

}  // namespace topple::engines
