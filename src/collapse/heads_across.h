#pragma once
/// Heads of ground columns about the axis about which they do not turn in a run (docs/theory/findings.md, section 2).

#include <atomic>

#include "collapse/findings.h"
#include "collapse/run.h"

namespace topple::collapse {

/// The equilibrium under dead load of a plan's building whose ground columns turn in their heads about the other axis.
HeadsAcross find_heads_across(const product::Plan&, const Knowledge&, const RunOptions&,
                              const std::atomic<bool>* cancel, const Mover&);

}  // namespace topple::collapse
