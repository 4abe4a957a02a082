#pragma once
/// Plans for the finite elements' tests: those of the manager's.

#include "../collapse/plans.h"

namespace topple::farfield {

using collapse::analysis;
using collapse::charge;
using collapse::grid;
using collapse::house;
using collapse::materials;
using collapse::portal;
using collapse::read;

}  // namespace topple::farfield
