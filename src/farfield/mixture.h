#pragma once
/// Concrete with its bars as one material for whole elements; docs/fe.md, "Laws".

#include "fem/explicit_model.h"
#include "nearfield/rcc.h"
#include "product/plan.h"

namespace topple::farfield {

/// Yield stresses of a section pulled and pushed along its axis: the forces of its fibres (concrete inside and outside
/// the ties, bars that yield, buckle and tear) over its area, softening over the zone's length. Cracked concrete does
/// not pull; what pulls are the bars. Elements go where all bars are torn, and where the concrete has no strength left
/// and the bars have buckled. Throws InputError like nearfield::make_fibres.
fem::ExplicitMaterial make_section_material(const nearfield::ZoneInput&, const std::string& name);

/// The same for slabs and walls: their bars over the thickness. Masonry has the tensile strength of its bed joints,
/// 0.1 N/mm² (EN 1996-1-1, 3.6.4), and goes at 1 % strain.
fem::ExplicitMaterial make_panel_material(const product::Plan&, const product::Panel&, double length);

}  // namespace topple::farfield
