#pragma once
/// Axial curves of a zone, docs/theory/rcc.md (10) and (11).

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// Force against plastic shortening, from 0.75 of the peak through the peak to what buckled bars leave.
///   EA  of the transformed section [N]
AxialCurve make_compression(const Fibres&, const Peak&, double EA, double length);

/// All bars together at yield and at rupture [N], and the plastic strain between.
struct TensionBars {
  double yield = 0, rupture = 0, plastic_strain = 0;
};
/// Bars yield, harden and break; a section with few bars starts with its tensile strength and opens one crack.
AxialCurve make_tension(const TensionBars&, const material::Concrete&, double area, double length);

}  // namespace topple::nearfield
