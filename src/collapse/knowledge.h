#pragma once
/// The manager's special knowledge: rules as data, each with a value and a reason in words (data/knowledge.json).

#include <string>
#include <vector>

namespace topple::collapse {

struct Rule {
  std::string id;      // "zone.rupture_rotation"
  double value = 0;    // in `unit`
  std::string unit;    // SI, "1" for numbers
  std::string text;    // what the value does
  std::string reason;  // why it is what it is
};

/// The rules' values under the names of their ids, `.` written as `_`.
struct Knowledge {
  double zone_length_by_depth, zone_length_by_span, zone_length_by_bar, zone_length_at_most;
  double zone_elongation_share, member_uncracked_share;
  double zone_rupture_rotation, zone_rupture_rotation_pressed, zone_slip_softening, zone_slip_rupture,
      zone_twist_rupture, zone_biaxial_exponent;
  double zone_damping_ratio;
  double slab_flange_share, slab_distribution_share;
  double slab_elongation_lengths, wall_stiffness_share, wall_axial_share, wall_crush_share;
  double charge_release_time, charge_cage_rupture_rotation, charge_transition_reach, charge_scatter_limit;
  double body_least_radius_of_gyration, body_highest_frequency;
  double contact_gap, contact_body_friction, contact_body_restitution, contact_frequency;
  double rest_speed, rest_time;
  double stands_displacement, stands_drift;
  double mechanism_moved_displacement, mechanism_stands_share, mechanism_partial_share, mechanism_topple_rear_share;
  double mechanism_topple_rotation;
  double mechanism_coherent_share, mechanism_fold_share, mechanism_fold_rotation, mechanism_direction_tolerance;
  double mechanism_together_share, mechanism_aborted_rotation;
  double verification_energy_error, verification_equilibrium_residual, verification_step_time, verification_step_tilt;
  std::vector<Rule> rules;  // as read
};

/// Reads a set of rules. InputError for text that is not such a set, and for rules that are missing, unknown, given
/// twice or out of their range: above 0, of some at most a bound, of shares and restitution from 0 to 1;
/// `zone.elongation_share` may be 0.
Knowledge read_knowledge(const std::string& text, const std::string& name);

/// The rules that are built in.
const Knowledge& default_knowledge();

}  // namespace topple::collapse
