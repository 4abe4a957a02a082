#pragma once
/// Rings: sections of shafts, whole or with sectors missing, as fibres of the annulus; docs/theory/ring.md.
/// Local axes in the section: y and z from the ring's centre, angles from y towards z.

#include <string>
#include <vector>

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// Part of the ring that is there, and what is left of it.
struct RingSector {
  double from = 0, to = 0;        // [rad], from < to
  double concrete = 1, bars = 1;  // shares left, 0..1
  double angle() const { return to - from; }
};

struct RingInput {
  std::string name;
  double outer = 0, thickness = 0;             // outer radius [m]
  product::Concrete concrete;                  // or masonry, see make_masonry
  product::Steel steel;                        // without bars: unused
  double as_outer = 0, as_inner = 0;           // upright bars per metre of the circle on which they stand [m²/m]
  double bar_diameter = 0, cover = 0;          // [m]
  double hoop_diameter = 0, hoop_spacing = 0;  // 0: none [m]
  double length = 0;                           // of the zone, over which curvature localises [m]
  double concrete_loss = 0;                    // strength lost beside a charge, 0..1
  std::vector<RingSector> sectors;             // apart from each other, rising; empty: all around
};

/// Areas and uncracked second moments of what is left; concrete and bars apart, transformed where it says so.
struct RingProperties {
  double area = 0, steel_area = 0;  // [m²]
  double y = 0, z = 0;              // centroid of the transformed section [m]
  double EA = 0;                    // [N]
  double EI_y = 0, EI_z = 0;        // about axes through the centroid along y and z [N·m²]
  double EI_yz = 0;                 // ∫ E y z dA about the centroid; 0: y and z are principal axes [N·m²]
  bool is_closed = false;           // concrete all around
};
/// Throws InputError for a ring that cannot be computed, or nothing left of it.
RingProperties calc_ring_properties(const RingInput&);

/// Sectors in rising order, neighbours that are alike as one, also across the beginning of the circle.
std::vector<RingSector> join_sectors(std::vector<RingSector>);

/// Turns local y into the principal axis of what is left that is nearest to the line through its centroid and the
/// ring's centre (of a symmetric arc, its axis of symmetry; of a whole ring, as it is), pointing forward as before, and
/// says by how much [rad]. Sectors become joined ones. Throws InputError as calc_ring_properties.
double turn_to_principal_axes(RingInput&);

/// Layers across y (Axis::Z) or z (Axis::Y), measured from (y, z) of the ring's centre; `direction` +1 pulls at
/// positive `at`: half_depth is the distance of the compressed edge.
Fibres make_ring_fibres(const RingInput&, Axis, int direction, double y, double z);

/// Curves about the centroid of what is left, as make_rcc. Throws InputError as make_rcc.
Rcc make_ring_rcc(const RingInput&);

/// Bars that a charge leaves of the sectors, about the centroid of what is left before. No bars: nothing.
ResidualCage make_ring_cage(const RingInput&, double destroyed_length, double residual_bars);

}  // namespace topple::nearfield
