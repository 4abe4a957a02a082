#pragma once
/// What a run means for the planner: findings in the order in which they matter.

#include "collapse/recorder.h"

namespace topple::collapse {

/// Fills findings, not_modelled and the rigid block's series of a finished record.
void add_findings(const product::Plan&, const mbs::Model&, const ModelMap&, const Knowledge&, const Recorder&,
                  const mbs::Summary&, record::Record&);

}  // namespace topple::collapse
