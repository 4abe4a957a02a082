#pragma once
/// The force elements, cables and loads of a model for engines that only move bodies: forces at trial states, and a
/// history that goes on at accepted states alone. The laws are those of docs/theory (zones.md; multibody.md, eq. 4),
/// the code is not the native engine's but for the law of a zone itself.

#include <functional>
#include <vector>

#include "mbs/model.h"
#include "mbs/solver.h"
#include "mbs/zone.h"

namespace topple::engines {

/// Where all bodies are and how they move: of the frame B of the model, wherever the centre of mass has gone. B bodies;
/// fixed ones are at their places, at rest.
struct Motion {
  std::vector<Pose> X_WB;
  std::vector<Vec3> v_WB, w_WB;  // of B's origin, of B; in W [m/s, rad/s]
};

/// On a body, about the origin of its frame B, in W.
struct Wrench {
  Vec3 force, torque;  // [N, N·m]
};

/// What dampers take and loads give [W].
struct Power {
  double damping = 0, loads = 0;
};

/// Energies in and spent by force elements [J]; dampers of zones are in `damping`, others are not (Power).
struct ElementEnergy {
  double elastic = 0, plastic = 0, damping = 0, removed = 0;
};

double calc_characteristic(const mbs::Characteristic&, double x);
/// Its integral from 0 to x.
double calc_potential(const mbs::Characteristic&, double x);

class Forces {
 public:
  using Say = std::function<void(const mbs::Happening&)>;
  /// The model must outlive it.
  Forces(const mbs::Model&, Say);

  /// First evaluation, at time 0: nothing has a history.
  void start(const Motion&);
  /// Forces at a trial state not before the last accepted one, as the history was there. No zone ruptures before the
  /// state is accepted; until then it flows at its limits.
  void calc(double time, const Motion&, std::vector<Wrench>& on_body) const;
  Power calc_power(double time, const Motion&) const;
  /// Accepts a state: history goes on, what passes its strength breaks. True if a force has jumped.
  ///   joint_force  reactions in F, for rotational elements; empty: what they were (J)
  bool advance(double time, const Motion&, const std::vector<Vec3>& joint_force);
  /// Forces at the accepted state anew, after events.
  void renew(double time, const Motion&);

  // Events; they count from the next evaluation on.
  void remove_element(const mbs::Action&);
  void switch_law(const mbs::Action&, double time);
  /// Whether the joint's rotational element holds no longer; false if it has none.
  bool has_broken_hinge(size_t joint) const;
  /// Lets the joint's rotational element take over with what the joint bears; false if it has none that holds.
  ///   force, moment  on the child, in F [N, N·m]
  bool loosen_joint(size_t joint, const Vec3& force, const Vec3& moment, double time);
  /// Whether it has, and still holds.
  bool is_loose(size_t joint) const { return find_loose(joint) != nullptr; }
  /// Force and moment that this element puts on the parent at the last accepted state, in F; null: there is none
  /// [N, N·m].
  const mbs::Six* find_loose(size_t joint) const;
  void release_joint(size_t, double time);
  void release_cable(size_t);
  void remove_spring(size_t);
  void remove_rotational_spring(size_t);
  void remove_bushing(size_t);
  void remove_load(size_t);
  void apply_load(size_t, double time);
  bool has_begun(size_t load) const { return load_[load].has_begun; }
  /// The next time at which a load's table has a corner; infinite behind the last [s].
  double next_corner(double time) const;
  /// When the last table ends of loads that act; 0 without any [s].
  double calc_last_load_change() const;

  ElementEnergy calc_energy() const;
  /// What the view shows of elements, cables, springs and bushings at the last accepted state.
  void fill(double time, const Motion&, mbs::View&) const;
  /// Of the ground and fixed bodies on everything, through elements, at the last accepted state [N].
  Vec3 ground_force() const { return -1 * on_ground_; }
  bool needs_joint_forces() const { return !rotational_.empty(); }
  /// Whether dampers outside zones or loads take part in the balance of energy.
  bool has_power() const { return has_power_; }
  /// By how much crushing has shortened an element that is still there [m].
  double crushed_length(size_t element) const;
  /// Whether an element, a bushing is still there.
  bool is_live(size_t element) const { return zone_[element].state.live; }
  bool is_bushing_live(size_t bushing) const { return bushing_[bushing].live; }
  /// Whether calc() depends on velocities.
  bool depends_on_velocity() const { return depends_on_velocity_; }

 private:
  /// Ends a joint's rotational springs.
  void end_torsions(size_t joint, double time);
  struct Zone {
    mbs::ZoneParameters parameters;
    mbs::ZoneState state;
    double angle = 0;          // of a rotational element's joint, accepted [rad]
    double axial_force = 0;    // of a rotational element's joint, accepted; tension positive [N]
    bool is_loose = false;     // a rotational element that has taken over from its joint
    bool is_released = false;  // one whose joint is gone
  };
  struct Spring {
    bool live = true;
    double stored = 0;  // at the last accepted state [J]
  };
  struct Torsion : Spring {
    double angle = 0;  // of the joint, accepted [rad]
  };
  struct Rope : Spring {
    double rest_length = 0;
  };
  struct Held : Spring {
    Vec3 turn;  // rotation vector at the last accepted state; it may pass π [rad]
  };
  struct Applied {
    bool has_begun = true, is_over = false;
    double begin = 0;  // [s]
  };
  struct Six {
    mbs::Six deformation;
    Vec3 p_M;
    Mat3 R_WF;
    Vec3 r;
  };

  Zone& zone_of(const mbs::Action&);
  void evaluate(double time, const Motion&, std::vector<Wrench>& on_body) const;
  void prepare(mbs::ZoneParameters&, double h) const;
  Pose pose_of(const Motion&, mbs::BodyId) const;
  Vec3 velocity_at(const Motion&, mbs::BodyId, const Vec3& p_W) const;
  Six calc_six(const Motion&, mbs::BodyId a, const Pose& X_AF, mbs::BodyId b, const Pose& X_BM, const Vec3& near) const;
  mbs::Six calc_rates(const Motion&, mbs::BodyId a, mbs::BodyId b, const Six&) const;
  double angle_of(const Motion&, mbs::JointId, double previous) const;
  Vec3 axis_of(const Motion&, mbs::JointId) const;
  double angle_rate_of(const Motion&, mbs::JointId) const;
  double factor_of(size_t load, double time) const;

  void push(const Motion&, mbs::BodyId, const Vec3& p_W, const Vec3& force, std::vector<Wrench>&) const;
  void twist(mbs::BodyId, const Vec3& torque, std::vector<Wrench>&) const;
  mbs::ElementGeometry measure_zone(const Zone&, const Motion&, mbs::BodyId a, const Pose& X_AF, mbs::BodyId b,
                                    const Pose& X_BM) const;
  void push_zone_forces(const Motion&, mbs::BodyId a, mbs::BodyId b, const mbs::ElementGeometry&,
                        const mbs::Six& resultant, std::vector<Wrench>&) const;
  void push_six(const Motion&, mbs::BodyId a, mbs::BodyId b, const Six&, const double resultant[6],
                std::vector<Wrench>&) const;
  void push_others(double time, const Motion&, std::vector<Wrench>&) const;
  bool break_others(double time, const Motion&);
  void fill_zone(size_t at, double time, const Zone&, mbs::View&) const;

  const mbs::Model& model_;
  Say say_;
  mbs::CompiledLaws laws_, lasting_laws_;  // as they are; without rupture, for trial states
  std::vector<Zone> zone_, rotational_;
  std::vector<Spring> spring_;
  std::vector<Held> bushing_;
  std::vector<Torsion> torsion_;
  std::vector<Rope> rope_;
  std::vector<Applied> load_;
  double plastic_ = 0, removed_ = 0;  // of what is not a zone [J]
  double accepted_ = 0;               // time [s]
  bool has_power_ = false, depends_on_velocity_ = false;
  mutable Vec3 on_ground_;
  // the last evaluation, and what it was of
  mutable bool is_cached_ = false;
  mutable double cached_time_ = 0;
  mutable Motion cached_motion_;
  mutable std::vector<Wrench> cached_;
};

}  // namespace topple::engines
