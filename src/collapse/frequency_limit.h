#pragma once
/// What swings faster than anything that matters sets no step (docs/theory/manager.md, section 9).

#include "mbs/model.h"

namespace topple::collapse {

/// Cuts horizontal stiffnesses and raises rotary inertias of a model: no spring alone swings the two bodies that it
/// joins, and no body turns against all others held, faster than a frequency. Together they may swing some twice as
/// fast. What bears loads, vertically, keeps its stiffness. Of a planar model: along x and about y.
///   highest  [rad/s]
void limit_frequency(mbs::Model&, double highest);

/// The same for bodies that events put in the place of others, and for the springs that joints become.
void limit_frequency_of_stubs(mbs::Model&, double highest);

}  // namespace topple::collapse
