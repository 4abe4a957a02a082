#pragma once
/// Findings of a session's branches, made in a thread of their own while the session's thread goes on.

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "base/error.h"
#include "collapse/branch_record.h"
#include "server/judged_branch.h"

namespace topple::server {

using JudgedBranches = std::shared_ptr<const std::vector<JudgedBranch>>;

/// One of the two is called, once, in whichever thread.
struct RecordRequest {
  std::vector<int> branches;
  std::function<void(const JudgedBranches&)> use;  // in the order of `branches`
  std::function<void(const InputError&)> refuse;   // E920, E930, E940
};

class RecordWorker {
 public:
  /// `on_idle` is called in the worker's thread when it can take more: then serve() is due.
  explicit RecordWorker(std::function<void()> on_idle);
  ~RecordWorker();
  RecordWorker(const RecordWorker&) = delete;
  RecordWorker& operator=(const RecordWorker&) = delete;

  // in the session's thread
  /// Requests wait in line, and those of the same branches are served together by what is there when their turn comes.
  void ask(RecordRequest);
  /// Takes copies for the first ones in line if nothing is under way: at most one copy of each branch is held.
  void serve(const collapse::Steering&);
  /// Stops what is under way and refuses what waits: the branches are gone.
  void cancel();

 private:
  struct Copy {
    std::unique_ptr<collapse::BranchRecord> record;
    std::vector<JudgedBranch::Edit> edits;
  };
  struct Job {
    std::vector<Copy> copies;
    std::vector<RecordRequest> requests;
  };
  void work();
  void finish(Job&);

  std::function<void()> on_idle_;
  std::deque<RecordRequest> waiting_;  // of the session's thread
  std::mutex mutex_;                   // guards job_, is_busy_, closing_
  std::condition_variable wakes_;
  std::unique_ptr<Job> job_;
  bool is_busy_ = false, closing_ = false;
  std::atomic<bool> cancel_ = false;
  std::thread thread_;
};

}  // namespace topple::server
