#pragma once
/// Zones in which damage has gathered, the rigid fragments between them, and what both say about the manager's cuts.

#include <string>
#include <vector>

#include "farfield/whole.h"
#include "fem/explicit_system.h"
#include "record/record.h"

namespace topple::farfield {

/// Elements that hang together by faces and are damaged: gone, or of at least `damaged_strain` plastic strain.
struct DamageZone {
  int member = -1;  // with most of its elements
  int elements = 0, gone = 0;
  double share = 0;         // of the damaged volume of the building
  double stump = 0;         // share of its own volume in stumps
  double landed = 0;        // share of its own volume that was not damaged before the first part landed
  Vec3 p_W;                 // middle at the start [m]
  double at = 0;            // along the member from its start, columns, beams and walls [m]
  double from = 0, to = 0;  // reach along it [m]
  int zone = -1;            // nearest zone of the manager on the member (index into Record::zones), -1: none
  double distance = 0;      // to that [m]
};

/// Elements that hang together by faces and are not damaged.
struct Fragment {
  int elements = 0;
  double mass = 0;  // [kg]
  Vec3 p_W;         // mass centre at the start [m]
  int bodies = 0;   // of the manager of which at least half the elements lie in it
};

/// Plastic strain from which on an element counts as damaged.
inline constexpr double kDamagedStrain = 0.01;  // NOLINT(readability-identifier-naming)

/// Damage as it was until the first part landed. What is damaged then runs on through the whole building, and no cut
/// would follow it.
struct EarlyDamage {
  double landing = -1;                    // of the elements' clock, negative: none has landed [s]
  std::vector<unsigned char> is_damaged;  // as noted last; empty: never (elements)
  /// Notes what is damaged now, for as long as nothing has landed.
  void note(const fem::ExplicitSystem&, size_t elements);
};

struct Fragments {
  double damaged_strain = kDamagedStrain;
  double reach = 0;                 // farther from every zone than this counts as unexpected [m]
  std::vector<DamageZone> zones;    // largest first
  std::vector<Fragment> fragments;  // largest first; at least a thousandth of the mass
};

/// What charges took away is neither. `zones` are those of the manager as in the record.
///   before_landing  what of it was damaged when the first part landed
Fragments find_fragments(const product::Plan&, const Whole&, const fem::ExplicitSystem&,
                         const std::vector<record::ZoneInfo>& zones, double size,
                         const EarlyDamage& before_landing = {});

/// Findings "farfield.zone.*", "farfield.fragments": "zone expected at ..., found at ...".
///   when  the state was looked at [s]
void add_fragment_findings(const product::Plan&, const Fragments&, double when, record::Record&);

}  // namespace topple::farfield
