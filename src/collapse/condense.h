#pragma once
/// Like frames of a building as one (docs/theory/manager.md, section 8): a coarser model for the many runs of a study.

#include <span>
#include <string>
#include <vector>

#include "collapse/law.h"
#include "collapse/manager.h"

namespace topple::collapse {

/// Which frames of a plan stand for which. K classes, F frames.
struct Condensation {
  std::vector<std::vector<int>> frames;  // of each class, rising; the first stands for all        (K)
  std::vector<int> class_of;             // of each frame,                                           (F)
  std::string refusal;                   // why the plan cannot be condensed; empty: it can
};

/// Frames across the rows are alike where their columns, beams, walls and charges are, and what hangs on them on both
/// sides, in all of the plans: a plan and samples of it. The plans differ in numbers only.
Condensation find_like_frames(std::span<const product::Plan* const>, const Knowledge&);

/// Curves and laws of the plan's condensed model: samples share those that do not depend on their values.
KnownCurves make_known_curves(const product::Plan&, const Knowledge&, const Condensation&);

/// The model of one frame of each class, with the mass, stiffness and resistance of all of its class, moving in the
/// plane of the frames. Numbers as of make_model; what lies between frames of one class is left out but for its mass.
///   known  curves that need not be made anew; may be null
/// Throws InputError as make_model does, and E206: frames of one class that differ in this plan.
mbs::Model make_condensed_model(const product::Plan&, const Knowledge&, const Condensation&, const KnownCurves* known,
                                ModelMap& map);

}  // namespace topple::collapse
