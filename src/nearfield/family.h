#pragma once
/// Families of moment curves from marches over the curvature.

#include <vector>

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// Rotations from 0 to `last`, densest around `yield`: 40 % steps from `first` to 0.4 yield, 15 % to 6 yield, 18 %
/// beyond.
std::vector<double> make_rotations(double first, double yield, double last);
/// The same for a zone, from a fraction of cracking to beyond rupture of the bars over the section's depth.
std::vector<double> make_rotations(const ZoneInput&, double depth, const material::Concrete&);

/// Normal forces from crushing (a magnitude) to rupture of the bars, 24 of them.
std::vector<double> make_forces(double crushing, double rupture);

/// Largest force that the zone's bars, or its uncracked concrete, can pull with [N]; never zero.
double calc_rupture_force(const ZoneInput&, double concrete_area, const material::Concrete&, double crushing);

/// The family of one axis and direction, cut off after the last rotation that any force leaves.
MomentFamily make_family(const Fibres&, int direction, const std::vector<double>& force,
                         const std::vector<double>& rotation, double length);

/// Effective stiffness yield_moment / (yield_rotation / length) at the normal force N [N·m²].
double interpolate_EI(const MomentFamily&, double N, double length);

}  // namespace topple::nearfield
