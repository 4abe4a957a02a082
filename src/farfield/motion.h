#pragma once
/// Finite elements as they are seen on the manager's bodies and zones.

#include <vector>

#include "farfield/whole.h"
#include "fem/explicit_system.h"
#include "mbs/solver.h"

namespace topple::farfield {

/// A zone of the manager and the elements around its place.
struct ZoneElements {
  std::vector<int> elements;  // of both its bodies, with their centres within one size of the zone's place
  /// Of its column or beam, whole cross-sections that have their centres as near along it. Those that a charge takes
  /// count for the zones on which it acts, with the bars that it leaves.
  struct Section {
    std::vector<int> elements, bars;
  };
  std::vector<Section> sections;
};

class Motion {
 public:
  Motion(const product::Plan&, const Whole&, const mbs::Model&, const collapse::ModelMap&, double size);

  /// The manager's bodies carried as least squares carry their elements and debris, turned as they turn the elements
  /// (without any, not at all), and their angular momentum says; the mass centres of both; its zones by what their
  /// elements have come through, the ledger of energies.
  ///   time  of the plan [s]
  mbs::View calc_view(const fem::ExplicitSystem&, double time) const;
  /// Vertical force of the ground on each foot, upwards [N]. (feet)
  std::vector<double> calc_foot_forces(const fem::ExplicitSystem&) const;
  /// Mean place of the upper block [m].
  Vec3 calc_upper_place(const mbs::View&) const;
  /// Kinetic energy per half mass, as a speed [m/s].
  double calc_speed(const mbs::View&) const;

 private:
  const Whole& whole_;
  const mbs::Model& model_;
  std::vector<size_t> upper_;                    // bodies of the upper block
  std::vector<std::vector<int>> body_elements_;  // also those that it shares with others (bodies)
  std::vector<double> element_mass_;             // (elements)
  std::vector<ZoneElements> zones_;              // zone elements, then rotational elements
  std::vector<ZoneElements> joints_;             // (joints)
  std::vector<Vec3> centre_;                     // of elements at the start (elements)
};

/// Largest von Mises stress over the yield stress at its pressure, before hardening (eq. 12 of
/// docs/theory/explicit.md); 1 beyond.
double calc_utilisation(const fem::ExplicitMaterial&, const std::array<double, 6>& stress);

}  // namespace topple::farfield
