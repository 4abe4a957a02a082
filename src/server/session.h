#pragma once
/// One plan that is steered: a thread that computes and does commands in the order in which they come.

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "collapse/action_log.h"
#include "server/client.h"
#include "server/json.h"
#include "server/record_worker.h"

namespace topple::server {

struct SessionPlan {
  std::string title;  // where there is no file
  std::string path;   // of the file; empty: none
  std::string text;
  bool goes_on = false;  // with the latest session of the same plan, if there is one
};

struct SessionSetting {
  collapse::Knowledge knowledge;
  std::string rules;  // text they were read from; empty: built in
  collapse::SteeringOptions steering;
  std::string folder;    // of logs and studies
  std::string plans;     // folder of plans
  double chunk = 0.008;  // wall time from one look at the commands to the next [s]
};

/// Where the action log of a plan begins: its name in a folder; a free one with a number behind it is taken if it
/// exists. Empty if `folder` is.
std::string log_path(const std::string& folder, const std::string& plan_path);

/// The file of a plan is not the one that a text began from.
class Conflict : public InputError {
 public:
  Conflict(std::vector<Diagnostic> d, std::string disk_sha256, std::string disk_text)
      : InputError(std::move(d)), sha256(std::move(disk_sha256)), text(std::move(disk_text)) {}
  std::string sha256, text;  // of the disk
};

class Session {
 public:
  Session(int id, SessionPlan, const SessionSetting&);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  int id() const { return id_; }
  const SessionSetting& setting() const { return setting_; }

  /// A command of a client; it is answered.
  void post(std::shared_ptr<Client>, std::int64_t id, Json command);
  /// Runs in the session's thread.
  /// A client whose command it answers is told if the session is closed before.
  void ask(std::function<void(Session&)>, std::shared_ptr<Client> = nullptr, std::int64_t id = 0);

  /// Begins to tell a client; hello, or what it missed after an event.
  void welcome(const std::shared_ptr<Client>&, std::optional<long> after = std::nullopt);
  void leave(const Client*);

  /// {id, title, path, phase}; any thread.
  Json brief() const;

  // in the session's thread
  Json describe() const;
  const collapse::LoggedSteering* steering() const { return steering_.get(); }
  const SessionPlan& plan() const { return plan_; }
  /// Records of branches so far, with findings, which come later.
  void want_records(RecordRequest);
  std::vector<std::string> log_lines() const;
  const product::Plan* find_plan() const { return checked_plan_ ? &*checked_plan_ : nullptr; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase { Building, Equilibrium, Paused, Running, Finished, Failed };

  void work();
  void build(const product::Plan&);
  /// Does an earlier session again and goes on from there. Throws InputError as collapse::replay; then there is no
  /// model.
  void build_from_log(const std::string& path);
  collapse::SteeringCallbacks make_callbacks();
  /// Nothing was computed or changed yet.
  bool is_untouched() const;
  Json go_on_from_log(const Json& command);
  void begin_branch();
  void advance_chunk();
  void pause();
  void settle_phase();
  void publish_frame(bool is_due);
  void publish_state(bool is_due);
  void publish_zones();
  void look_at_file();
  void tell(Json event);  // to all, numbered
  void tell_branch(const collapse::Branch&);
  Json make_hello(const Client&) const;
  std::vector<std::shared_ptr<Client>> watchers() const;
  std::shared_ptr<FrameBody> make_frame(const collapse::Branch&, std::size_t frame) const;
  Json make_scene(const collapse::Branch&) const;
  void send_frame(const std::shared_ptr<const FrameBody>&);

  struct Task {
    std::shared_ptr<Client> client;
    std::int64_t id = 0;
    Json command;
    std::function<void(Session&)> call;
  };
  /// The result of a command (session_commands.cpp); nothing if its answer comes later. Throws InputError.
  std::optional<Json> perform(const Task&);
  /// Answers a command by what records of branches give.
  void answer_from_records(const Task&, std::vector<int> branches, std::function<Json(const JudgedBranches&)>);
  Json run_clock(const std::string& word, const Json& command);
  Json send_frames(Client&, const Json& command) const;
  Json watch_zone(Client&, const Json& command) const;
  Json read_series(const Json& command) const;
  Json save_plan(const Json& command);
  Json change(const std::string& word, Json command);
  collapse::Steering& core() const;
  void fail_to_build(const char* kind, const InputError& why);
  collapse::Branch& branch_of(const Json& command) const;
  std::string phase_word() const;

  int id_;
  SessionPlan plan_;
  SessionSetting setting_;
  std::unique_ptr<collapse::LoggedSteering> steering_;
  std::optional<product::Plan> checked_plan_;
  std::optional<collapse::LogSummary> earlier_;  // session of the same plan
  std::optional<double> progress_;               // of building, 0..1

  // commands
  mutable std::mutex mutex_;
  std::condition_variable wakes_;
  std::deque<Task> tasks_;
  Json brief_;
  std::atomic<bool> closing_ = false;

  // who looks; events kept for those who come back
  mutable std::mutex watch_mutex_;
  std::vector<std::weak_ptr<Client>> clients_;
  std::deque<std::pair<long, std::shared_ptr<const std::string>>> events_;
  long seq_ = 0;

  // the clock
  Phase phase_ = Phase::Building;
  std::string failure_, failure_kind_, failure_code_;  // code: of plans and files
  std::vector<Diagnostic> diagnostics_;
  std::optional<double> speed_, until_;
  long frames_left_ = -1, steps_left_ = -1;
  Clock::time_point speed_start_, last_state_, last_frame_, last_reached_, last_look_, rate_start_, command_at_;
  double speed_time_ = 0, rate_time_ = 0, rate_ = 0;
  std::size_t frame_sent_ = 0;
  int frame_branch_ = 0, frame_starts_ = 0;
  Json last_state_told_;
  std::string file_sha256_;

  std::optional<RecordWorker> records_;
  std::thread thread_;
};

}  // namespace topple::server
