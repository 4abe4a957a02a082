#pragma once
/// A plan moved by explicit finite elements instead of the multibody system: the same record, the same findings.

#include <functional>
#include <string>

#include "collapse/run.h"
#include "farfield/whole.h"
#include "fem/explicit_system.h"

namespace topple::farfield {

struct FeOptions {
  GridOptions grid;
  double scaled_step = 0;           // > 0: elements get mass until they bear this step [s]
  bool skip_quiet = false;          // do not wait through the time in which nothing moves before a charge
  std::string checkpoint;           // file to write now and then and when cancelled; empty: none
  double checkpoint_interval = 60;  // of the clock [s]
  bool resume = false;              // go on from the checkpoint
};

struct FeCallbacks {
  /// The mesh, and what is said of mass that its elements got (empty: none).
  std::function<void(const MeshReport&, const std::string& added_mass)> on_mesh;
  std::function<void(int steps)> on_settling;  // now and then while a load is put on without motion
  std::function<void(const fem::RelaxationSummary&)> on_relaxed;
  std::function<void()> on_checkpoint;                                // when one has been written
  std::function<void(const std::string&)> on_lost_checkpoint;         // it could not be, and why; the run goes on
  std::function<void(const fem::ExplicitSystem::Timing&)> on_timing;  // at the end, since the run was begun or resumed
};

/// Runs a plan. The record holds the manager's bodies, moved by their elements; findings "farfield.*" say what only the
/// elements know. Throws InputError like make_whole and read_checkpoint; everything else is in the record. The same
/// bits at any number of threads and however often it was interrupted.
record::Record run_plan(const product::Plan&, const collapse::Knowledge&, const collapse::RunOptions&, const FeOptions&,
                        const collapse::RunCallbacks&, const FeCallbacks&);

/// Mass that elements get so that they bear a step.
struct MassScaling {
  double step = 0;               // [s]
  double mass = 0;               // added [kg]
  double share = 0;              // of the building's
  int elements = 0;              // that get some
  std::string describe() const;  // a sentence or two; empty if none gets any
};
/// What FeOptions::scaled_step would do, without a run. Throws InputError E677 if it would add the building's own mass.
MassScaling calc_mass_scaling(const Whole&, const MeshReport&, const collapse::Knowledge&, double scaled_step);

/// The manager's model of the plan and the building in finite elements, without running either.
Whole make_whole(const product::Plan&, const collapse::Knowledge&, const GridOptions&, int threads);

}  // namespace topple::farfield
