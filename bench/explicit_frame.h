#pragma once
#include "fem/explicit_model.h"

namespace topple::bench {

/// A frame of cells of 0.4 m on the ground: slabs of one cell every seventh layer, columns of 2 x 2 cells every twelve.
fem::ExplicitModel make_explicit_frame(int bays_x, int bays_y, int storeys);

}  // namespace topple::bench
