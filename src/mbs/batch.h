#pragma once
/// Many variants of one model at once: one sample in each SIMD lane, a batch of them on each thread.

#include <cstddef>
#include <functional>
#include <vector>

#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::mbs {

/// Changes numbers of the model (masses, stiffnesses, limits, times of events ...); bodies, joints and elements stay as
/// many as they are and join what they join.
using Variation = std::function<void(Model&)>;

struct BatchOptions {
  Options run;      // of every sample; callbacks, samplings, progress and threads of it are not used
  int threads = 1;  // 0: all of the machine
  /// Called from several threads, for one sample never at once.
  std::function<void(size_t sample, const View&)> on_frame;
  std::function<void(size_t sample, const Happening&)> on_happening;
  std::function<void(size_t sample, const Summary&)> on_end;
  Progress progress;  // samples done, samples
};

/// Whether both have as many bodies, joints and elements, which join the same bodies.
bool is_same_build(const Model&, const Model&);

/// Runs all variations; summary i belongs to variation i. A sample gives the same bits as run() of its model alone, in
/// any lane of any batch on any thread; only wall_time is that of its batch. A sample that has no equilibrium or
/// diverges ends as its summary says and disturbs no other. Throws InputError if a varied model is not valid or not of
/// the same build; every sample before the first such one has been run or cancelled.
std::vector<Summary> run_batch(const Model&, const std::vector<Variation>&, const BatchOptions&);

}  // namespace topple::mbs
