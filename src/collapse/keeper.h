#pragma once
/// Checkpoints of a run: written while it goes on, and gone on from.

#include <string>

#include "collapse/recorder.h"
#include "collapse/run.h"
#include "mbs/moment.h"

namespace topple::collapse {

/// Ids and values of all rules, as part of what a checkpoint is of.
std::string write_rules(const Knowledge&);

class Keeper {
 public:
  /// All must outlive it.
  Keeper(const RunOptions&, const RunCallbacks&, Recorder&);
  /// Lets the engine keep checkpoints, and go on from one with the recorder as it was then. The options are complete
  /// but for that; the keeper must outlive the run. Throws InputError E674.
  ///   of  what the record is of beside the model, such as the text of its plan
  void join(const mbs::Model&, const std::string& of, mbs::Options&);

 private:
  const RunOptions& options_;
  const RunCallbacks& callbacks_;
  Recorder& recorder_;
  std::string key_;
  mbs::Moment moment_;
};

}  // namespace topple::collapse
