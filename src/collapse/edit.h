#pragma once
/// What people change on a building while it comes down (docs/steer.md).

#include <optional>
#include <string>

#include "base/linalg.h"

namespace topple::collapse {

struct Edit {
  enum class Kind { Fire, SetDelay, AddCharge, RemoveCharge, AddPreCut, AddCable, RemoveCable, SetFriction };
  Kind kind = Kind::Fire;
  int charge = -1;                    // Fire, RemoveCharge, SetDelay: place in LiveModel::charges
  int stage = -1;                     // SetDelay of a whole stage
  std::optional<double> delay, time;  // SetDelay: after the stage's time, or in the run; AddCharge: time, none: now [s]
  std::string member;                 // AddCharge, AddPreCut, AddCable
  double position = 0;                // from the member's start: charge, cut or cable [m]
  double destroyed_length = 0, residual_bars = 0, residual_concrete = 0, transition_damage = 0;  // product::Charge's
  double cut_bars = 0, cut_concrete = 0;               // as of product::Weakening
  Vec3 anchor;                                         // AddCable, in W [m]
  double stiffness = 0, pretension = 0, strength = 0;  // AddCable, as of product::Cable
  std::string cable;                                   // RemoveCable
  std::optional<double> ground, bodies;                // SetFriction
};

/// "set_delay", ...: the words of the protocol and of the action log.
const char* word_of(Edit::Kind);

}  // namespace topple::collapse
