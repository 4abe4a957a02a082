#pragma once
/// Going on from a moment with the same model, or with one that succeeds it.

#include "mbs/moment.h"

namespace topple::mbs {

class System;

/// The system must have been started.
Moment keep_moment(System&, const Course&);

/// Puts a freshly compiled system into the state of a moment; see Simulation.
void go_on(const Moment&, System&, bool is_successor);

}  // namespace topple::mbs
