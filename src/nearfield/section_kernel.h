#pragma once
/// Stress resultants of a section of layers, eight layers at a time in SIMD lanes (Highway). Every instruction set, and
/// every width of its vectors, gives the same bits: sums run over eight places whatever the width, and no product is
/// fused with a sum.

#include <string>
#include <vector>

#include "material/concrete.h"
#include "nearfield/fibres.h"

namespace topple::nearfield {

/// A section laid out for the lanes: fields of rows of eight, padded with places of no area.
struct PackedSection {
  material::Concrete core, cover;
  size_t core_rows = 0, cover_rows = 0, steel_rows = 0;
  // core, then cover: place, area; steel: place, area and the constants of its law
  std::vector<double> data;
};

PackedSection pack_section(const Fibres&);
/// Gives the bars their histories; those that have torn lose their area. States of the section's rows of bars (R).
void set_bars(PackedSection&, const material::SteelState* bars, size_t count);

/// As calc_resultants of the section that was packed, to round-off.
Resultants calc_resultants(const PackedSection&, double eps_0, double kappa);
/// The same in vectors of one number.
Resultants calc_resultants_singly(const PackedSection&, double eps_0, double kappa);
/// Name of the instruction set in use.
std::string section_kernel_target();

}  // namespace topple::nearfield
