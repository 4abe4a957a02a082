#pragma once
/// A stretch of a run that is computed step by step, keeps moments to go on from, and records itself.

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "collapse/live_model.h"
#include "collapse/recorder.h"
#include "mbs/moment.h"

namespace topple::collapse {

/// What a zone does at one frame: N, My, Mz [N, N·m], rotations of the element about y and z [rad].
inline constexpr size_t kZonePath = 5;

class LiveRun {
 public:
  /// From the start of the plan.
  LiveRun(std::shared_ptr<const LiveModel>, const RunOptions&, double moment_interval);
  /// Goes on from a moment of another run whose bodies are the same.
  LiveRun(std::shared_ptr<const LiveModel>, const RunOptions&, double moment_interval, const mbs::Moment&,
          bool is_successor, const Recorder& before);
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// The equilibrium and the first frame, once; false if the run ends there.
  bool begin();
  /// One step; false if the run has ended. The simulation is made anew from the last moment where it was let go.
  bool advance();
  /// Lets the simulation go; what is needed to go on is kept.
  void rest();
  /// A moment at a step of this run, computed from the kept one before it.
  mbs::Moment moment_at(long step) const;

  const LiveModel& model() const { return *model_; }
  const std::shared_ptr<const LiveModel>& model_pointer() const { return model_; }
  const record::Record& record() const { return *record_; }
  const Recorder& recorder() const { return *recorder_; }
  const std::vector<long>& frame_steps() const { return frame_steps_; }        // of each frame
  const std::vector<double>& frame_seconds() const { return frame_seconds_; }  // spent computing until each frame
  /// Spent computing this run so far; pauses are none of it [s].
  double seconds() const;
  const std::vector<float>& zone_path() const { return zone_path_; }  // (frames x zones x kZonePath), or empty
  /// Of each cable of the model at the last frame of this run [N]; empty before the first one.
  const std::vector<double>& cable_force() const { return cable_force_; }
  double time() const { return time_; }
  long steps() const { return steps_; }
  double next_time() const { return next_time_; }  // of the step after the last one [s]
  double start_time() const { return start_time_; }
  long start_steps() const { return start_steps_; }
  bool has_begun() const { return begun_; }
  bool has_ended() const { return ended_; }
  /// How it ended; of one under way, "cancelled".
  mbs::Summary summary() const;
  /// Adds an event of its own to the record.
  void tell(const record::Event&);

  const std::vector<mbs::Moment>& moments() const { return moments_; }
  /// Lets every second moment go, and keeps half as many from now on.
  void thin_out();
  std::size_t moment_bytes() const;

  std::function<void(const record::Event&)> on_event;
  std::function<void()> on_frame;

 private:
  LiveRun(std::shared_ptr<const LiveModel>, const RunOptions&, double moment_interval, int);
  bool compute_beginning();
  bool compute_step();
  /// Counts the time of a call that computes.
  bool count_time(bool (LiveRun::*compute)());
  mbs::Options quiet_options() const;
  mbs::Options make_options();
  void note_state();
  void keep_moment();
  void add_frame(const mbs::View&);

  std::shared_ptr<const LiveModel> model_;
  RunOptions options_;
  RunCallbacks callbacks_;
  std::unique_ptr<record::Record> record_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<mbs::Simulation> simulation_;
  std::vector<mbs::Moment> moments_;  // by step; the first is the start
  std::vector<long> frame_steps_;
  std::vector<double> frame_seconds_;
  std::vector<float> zone_path_;
  std::vector<double> cable_force_;
  bool keeps_paths_ = false;
  double moment_interval_;
  double time_ = 0, next_time_ = 0, start_time_ = 0, last_moment_ = 0;
  long steps_ = 0, start_steps_ = 0;
  bool begun_ = false, ended_ = false;
  double seconds_ = 0;  // of calls that are over
  std::optional<std::chrono::steady_clock::time_point> called_;
  mbs::Summary summary_;
};

}  // namespace topple::collapse
