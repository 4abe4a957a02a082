#pragma once
/// The same model as a keyword file for LS-DYNA, or for OpenRadioss through its reader of that format (docs/fe.md).

#include <string>

#include "collapse/manager.h"
#include "farfield/whole.h"

namespace topple::farfield {

/// Keyword file in kg, m, s (N, Pa, J), fields of the standard widths. A part for each member and material; what a
/// charge destroys has parts of its own, whose material fails at the time of firing.
///   duration       simulated after the dead load is in equilibrium [s]
///   body_friction  between parts [-]
std::string to_lsdyna(const product::Plan&, const Whole&, const collapse::ModelMap&, double duration,
                      double body_friction);

}  // namespace topple::farfield
