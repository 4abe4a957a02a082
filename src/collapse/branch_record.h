#pragma once
/// What a branch has recorded so far, taken at once, so that its findings can be made while the branch goes on.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collapse/steering.h"

namespace topple::collapse {

class BranchRecord {
 public:
  /// Copies frames, events and series. Shared with the branch are its model, which is never changed, and the knowledge,
  /// which must outlive this. The rest may happen in any thread.
  BranchRecord(const Branch&, const Knowledge&, const RunOptions&);
  BranchRecord(const BranchRecord&) = delete;
  BranchRecord& operator=(const BranchRecord&) = delete;

  int branch() const { return branch_; }
  double time() const { return time_; }  // of the frontier then [s]
  const LiveModel& model() const { return *live_; }
  std::shared_ptr<const LiveModel> start() const { return start_; }  // before any edit

  /// The record with its findings, once; nothing where `cancel` was seen set.
  [[nodiscard]] std::optional<record::Record> finish(const std::atomic<bool>* cancel = nullptr);

 private:
  std::shared_ptr<const LiveModel> live_, start_;  // at its end, and before any edit
  const Knowledge& k_;
  int branch_;
  double time_;
  bool has_ended_;
  RunOptions options_;
  mbs::Summary summary_;
  record::Record record_;
  RunCallbacks nobody_;
  std::optional<Recorder> recorder_;
};

}  // namespace topple::collapse
