#pragma once
/// The law of a zone at work: deformations in, stress resultants out, inelastic history kept (docs/theory/zones.md).
/// Stress resultants are those of tension-positive structural mechanics: N > 0 pulls, and the force of a on b is minus
/// them.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mbs/element_geometry.h"
#include "mbs/kernel.h"
#include "mbs/model.h"
#include "mbs/zone_law.h"

namespace topple::mbs {

enum class BreakReason : std::uint8_t { None, Tension, Crushing, Shear, Rotation, Torsion, Removed };

/// Inelastic history of a station.
struct StationState {
  double phi[2] = {0, 0};            // plastic rotations about y, z [rad]
  double soft[2] = {0, 0};           // added flexibility by cracks and damage [rad/(N·m)]
  double crack[2] = {0, 0};          // of it, by cracks before first yield
  double bow[2] = {0, 0};            // of `phi`, what cracks leave without a moment [rad]
  double crest[2][2] = {};           // about y, z: moments > 0 and < 0 up to which it has cracked [N·m]
  double tangent[2] = {0, 0};        // rise of the rotation with the moment in the last evaluation, for the equilibrium
  double reached = 0;                // largest inelastic rotation so far, without that of cracks [rad]
  double strained = 0;               // the same as the edges feel it: of rotations about y that strain them as much
  double outgoing_measure = 1;       // times that, as the law counts it from which a switch goes
  int k[2] = {0, 0}, j[2] = {0, 0};  // lookup hints
};

/// Whether damage has left flexibility behind, on which the rotation grows without flow.
inline bool is_damaged(const StationState& s) { return s.soft[0] > s.crack[0] || s.soft[1] > s.crack[1]; }

/// Inelastic history of a six-component zone, its last resultants and its ledger.
struct ZoneState {
  bool live = true;
  BreakReason reason = BreakReason::None;
  double axial = 0;                      // plastic elongation, signed [m]
  double lifted = 0;                     // of it, what came with rotation [m]
  double shortened = 0, elongated = 0;   // accumulated; what buckles is shortened by what it is not yet straight [m]
  double crushed = 0;                    // of `shortened`, in the last evaluation [m]
  double slip[2] = {0, 0}, slipped = 0;  // [m]
  double twist = 0, twisted = 0;         // [rad]
  double hinge_bears = kUnlimited;       // compression at most: what a hinge of the same member bears as far as it has
                                         // turned [N]
  StationState station[2];
  // a law taking over within a ramp
  int base_law = -1;  // of all stations instead of their own, once a switch is done and another begins
  int next_law = -1;
  double ramp_begin = 0, ramp = 0;
  double next_share = 1;                   // of the stiffness, once the ramp is over
  double share = 1;                        // of the stiffness now
  double elastic[6] = {0, 0, 0, 0, 0, 0};  // elastic deformation of the step before
  bool has_elastic = false;
  double normal_force = 0;                       // elastic part of the first resultant, or the external one [N]
  Six resultant;                                 // elastic and damping together
  double energy = 0;                             // stored [J]
  double plastic = 0;                            // dissipated [J]
  double damping = 0;                            // dissipated [J]
  double deformation[6] = {0, 0, 0, 0, 0, 0};    // of the step before
  double elastic_force[6] = {0, 0, 0, 0, 0, 0};  // resultants without the damper, of the step before
  double damper_force[6] = {0, 0, 0, 0, 0, 0};   // the damper's part of the step before
  double flowed[6] = {0, 0, 0, 0, 0, 0};         // of the dampers [m, rad]
  double damper_energy = 0;                      // stored behind the dampers [J]
  bool yielded = false;                          // has ever passed a limit in the full law
  bool is_told = false;                          // that it has yielded
  bool is_adjusted = false;                      // lengthened from outside since the last evaluation
  double cracked_at = -kUnlimited;               // when cracks have last grown from outside [s]
  // Bounds within which no limit is passed whatever the combination, for normal forces in a range; renewed when the
  // force leaves the range, void (an empty range) after any inelastic step. With them goes the inelastic part of the
  // deformation at the marker: inside the bounds the zone is a spring from there.
  double safe_force[2] = {1, -1};         // [N]
  double safe_moment[2] = {0, 0};         // (|My| a)^p + (|Mz| b)^p <= 1 at each station [1/(N·m)]
  double crack_scale[2][2][2] = {};       // one over the bounds of cracks that may grow: of a station, about y and
                                          // z, for moments > 0 and < 0 [1/(N·m)]
  double safe_exponent = 1;               // p
  double safe_shear[2] = {0, 0};          // (Vy a)² + (Vz b)² <= 1 [1/N]
  double safe_torsion = 0;                // |T| a <= 1 [1/(N·m)]
  double offset[6] = {0, 0, 0, 0, 0, 0};  // [m, rad]
  double plane[2][3] = {{0, 0, 0}, {0, 0, 0}};  // stiffness of both bending planes with what damage softens:
                                                // shear, coupling, bending
  bool is_softened = false;                     // planes differ from the element's own stiffness
  // the ledger when the kernel took the element over [J]
  double packed_damping = 0, packed_plastic = 0, packed_behind = 0;
};

/// Constants of a zone for evaluation.
struct ZoneParameters {
  double stiffness[6];
  double viscous = 0;                          // stiffness of the spring behind the damper over the elastic one
  double relaxation = 0;                       // share of that spring's deformation that the damper takes in one step
  kernel::Plane plane = kernel::Plane::Space;  // out of which its deformations have no part
  int stations = 0;
  double x[2] = {0, 0};
  int law[2] = {-1, -1};
  bool external_axial =
      false;                 // the deformation's first component is the normal force itself; it follows no limit here
  bool is_at_rest = false;   // dead load: turning does not lengthen it, and its stations come to stand on their laws
  double crush_through = 0;  // as of a ZoneElement [m]
  double relief = 0;         // of an external force: what it loses by a unit of the zone's elongation [N/m]
  Cracking cracking[2];      // about y, z

  /// Of a whole member: two stations.
  Span span() const { return stations == 2 ? Span{std::min(x[0], x[1]), std::max(x[0], x[1])} : Span{}; }
};

/// Plastic shortening at which a zone breaks while a law, compiled or not, rules [m].
///   crush_through  as of a ZoneElement [m]
template <class Law>
double calc_crush_length(double crush_through, const Law& law) {
  return law.buckles || law.keeps_length ? law.crush_length : std::max(law.crush_length, crush_through);
}

/// The law that rules the first station, or is on its way to; -1: none.
inline int find_ruling_law(const ZoneParameters& p, const ZoneState& z) {
  return z.next_law >= 0 ? z.next_law : z.base_law >= 0 ? z.base_law : p.law[0];
}

/// Whether what shortens a zone now is crushing: it is live, and its law, or the one on its way, does not buckle.
inline bool is_crushed_by_shortening(const ZoneParameters& p, const CompiledLaws& laws, const ZoneState& z) {
  const int law = find_ruling_law(p, z);
  return z.live && law >= 0 && !laws[static_cast<size_t>(law)].buckles;
}

/// Evaluates a live zone at a deformation: sets resultant, history, energies; breaks it where a limit of rupture is
/// passed.
///   time  of the evaluation [s]; h  since the last one [s], 0 when there is none
void advance_zone(const ZoneParameters&, const CompiledLaws&, const Six& deformation, double time, double h,
                  ZoneState&);
/// Whether it has ever passed a limit, in lanes as well.
inline bool has_yielded(const ZoneState& z) {
  return z.yielded || z.station[0].reached > 0 || z.station[1].reached > 0 || z.shortened > 0 || z.slipped > 0 ||
         z.twisted > 0;
}

/// Whether the zone is a spring with a damper for as long as its forces stay inside its safe bounds.
inline bool is_bounded(const ZoneState& z, bool unlimited) {
  return z.live && z.has_elastic && z.next_law < 0 && (unlimited || z.safe_force[0] <= z.safe_force[1]);
}
/// Share of its bounds from which on a zone is better served by the law itself.
inline constexpr double kNearBounds = 0.9;
/// Largest demand over the safe bounds of a bounded zone at its last evaluation, moments added; 0 without limits.
double calc_bound_utilisation(const ZoneParameters&, const ZoneState&);
/// The same of elastic resultants at the marker.
double calc_bound_utilisation(const ZoneParameters&, const ZoneState&, const double resultants[6]);
/// Sets `crack_scale`.
void find_crack_bounds(const ZoneParameters&, ZoneState&);
/// Writes what the kernel needs to let a zone flow in bending, kernel::kFlowFields values; false if it cannot: a law on
/// its way to another one, a crushed section, a force beyond the tables, an exponent other than 1.5, or no law at all.
bool write_flow(const ZoneParameters&, const CompiledLaws&, ZoneState&, double time, double* fields);
/// Of these the cells of the moment families and the compression limit around a normal force over the section that is
/// left [N], a plastic shortening [m] and what the rotations of its stations have strained [rad]; false, and cells as
/// they were, if there is none. Looks up from the hints of z.
///   stride  between the fields
bool write_flow_cells(const ZoneParameters&, const CompiledLaws&, ZoneState&, double axial, double shortened,
                      const double strained[2], double* fields, size_t stride);
/// Lets the cracks of a live zone grow to where they hold at a deformation, whatever else happens to it then; the full
/// law books what that loses if it is asked at the same time [s]. False if nothing has grown.
bool grow_cracks(const ZoneParameters&, const Six& deformation, double time, ZoneState&);
/// The same of a zone inside its bounds whose moments let them grow, perhaps; its energies are left to the caller.
kernel::SpringCracks crack_spring(const ZoneParameters&, const CompiledLaws&, const Six& deformation, double time,
                                  ZoneState&);
/// Another law for all stations of a zone, which takes over from a time on [s] within a ramp [s]; the stiffness follows
/// once that is over.
struct LawSwitch {
  int law = 0;
  double time = 0, ramp = 0, stiffness_share = 1;
};
void begin_switch(const ZoneParameters&, const CompiledLaws&, const LawSwitch&, ZoneState&);
/// Lengthens a live zone's plastic axial deformation from outside; what that takes from or adds to the elastic energy
/// is booked as plastic work. The resultants follow at the next evaluation.
void elongate_zone(const ZoneParameters&, double by, ZoneState&);
/// Largest compression that a hinge, which turns about its z alone, bears as far as it has turned [N]; unlimited
/// without a family.
double calc_hinge_bearing(const ZoneParameters&, const CompiledLaws&, double time, const ZoneState&);
/// Makes the state of a rotational element that of a six-component one, which then has no external axial force: it
/// keeps its rotation and moment and has cracked as far as at first yield. What it stores is booked against the plastic
/// work.
///   carried  what it bears from now on where the bodies are, as resultants; the last is its own [N, N·m]
void free_zone(const ZoneParameters&, const Six& carried, ZoneState&);
/// Ends a zone: what it stores is booked as dissipated.
void break_zone(ZoneState&, BreakReason);

/// Largest demand over capacity of a live zone at its last evaluation.
double calc_utilisation(const ZoneParameters&, const CompiledLaws&, double time, const ZoneState&);

/// Whether a live zone has lost strength: a section shortened to less than 95 % of its compression capacity, or limit
/// moments below 85 % of those at its first yield (same normal force).
bool is_softening(const ZoneParameters&, const CompiledLaws&, double time, const ZoneState&);

}  // namespace topple::mbs
