#pragma once
/// Heads of ground columns about the axis about which they do not turn in a run (docs/theory/findings.md, section 2).

#include <atomic>

#include "collapse/findings.h"
#include "collapse/run.h"

namespace topple::collapse {

/// Whether any heads turn: mouths of shafts have none.
bool has_heads(const ModelMap&);

/// The equilibrium under dead load of a plan's building whose ground columns turn in their heads about the other axis.
HeadsAcross find_heads_across(const product::Plan&, const Knowledge&, const RunOptions&,
                              const std::atomic<bool>* cancel, const Mover&);

/// Says in the findings that it was cancelled: the margin before the first charge is that of one axis.
void tell_heads_left_out(record::Record&);

}  // namespace topple::collapse
