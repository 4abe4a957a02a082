#pragma once
/// Everything that was done in a steering session, as an append-only file, and the same again (docs/protocol.md,
/// "Action log").

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "collapse/steering.h"

namespace topple::collapse {

/// Makes the plan of a point that a study looked at; the log holds the plan's text and the values.
using SamplePlan = std::function<product::Plan(const product::Plan&, const std::vector<double>& inputs)>;

/// A steering session that writes down what is done. Line by line, each flushed before the answer.
class LoggedSteering {
 public:
  /// Begins a log with the plan; an existing file is not touched, the next free name is taken.
  ///   path  empty: no file
  /// Throws InputError for plans that cannot be built, std::runtime_error if the file cannot be written.
  LoggedSteering(const product::Plan&, const Knowledge&, SteeringOptions, SteeringCallbacks, const std::string& path,
                 SamplePlan sample_plan = {});
  ~LoggedSteering();
  LoggedSteering(const LoggedSteering&) = delete;
  LoggedSteering& operator=(const LoggedSteering&) = delete;

  Steering& steering() { return *steering_; }
  const Steering& steering() const { return *steering_; }

  /// Edits, `branch`, `rename`, `switch`, `undo`, `plan.apply`, `sample`: commands of the protocol, at the cursor of
  /// the active branch. Throws InputError, and std::runtime_error if the log has no room; then nothing has changed.
  Steering::Made perform(const nlohmann::ordered_json& command);
  static bool is_action(const std::string& command);

  /// Writes how far the active branch has been computed, if that is news.
  void note_reached();
  /// The file is removed in the end unless it is kept: then it gets this name, or the next one that is free. Throws
  /// std::runtime_error.
  void hold_back() { is_kept_ = false; }
  void keep_as(const std::string& path);

  const std::vector<std::string>& lines() const { return lines_; }  // of the log, without line ends
  const std::string& path() const { return path_; }
  std::function<void(const std::string& line)> on_line;

 private:
  void note_reached(const Branch&);
  void write(const nlohmann::ordered_json&);
  /// Room for an action in the file, so that none is done that cannot be written down. Throws std::runtime_error.
  void reserve(const nlohmann::ordered_json& command) const;

  product::Plan plan_;
  std::unique_ptr<Steering> steering_;
  SamplePlan sample_plan_;
  std::string path_;
  int file_ = -1;
  bool is_kept_ = true;
  bool is_broken_ = false;  // an action was done and could not be written
  long seq_ = 0;
  std::vector<std::string> lines_;
  std::map<int, long> reached_;  // step of each branch
};

/// What a log holds, without doing it again.
struct LogSummary {
  std::string path, created;
  long actions = 0;  // beside how far branches were computed
  int branches = 1;
  double time = 0;  // farthest that one was computed [s]
};

/// The latest log beside `path` (its name, or one with a number behind it) of the same plan, program, rules and run
/// options in which something was computed or changed, and that no session holds; none if there is none. Files that are
/// no logs are passed over.
std::optional<LogSummary> find_earlier_log(const std::string& path, const std::string& plan_sha256, const Knowledge&,
                                           const RunOptions&);

struct ReplayResult {
  std::unique_ptr<LoggedSteering> steering;
  long actions = 0;
  bool was_cut = false;  // the last line had no end
};

/// Does a log again, up to its last whole line, so that one can go on from there. Throws InputError: a text that is no
/// log (E942), one of another program or other rules (E943).
///   path  of the log of what is done again and of what follows; empty: none
ReplayResult replay(const std::string& log, const std::string& name, const Knowledge&, SteeringOptions,
                    const SamplePlan&, const Progress& = {}, const SteeringCallbacks& = {},
                    const std::string& path = {});

}  // namespace topple::collapse
