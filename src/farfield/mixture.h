#pragma once
/// Concrete with its bars as one material for whole elements; docs/fe.md, "Laws".

#include "fem/explicit_model.h"
#include "nearfield/rcc.h"
#include "product/plan.h"

namespace topple::farfield {

/// Yield stresses of a section pulled and pushed along its axis: the forces of its fibres (concrete inside and outside
/// the ties, bars that yield, buckle and tear) over its area. Cracked concrete does not pull; what pulls are the bars.
/// Damage gathers over the zone's length: plastic strains are those of the zone times its length over the element's, so
/// that an element gives and takes what the zone does, whatever its length (Bažant & Oh 1983 for concrete, Coleman &
/// Spacone 2001 for whole sections). Elements go where all bars are torn, and where the concrete has no strength left
/// and the bars have buckled. Throws InputError like nearfield::make_fibres.
///   element_length  along the member [m]
fem::ExplicitMaterial make_section_material(const nearfield::ZoneInput&, double element_length,
                                            const std::string& name);

/// The same for slabs and walls: their bars over the thickness. Masonry has the tensile strength of its bed joints,
/// 0.1 N/mm² (EN 1996-1-1, 3.6.4), and goes at 1 % strain. Plain concrete cracks and crushes with Gf and Gcl.
///   zone_length     over which the bars stretch at a crack [m]
///   element_length  of an element's edges in the panel's plane [m]
fem::ExplicitMaterial make_panel_material(const product::Plan&, const product::Panel&, double zone_length,
                                          double element_length);

}  // namespace topple::farfield
