#pragma once
/// Computational steering: branches of runs of a plan, edited at kept moments. The past is read-only. One thread.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collapse/edit.h"
#include "collapse/live_run.h"

namespace topple::collapse {

class BranchRecord;

/// A stretch of a run that a branch goes through: its first frames, until a step.
struct Piece {
  std::shared_ptr<LiveRun> run;
  size_t frames = 0;   // of the run, that the branch has; of the last piece: all of them
  long step = 0;       // of the fork at its end, counted from the start of the plan
  double time = 0;     // of that [s]
  double seconds = 0;  // that computing the run took until there; of the last piece: see the run
};

struct EditEntry {
  Edit edit;
  std::string text;
  double time = 0;            // [s]
  bool made_branch = false;   // by itself
  int from = 0;               // branch on which it was made
  std::vector<Piece> before;  // the branch's pieces without it
  size_t first_frame = 0;     // and its first frame
};

struct Branch {
  int id = 0;
  std::string name;
  int parent = 0;                // 0: a plan's start
  double time = 0;               // where it began [s]
  size_t first_frame = 0;        // of its own
  int starts = 0;                // how often its frames began anew since it was made
  std::vector<Piece> pieces;     // the last one goes on
  std::vector<EditEntry> edits;  // its own
  std::string sample;            // of a study, in words; empty: none

  LiveRun& run() const { return *pieces.back().run; }
  double frontier() const { return run().time(); }
  long steps() const { return run().steps(); }
  size_t frames() const;
  /// Piece that holds a frame, and the frame in it.
  std::pair<const Piece*, size_t> find_frame(size_t frame) const;
};

/// Where an edit acts.
struct Cursor {
  int branch = 0;
  bool is_live = true;  // at the frontier
  size_t frame = 0;     // else
};

struct SteeringOptions {
  RunOptions run;
  std::size_t moment_bytes = std::size_t{256} << 20;  // kept in all, at most
  std::size_t most_branches = 200, most_edits = 200;  // each holds a copy of the model
  double moment_interval = 0.1;                       // of simulated time, at the start [s]
};

struct SteeringCallbacks {
  std::function<void(const Branch&)> on_branch;                       // made or changed
  std::function<void(const Branch&, const record::Event&)> on_event;  // as it happens
  std::function<void(const Branch&, size_t frame)> on_frame;          // kept one, at the frontier
};

class Steering {
 public:
  Steering(const Knowledge&, SteeringOptions, SteeringCallbacks = {});

  /// A branch from the start of a plan, not begun. Throws InputError for plans that cannot be built.
  Branch& add_root(const product::Plan&, const std::string& name);
  /// The equilibrium and the first frame; false if there is none. Nothing is done twice.
  bool begin(Branch&);

  const std::vector<std::unique_ptr<Branch>>& branches() const { return branches_; }
  /// Throws InputError E920.
  Branch& branch(int id) const;
  Branch& active() const { return branch(active_); }
  void switch_to(int id);
  void rename(int id, const std::string& name);

  /// One step of the active branch; false if it has ended.
  bool advance();
  /// Computes a branch until a step.
  void advance_to(Branch&, long step);

  const Cursor& cursor() const { return cursor_; }
  /// At the last kept frame of the active branch at or before a time.
  void rewind(double time);
  void rewind_to_frame(size_t frame);
  void go_live() { cursor_ = {active_, true, 0}; }
  double cursor_time() const;
  /// Step of the active branch where an edit would act.
  long cursor_step() const;

  struct Made {
    Branch* branch = nullptr;
    std::string text;
    double time = 0;  // where it acted [s]
    long step = 0;
  };
  /// Makes an edit at the cursor, on a new branch or on the active one (docs/protocol.md, "Edits"), which is active
  /// then. Throws InputError as LiveModel::apply; then nothing has changed.
  Made edit(const Edit&, const std::string& name = {}, bool in_place = false);
  /// A branch from the cursor without an edit.
  Made fork(const std::string& name);
  /// Takes back the last edit of the active branch. Throws InputError E934.
  Made undo();

  /// What a branch has recorded so far, for findings that are made elsewhere.
  std::unique_ptr<BranchRecord> copy_record(const Branch&) const;
  /// The whole record of a branch so far, with findings.
  record::Record make_record(const Branch&) const;
  /// Times of moments kept along a branch [s].
  std::vector<double> moments(const Branch&) const;
  std::size_t moment_bytes() const;

 private:
  Branch& add_branch(Branch);
  void thin_out();
  /// Of a branch whose frames began anew.
  void start_anew(Branch&, size_t first_frame);
  /// A name that no branch has: the wanted one, or "what-if N". Throws InputError E912.
  std::string free_name(const std::string& wanted) const;
  /// The same for one more branch. Throws InputError E905 where there are too many.
  std::string name_of_new(const std::string& wanted) const;
  /// The pieces of a branch up to a frame's step, or to the frontier.
  std::vector<Piece> cut(const Branch&, const Cursor&) const;
  /// A run that goes on at the end of the pieces with a model.
  std::shared_ptr<LiveRun> go_on(const std::vector<Piece>&, std::shared_ptr<const LiveModel>, bool is_successor) const;
  void watch(Branch&);

  const Knowledge& k_;
  SteeringOptions options_;
  SteeringCallbacks callbacks_;
  std::vector<std::unique_ptr<Branch>> branches_;
  int active_ = 0;
  Cursor cursor_;
};

}  // namespace topple::collapse
