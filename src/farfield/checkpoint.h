#pragma once
/// A run as it stands, so that it can go on later with the same bits on the same machine.

#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include "farfield/fragments.h"
#include "fem/explicit_system.h"
#include "mbs/solver.h"

namespace topple::farfield {

/// A wait that was not passed over.
struct UnsettledWait {
  size_t firing = 0;    // number in the schedule of the one that was waited for
  double time = 0;      // when it was tried [s]
  double residual = 0;  // out-of-balance over load after the last step of the relaxation
  long long steps = 0;  // of it
};

/// What has been seen of a building's motion since the last charge.
struct Swing {
  double most_speed = 0;    // largest mean speed [m/s]
  std::vector<Vec3> path;   // mean place of the upper block when the charge fired, and in each frame since [m]
  bool has_turned = false;  // its mean speed is half of that at most
  bool is_short = false;    // it has not come as far as where it would come to rest
  /// Whether it has been as far from where it was as a place is, in the direction to it.
  bool has_passed(const Vec3& place) const;
};

/// Everything that changes while a run goes on, beside the elements' state.
struct RunState {
  std::vector<std::variant<mbs::View, mbs::Happening>> shown;  // in the order in which they were shown
  std::vector<std::vector<double>> foot_forces;                // of each frame shown [N]
  long long next_frame = 0;                                    // number of the next frame on the plan's clock
  double offset = 0;                                           // the plan's time less that of the elements [s]
  double quiet_since = -1, swings_since = -1;                  // negative: not so [s]
  Swing swing;
  size_t next_firing = 0;                      // in the schedule
  bool is_settling = false;                    // interrupted while a wait was settled: that comes first
  std::vector<unsigned char> zone_state;       // mbs::ElementState of the last frame
  std::vector<unsigned char> has_touched;      // (bodies)
  std::vector<std::array<double, 3>> skipped;  // quiet waits passed over, from and to [s], and how far
                                               // the building settled in them [m]
  std::vector<UnsettledWait> unsettled;
  fem::RelaxationSummary relaxation;
  mbs::Energy ledger;       // what the record holds beyond the elements' own ledger since they were settled last [J]
  double energy_error = 0;  // largest residual [J]
  double released = 0;      // largest potential energy set free [J]
  double wall_time = 0;     // of the parts before [s]
  EarlyDamage early_damage;
  bool has_fragments = false;  // from the first touchdown on
  Fragments fragments;
  double fragments_time = 0;  // [s]
};

/// `key` says what the run is made of: a checkpoint of something else is refused.
void write_checkpoint(const std::string& path, const std::string& key, const RunState&,
                      const std::vector<std::byte>& system);
/// Throws InputError E674: no checkpoint, or one of another plan, mesh or program.
RunState read_checkpoint(const std::string& path, const std::string& key, std::vector<std::byte>& system);

}  // namespace topple::farfield
