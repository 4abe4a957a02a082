#pragma once
/// The course of a run as every adapter to another engine needs it: start, events, releases, frames, the ledger, the
/// end. The adapter moves the bodies and hands in each state that it has accepted.

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "engines/forces.h"
#include "engines/joint_frames.h"
#include "mbs/crushed_boxes.h"
#include "mbs/model.h"
#include "mbs/sampler.h"
#include "mbs/solver.h"

namespace topple::engines {

/// What a body is now; it changes when an event replaces the body.
struct BodyNow {
  double mass = 0;                 // [kg]
  Vec3 p_BBcm;                     // centre of mass in the model's frame B [m]
  Mat3 inertia;                    // about the centre of mass, axes of B [kg·m²]
  std::vector<mbs::Shape> shapes;  // in the model's frame B
  int replaced = 0;                // how often
};

/// Of the parents on the children at the origins of M, in W (J). Empty: the engine knows none.
struct Reactions {
  std::vector<Vec3> force, moment;  // [N, N·m]
};

/// What the engine has integrated since the start [J].
struct Work {
  double damping = 0;  // taken by dampers
  double loads = 0;    // given by loads
  double contact = 0;  // of contacts on the bodies: what they store and dissipate, with the minus sign
};

/// Contact at an accepted state, for the view.
struct Touch {
  Vec3 on_ground;  // force of what touches the ground on it [N]
  int body_contacts = 0;
};

/// The options without those who watch the run.
mbs::Options make_silent(mbs::Options);
/// The step that the native engine takes: that of the options, or the one it chooses [s].
double choose_step(const mbs::Model&, const mbs::Options&);

class Course {
 public:
  enum class Verdict {
    GoOn,
    ForcesJumped,  // something broke or an event fired: evaluate forces anew
    Rebuild,       // joints or masses have changed: build the system anew from motion()
    Stop           // the end
  };

  /// The model and the options must outlive it.
  Course(const mbs::Model&, const mbs::Options&);

  /// Poses and velocities at the start (of the native engine's equilibrium, if that is asked for) and events at time 0.
  /// False if there is no equilibrium; the summary says so. The engine then builds its system and accepts time 0.
  ///   step              that the engine takes; 0: variable [s]
  ///   ends_on_instants  its steps end on next_stop(), as variable ones do; else the one nearest to an instant counts
  bool start(double step, bool ends_on_instants = false);
  /// The next instant at which a state is wanted: a frame, a sample, an event or the end [s].
  double next_stop() const;
  /// A state that the engine has accepted; the first one at time 0. `find_reactions` is called if they are needed.
  Verdict accept(double time, const Motion&, const Work&, const Touch&,
                 const std::function<Reactions()>& find_reactions);

  /// Ends the run because it cannot go on.
  void fail(const std::string& message);
  /// Something worth a note in the summary; said once.
  void note(const std::string&);
  mbs::Summary finish(long steps);

  const mbs::Model& model() const { return model_; }
  const mbs::Options& options() const { return options_; }
  const Forces& forces() const { return forces_; }
  const Motion& motion() const { return motion_; }
  const std::vector<BodyNow>& bodies() const { return body_; }
  const std::vector<unsigned char>& joint_live() const { return joint_live_; }
  /// Between the origins of a distance joint's frames [m].
  double distance(size_t joint) const { return distance_[joint]; }
  double time() const { return time_; }
  double step() const { return step_; }
  bool is_over() const { return is_over_; }

 private:
  void say(const mbs::Happening&) const;
  bool find_start();
  bool fire_events();
  void act(const mbs::Event&, const mbs::Action&);
  void replace_body(size_t, const mbs::Body&);
  /// Boxes of a body that its elements shorten as they are crushed, and how short they are now.
  void find_crushed_boxes_of(size_t body);
  void shorten_boxes();
  void loosen(size_t joint);
  void release(size_t joint, const char* reason);
  bool check_joints();
  JointFrames frames_of(const mbs::Joint&) const;
  void measure_joints();
  bool is_at_rest();
  bool is_frame_due() const;
  double calc_frame_interval() const { return std::max(options_.frame_interval, step_); }
  double calc_early() const { return ends_on_instants_ ? 1e-12 * (1 + time_) : 0.5 * step_; }
  void show();
  const mbs::View& calc_view();
  Vec3 calc_velocity_of_centre(size_t body) const;
  double calc_kinetic(size_t body) const;
  double calc_gravity(size_t body) const;
  mbs::Energy calc_energy() const;

  const mbs::Model& model_;
  const mbs::Options& options_;
  Forces forces_;
  mbs::Sampler sampler_;
  mbs::Summary summary_;
  mbs::View view_;
  Motion motion_;
  Reactions reactions_;
  Work work_;
  Touch touch_;
  std::vector<BodyNow> body_;
  std::vector<mbs::CrushedBox> crushed_boxes_;
  std::vector<unsigned char> joint_live_;
  std::vector<double> angle_, distance_;  // of joints [rad, m]
  std::vector<size_t> timed_, waiting_;   // events without triggers, by time; and with them
  std::vector<unsigned char> softened_;
  size_t next_event_ = 0;
  double time_ = 0, step_ = 0, last_event_ = 0, quiet_since_ = -1, shown_ = -1;
  long frame_ = 0;
  bool ends_on_instants_ = false, is_started_ = false, is_over_ = false, must_rebuild_ = false,
       needs_reactions_ = false, is_viewed_ = false;
  double removed_ = 0, gravity_at_start_ = 0, total_at_start_ = 0, stored_at_start_ = 0, released_ = 0,
         largest_residual_ = 0;  // [J]
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace topple::engines
