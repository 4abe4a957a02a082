#pragma once
/// Dead load into equilibrium by steps of a fictitious time (docs/theory/explicit.md, "Relaxation").

#include "fem/explicit_inside.h"

namespace topple::fem {

RelaxationSummary relax_system(ExplicitSystem::Inside&, const RelaxationOptions&, const Progress&);

}  // namespace topple::fem
