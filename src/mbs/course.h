#pragma once
/// A run from its start to its end as an object that is told of every step: frames, samples, rest, progress, the
/// summary.

#include <chrono>
#include <vector>

#include "mbs/sampler.h"
#include "mbs/system.h"

namespace topple::mbs {

/// What an error of the balance of energy is measured by.
struct EnergyScale {
  double released = 0;   // so far [J]
  double brought = 0;    // at the start, 0 where that is an equilibrium: what is set free of it is released [J]
  double force = 0;      // weight of all that moves, with the loads that have begun [N]
  double round_off = 0;  // what round-off of places makes of the balance [J]
  double step_ways = 0;  // what weight and loads do to bodies at rest in two steps [J]
};

/// What Summary::energy_error says of the largest |residual| [J], for engines that keep books of their own.
double calc_energy_error(double residual, const EnergyScale&);
/// The most that a load is over its table, torques at a metre [N].
double calc_largest_force(const Load&);
/// What round-off of places comes to in so many steps, as a motion of all bodies [J].
double calc_round_off(const Model&, double step, long steps);

/// Why a balance of energy cannot be believed, by the largest error of it (Summary::energy_error); empty if it can.
std::string describe_lost_energy(double error);

/// What a run knows beside the state of its system.
struct CourseState {
  long frame = 0;                   // the next one
  double shown = -1;                // time of the last frame [s]
  std::vector<bool> softened = {};  // elements of which it was told
  double quiet_since = 0;           // of the frames, see Options::pass_speed [s]
  double plastic_then = 0;          // dissipated until then [J]
  bool is_quiet = false;
  double doubted = 0;                // residual of a frame, the least that steps since have read [J]
  int readings = 0;                  // of steps that are still to come, before it counts
  double last_residual = 0;          // of the last frame [J]
  std::vector<double> sampled = {};  // next instants of the samplings, in units of their intervals
  double seconds = 0;                // of the clock, that the run took before [s]
};

class Course {
 public:
  explicit Course(System&);
  /// Goes on in the middle of a run.
  Course(System&, const CourseState&);
  /// The equilibrium if asked for, the forces at the start, and the first frame. False if the run ends here.
  bool begin();
  /// After a step of the system. False if the run has ended.
  bool follow();
  Summary finish();
  double calc_energy_error() const;  // so far, as Summary::energy_error
  CourseState state() const;

 private:
  void show();
  /// Takes the residual of a frame for an error of the balance, or doubts it.
  void judge(const Energy&);
  /// What is left of a doubted residual.
  void read_again();
  double calc_seconds() const;  // of the clock, so far [s]
  bool is_at_rest();
  /// The end has been reached: its frame, and whether the balance of energy can be believed at all. Returns false.
  bool end();
  double calc_weight() const;     // of all that moves [N]
  double calc_step_ways() const;  // EnergyScale::step_ways
  /// What the play of joints in singular positions may make of weight and loads; 0 if there were none [J].
  double calc_singular_play() const;
  /// Looks at a frame for whether nothing happens any more.
  void watch(const View&);
  /// Goes on to the next event if nothing happens until then.
  void pass_quiet();

  System& s_;
  Sampler sampler_;
  CourseState now_;
  double last_event_ = 0, interval_ = 0;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace topple::mbs
