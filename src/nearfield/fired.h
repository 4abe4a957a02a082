#pragma once
/// What a fired charge leaves of a member (the local level): the cage of bars over the destroyed length, the damaged
/// zones beside it, or, where it did not destroy all, a weak section; docs/theory/rcc.md, "Residual cage". The charge
/// itself is not modelled.

#include <optional>

#include "nearfield/rcc.h"

namespace topple::nearfield {

/// The damage that a charge is expected to do, each of it open to be fuzzy.
struct LocalDamage {
  double destroyed_length = 0;   // h_d [m]
  double residual_bars = 0;      // η_s, share of the bars left, 0..1
  double transition_damage = 0;  // loss of concrete strength beside it, 0..1
  double residual_concrete = 0;  // share of the concrete left standing; above 0: not fully destroyed, 0..1
};

struct FiredZone {
  ResidualCage cage;                        // bars alone: resistances that do not know of each other
  MomentFamily y_pos, y_neg, z_pos, z_neg;  // of the cage over its length, total rotations; as Rcc's
  Rcc transition;                           // one on each side, over one section depth: weaker concrete, no cover
  std::optional<Rcc> partial;  // not fully destroyed: what is left of concrete and bars, without ties and cover
};

/// The destroyed length where some concrete is left standing: a section without ties and cover, as long as it, of the
/// concrete's strength beside the charge. The concrete's softening limits its length as that of every zone.
ZoneInput make_partial_zone(const ZoneInput& intact, const LocalDamage&);

/// Throws InputError: as make_rcc and make_residual_cage; shares outside 0..1.
FiredZone make_fired_zone(const ZoneInput& intact, const LocalDamage&);

}  // namespace topple::nearfield
