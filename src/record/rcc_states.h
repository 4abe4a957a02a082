#pragma once
/// Pictures of a section at points of a curve: conditions, strains, stresses.

#include <vector>

#include "record/rcc_figures.h"

namespace topple::record {

/// One row for each state, all of one axis, direction and normal force; there is at least one.
Drawing draw_states(const RccReport&, const std::vector<const RccState*>&);
FigureTable make_state_table(const std::vector<const RccState*>&);

/// The zone on the solid route: stresses of the cut, cracks and crushing seen from the side; one row for each state,
/// all of one axis, direction and normal force; there is at least one.
Drawing draw_solid_states(const RccReport&, const std::vector<const RccSolidState*>&);
FigureTable make_solid_table(const std::vector<const RccSolidState*>&);

}  // namespace topple::record
