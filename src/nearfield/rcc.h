#pragma once
/// Resistance characteristic curves (rcc) of a zone of a member, layered route: a beam of fibres over the zone's
/// length. Signs: N and strains positive in tension; a family M(φ; N) holds one curve for each normal force.

#include <string>
#include <vector>

#include "product/plan.h"

namespace topple::nearfield {

/// What of a slab works with a beam along its upper edge, in bending about y and along the axis. Its concrete is the
/// beam's; one that is weaker counts by less breadth.
struct Flange {
  double breadth = 0;    // beside the web, both sides together; 0: none [m]
  double thickness = 0;  // [m]
  struct Bars {
    double depth = 0, area = 0;  // below the upper edge [m], along the beam [m²]
  };
  Bars top, bottom;
  product::Steel steel;

  double bar_area() const { return top.area + bottom.area; }  // [m²]
};

/// What is asked: one zone of one section.
struct ZoneInput {
  product::Section section;
  product::Concrete concrete;
  product::Steel steel;
  Flange flange;
  double length = 0;         // length over which curvature localises [m]
  double cut_bars = 0;       // fraction of bars cut before (preparation), those of the flange too
  double cut_concrete = 0;   // fraction of the area taken out before, of the flange's too
  double concrete_loss = 0;  // strength lost in the transition zone beside a charge, 0..1
  bool cover_lost = false;
  double free_bars = 0;  // length over which bars are free, clamped at its ends; 0: as the ties leave them [m]
};

/// The cover is gone, and with it a slab beside the web.
inline void lose_cover(ZoneInput& in) { in.cover_lost = true, in.flange = {}; }

/// One axis and one direction of bending: moments against the zone's rotation for each normal force. K forces, J
/// rotations. The rows of the first force (crushing at no curvature) and of the last (rupture of all bars) are zero,
/// and so is the last column: beyond the grid the zone is broken. A row that becomes zero earlier has lost its
/// moment or its equilibrium: the section can no longer carry that force. Rotations are measured from the state without
/// moment. Positive about y: the end at larger x turns about +y, tension at +z. Positive about z: tension at -y.
struct MomentFamily {
  std::vector<double> normal_force;  // rising [N] (K)
  std::vector<double> rotation;      // total rotation of the zone, rising from 0 [rad] (J)
  std::vector<double> moment;        // [N·m] (K x J), row k for normal_force[k]; >= 0
  std::vector<double> elongation;  // of the zone at the section's centre since the state without moment, at that force;
                                   // goes on as before where the force is lost; none: not known [m] (K x J)
  std::vector<double> yield_rotation, yield_moment;  // per force (K), positive rotations; the first of: steel yields in
                                                     // tension, an edge reaches ε_c1, 0.75 of the peak
};

/// Plastic shortening or elongation against force magnitude at no bending, elastic part (EA / length) taken out; first
/// value at 0: in compression 0.75 of the peak, in tension yield of the bars.
struct AxialCurve {
  std::vector<double> displacement;  // plastic, rising from 0 [m]
  std::vector<double> force;         // magnitude [N]
};

struct Rcc {
  MomentFamily y_pos, y_neg, z_pos, z_neg;  // bending about local y and z, both directions, magnitudes
  AxialCurve compression, tension;
  double EA = 0;                    // axial stiffness of the transformed section [N]
  double EI_y = 0, EI_z = 0;        // uncracked flexural stiffness [N·m²]
  double GA = 0;                    // shear stiffness, 5/6 of the gross area [N]
  double GJ = 0;                    // torsional stiffness, cracked to a fifth [N·m²]
  double shear_y = 0, shear_z = 0;  // shear capacity without normal force [N]
  double shear_friction = 0;        // further capacity per newton of compression [-]
  double torsion = 0;               // torsional capacity [N·m]
  double biaxial_exponent = 1.5;    // p of (M_y / M_y,max)^p + (M_z / M_z,max)^p = 1, 1 to 4
  double damage_share = 0;  // share of the inelastic rotation that is damage (stiffness lost), not plastic: 1 - b

  /// Effective flexural stiffness yield_moment / (yield_rotation / length) at the normal force N.
  double calc_EI_effective_y(double N) const;
  double calc_EI_effective_z(double N) const;
  double length = 0;
};

/// Curves of an intact or prepared zone. Throws InputError for sections that cannot be computed, and for a length at or
/// above calc_largest_zone_length.
Rcc make_rcc(const ZoneInput&);

/// Longest zone (excluded) over which the concrete can soften without giving back more than its crushing or fracture
/// energy [m]. Losses of strength do not change it.
double calc_largest_zone_length(const product::Concrete&);

/// Zones that would be longer are cut to this share of it.
inline constexpr double kLongestZoneShare = 0.9;

/// What a fired charge leaves: a bare cage of η_s of the bars over the destroyed length. No concrete.
struct ResidualCage {
  AxialCurve compression, tension;    // bars buckle in compression, yield in tension
  double moment_y = 0, moment_z = 0;  // from bar couples [N·m]
  double shear = 0;                   // dowel and frame action of the bars [N]
  double EA = 0;                      // [N]
};
ResidualCage make_residual_cage(const ZoneInput&, double destroyed_length, double residual_bars);

/// Slab or wall zone per metre of hinge line; unreinforced panels have only their tensile strength.
struct PanelRcc {
  double moment_pos = 0, moment_neg = 0;              // yield moments, bottom and top reinforcement [N·m/m]
  double ultimate_rotation = 0;                       // rupture of the bars; crushing is in make_shell_rcc [rad]
  double tension = 0, compression = 0;                // membrane capacities [N/m]
  double shear_in_plane = 0, shear_out_of_plane = 0;  // [N/m]
  double EA = 0;                                      // membrane stiffness times length [N/m]
  double EI = 0;                                      // cracked bending stiffness [N·m²/m]
  double elongation_at_rupture = 0;                   // [m] over one thickness
};
PanelRcc make_panel_rcc(const product::Panel&, const product::Concrete*, const product::Steel*);

}  // namespace topple::nearfield
