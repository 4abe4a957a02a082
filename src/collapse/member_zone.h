#pragma once
/// One zone of a member of a plan as the manager cuts it, and the normal force that it has to carry.

#include <string>

#include "collapse/knowledge.h"
#include "nearfield/rcc.h"
#include "product/plan.h"

namespace topple::collapse {

struct MemberZone {
  std::string name;            // "C-D1-0, foot"
  nearfield::ZoneInput input;  // as prepared, without the damage of charges
  double normal_force = 0;     // under dead load before the first charge, tension positive [N]
  bool is_estimate = false;    // there is no equilibrium; the weights were summed up instead
  std::string message;         // why
};

/// The zone at the start (foot) or at the end (top) of a column or beam, with the normal force of the dead-load
/// equilibrium of the whole building.
/// Throws InputError: not a column or beam, a member that is taken out, plans that cannot be built.
MemberZone find_member_zone(const product::Plan&, const Knowledge&, int member, bool at_end, int threads = 1);

}  // namespace topple::collapse
