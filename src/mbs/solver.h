#pragma once
/// The native engine: equilibrium under dead load (implicit), then explicit steps through the events to the end.
/// Constant model, separate state, memory allocated before the loop (docs/theory/multibody.md).

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.h"
#include "mbs/model.h"

namespace topple::mbs {

/// Energies since the start [J]. Balance: kinetic + gravity + elastic + contact + plastic + damping + friction
/// + contact_loss + removed - loads = the value at the start, up to `residual`.
struct Energy {
  double kinetic = 0;
  double gravity = 0;       // potential, 0 at the start
  double elastic = 0;       // stored in elements and cables
  double contact = 0;       // stored in contacts
  double plastic = 0;       // dissipated in zones, breaking included
  double damping = 0;       // dissipated by dampers
  double friction = 0;      // dissipated in contacts by sliding
  double contact_loss = 0;  // dissipated in contacts by impact
  double removed = 0;       // taken away with removed mass and released elements
  double loads = 0;         // work that loads have done on the bodies
  double residual = 0;      // what the balance lacks: the integration error
  double released = 0;      // energy of weight, loads and springs set free so far, the reference of the residual
};

enum class ElementState : std::uint8_t { Elastic, Yielded, Softening, Broken, Removed };

/// Read-only view of the running system, valid during a callback.
struct View {
  double time = 0;
  std::vector<Pose> X_WB;
  std::vector<Vec3> centre;                    // of mass, in W; the origin of B until an event replaces the body [m]
  std::vector<Vec3> v_WB, w_WB;                // of the centre of mass, of the body; in W
  std::vector<double> mass;                    // current [kg]
  std::vector<ElementState> element_state;     // zone elements, then rotational elements
  std::vector<double> utilisation;             // largest demand over capacity, same order
  std::vector<double> rotation;                // largest plastic rotation, same order [rad]
  std::vector<double> shortening;              // plastic shortening, same order [m]
  std::vector<std::array<double, 2>> crushed;  // of members, from their far ends on a and b [m]; zone elements only
  std::vector<Vec3> element_force, element_moment;  // of a on b, in the element's axes; zone elements only
  std::vector<Vec3> joint_force, joint_moment;      // reaction of the parent on the child, in F
  std::vector<double> joint_angle;                  // of revolute and cylindrical joints, else 0 [rad]
  std::vector<double> joint_displacement;           // of prismatic and cylindrical joints, else 0 [m]
  std::vector<bool> joint_released;
  std::vector<Vec3> element_translation, element_rotation;  // deformation in its axes; zone elements only [m, rad]
  // of rotational elements, whatever has taken over from their joints; the normal force is that of their limits
  std::vector<double> hinge_rotation, hinge_moment, hinge_normal;  // [rad, N·m about Fz on the child, N pull positive]
  std::vector<double> cable_length, cable_force;                   // [m, N]
  std::vector<double> spring_length, spring_force;                 // [m, N]
  std::vector<double> torsion_angle, torsion_torque;               // of rotational springs [rad, N·m]
  std::vector<Vec3> bushing_translation, bushing_rotation, bushing_force, bushing_moment;  // force of a on b, in F
  Vec3 ground_force;          // of the ground on everything: contact, elements, joints and cables tied to it [N]
  Vec3 contact_force_ground;  // the part by contact [N]
  int body_contacts = 0;      // touching points between bodies
  Energy energy;
};

/// Something that happened between two frames.
/// What a body brings to the ground when it touches it first: velocities half a step before.
struct Landing {
  Vec3 p_WB{};          // of its mass centre [m]
  double energy = 0;    // kinetic, of the body alone [J]
  double momentum = 0;  // of the body alone, against the ground's normal [N·s]
  double kinetic = 0;   // kinetic energy of all bodies [J]
};

struct Happening {
  enum class Kind {
    EventFired,
    ElementYielded,
    ElementSoftening,
    ElementBroken,
    JointReleased,
    CableBroken,
    SpringBroken,  // spring-damper
    RotationalSpringBroken,
    BushingBroken,
    GroundContact,
    BodyContact
  };
  Kind kind = Kind::EventFired;
  double time = 0;
  int index = -1;      // event, element (zone elements, then rotational), joint, cable, spring, bushing or body
  int other = -1;      // second body of a BodyContact
  std::string reason;  // of a break: "tension", "crushing", "shear", "rotation", "torsion"
  double speed = 0;    // of a first contact, normal approach [m/s]
  Landing landing{};   // of a GroundContact
};

/// Who wants to look at the running system at a rate of its own. The course of the run does not depend on it.
struct Sampling {
  double interval = 0.01;  // > 0; the first at time 0, then at the step nearest to each instant [s]
  std::function<void(const View&)> on_sample;
};

struct Moment;  // mbs/moment.h

/// A run that would take more steps is refused: no model that means anything needs so many.
inline constexpr double kMostSteps = 1e9;

struct Options {
  double duration = 1;  // [s]
  double step = 0;      // 0: step_safety times the limit of the stiffest mode; else duration / kMostSteps to duration
  double step_safety = 0.9;
  /// The engine's own step lets no free body turn by more than this at its present rate [rad] when it is chosen, and is
  /// chosen anew where one turns by four times as much; and there are at least so many in the duration; 0: it does not
  /// ask.
  double most_turn = 0;
  int least_steps = 0;
  double step_share = 1;  // of the engine's own step, for studies of convergence; without effect on a set step
  /// Every zone is asked by its full law at each step, none in lanes: slow, to check what lanes make of them.
  bool full_law = false;
  /// Steps from one look for touching points to the next; between them the points move with their bodies. 0: 2 where a
  /// contact swings slowly enough and the step is the engine's own, else 1.
  int contact_interval = 0;
  /// Bodies that contact did not keep apart, or that overlap at the start, are told in the summary's notes.
  bool tells_lost_contact = false;
  double frame_interval = 1.0 / 60;  // of on_frame [s]; whole steps, the nearest at or after each instant
  bool equilibrium = true;           // start from the dead-load equilibrium; false: from the poses of the model
  /// Stop when, after the last event and for rest_time, the speed that stands for the kinetic energy per mass is below
  /// this and no centre of mass is faster than 25 times this; 0: never [m/s].
  double rest_speed = 0;
  double rest_time = 0.5;  // [s]
  /// The run goes on at once to the last step before the next event, without the time between, when in all frames of
  /// the last pass_time the speed that stands for the kinetic energy per mass was below this and zones have dissipated
  /// less than pass_share of the released energy; 0: never. Not where loads follow the time [m/s].
  double pass_speed = 0;
  double pass_time = 0.25;   // [s]
  double pass_share = 1e-4;  // [-]
  int threads = 1;           // used from 2,048 zone elements on; results do not depend on it
  /// Of run() alone: is told of the place that the run has come to, so often by the clock and where it is cancelled;
  /// and the place from which it goes on, with the same bits as if it had not been interrupted. It must outlive the
  /// run.
  std::function<void(const Moment&)> on_moment;
  double moment_interval = 60;  // [s]
  const Moment* from = nullptr;
  std::function<void(const View&)> on_frame;
  std::function<void(const Happening&)> on_happening;
  std::vector<Sampling> samplings;
  Progress progress;
};

/// An element that the dead load asks more of than it can bear.
struct Overload {
  size_t element = 0;  // index into Model::elements
  double used = 0;     // of its capacity, as if it had no limits; more than 1
};

struct Summary {
  enum class Ending { TimeLimit, AtRest, Cancelled, NoEquilibrium, Diverged };
  Ending ending = Ending::TimeLimit;
  std::string message;       // a sentence with numbers
  double time = 0;           // reached [s]
  double step = 0;           // at the start [s]
  double shortest_step = 0;  // on the way; the step follows the live model unless Options::step is set [s]
  double step_needed = 0;    // least that the fastest mode on the way asked of a set step, 0: no less than it is [s]
  long steps = 0;
  double highest_frequency = 0;  // largest of the elastic system on the way [rad/s]
  int equilibrium_iterations = 0;
  double equilibrium_residual = 0;  // largest unbalanced force over the weight
  std::vector<Overload> overloads;  // where there is no equilibrium, the largest first; empty if nothing is known
  /// Largest |residual| over the potential energy released, or the energy there was at the start if that is more; both
  /// at least what moves everything by a micrometre against weight and loads. What round-off makes of it is no error.
  double energy_error = 0;
  double joint_drift = 0;          // largest violation of a joint [m, rad]
  std::vector<std::string> notes;  // redundant constraints, singular positions: what was done about them
  double wall_time = 0;            // of the stepping [s]
};

/// Runs the model from its start to its end. Throws InputError if check_model does, and for a set step
/// that is too short; everything else is in the summary.
Summary run(const Model&, const Options&);

class System;  // compiled model and state
class Course;
struct SystemDeleter {
  void operator()(System*) const;
  void operator()(Course*) const;
};

/// A stepping handle for those who steer: run() is made of these.
class Simulation {
 public:
  /// Compiles the model. Throws InputError.
  Simulation(const Model&, const Options&);
  /// Goes on from a moment of a run.
  ///   is_successor  of another model, which this one succeeds: bodies, joints, elements, springs, bushings and loads
  ///   are
  ///                 the same; laws and cables may be added at the end; other laws of elements, friction, and events
  ///                 that have not fired may have changed. Unchanged elements keep their state to the bit.
  /// Throws InputError E625 if the model does not fit the moment.
  Simulation(const Model&, const Options&, const Moment&, bool is_successor = false);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  /// A run with its frames, happenings and end, as run() makes it: the start; false if it ends here.
  bool begin();
  /// One step of that run; false if it has ended.
  bool advance();
  /// How it ended, or stands now.
  Summary finish();
  /// A place to go on from: the same bits follow.
  Moment keep() const;
  long steps() const;
  /// Simulated time of the next step [s].
  double next_time() const;

  /// Solves for the dead-load equilibrium; false with `message` if there is none.
  bool find_equilibrium(std::string& message);
  /// Advances by one step; false if the state is no longer finite.
  bool advance_step();
  double time() const;
  double step() const;
  const View& calc_view();
  /// Everything that changes in time; restoring it on the same model gives the same bits as going on.
  std::vector<std::byte> snapshot() const;
  void restore(const std::vector<std::byte>&);
  Summary summary() const;

 private:
  std::unique_ptr<System, SystemDeleter> system_;
  std::unique_ptr<Course, SystemDeleter> course_;  // of begin(), or of a moment
};

}  // namespace topple::mbs
