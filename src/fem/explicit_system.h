#pragma once
/// Explicit dynamics of hexahedra: central differences, plasticity, removal of elements, contact, debris, energy ledger
/// (docs/theory/explicit.md). Results do not depend on the number of threads.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "fem/explicit_model.h"

namespace topple::fem {

struct ExplicitOptions {
  /// Steps are this share of the critical one of the worst element, less what bulk viscosity takes. The rest is the
  /// reserve for elements that get shorter.
  double step_share = 0.9;
  /// > 0: elements that would need a smaller step get mass added until they do not [s].
  double scaled_step = 0;
  int threads = 1;                   // 0: all of the machine
  double linear_viscosity = 0.06;    // bulk viscosity in compression, von Neumann & Richtmyer, Landshoff
  double quadratic_viscosity = 1.2;  //
  bool contact = true;               // between surfaces; the ground is always there
  double friction = 0.5;             // between surfaces and debris
  double contact_damping = 0.1;      // of critical, ground too; 0: elastic
  double debris_damping = 0.5;       // the same where debris takes part: rubble does not bounce
  bool debris = true;                // what is crushed or torn stays as particles
  int debris_steps = 0;              // steps of the elements in one of the debris; 0: as many as its springs allow
  double search_margin = 0;          // reach of a contact search [m]; 0: a third of the smallest edge
};

struct RelaxationOptions {
  double tolerance = 1e-3;  // largest out-of-balance force over the load's, both as root of the sum of squares
  int ramp = 200;           // steps in which the loads rise
  int most_steps = 60000;  // elements half as large take twice as many; 7,000 and 15,000 of 0.3 m in a building of 20 m
  double most_settlement = 1;  // what moves farther falls [m]
};
struct RelaxationSummary {
  bool converged = false;
  int steps = 0, stops = 0;  // stops: peaks of the kinetic energy
  double residual = 0;       // out-of-balance over load
  double settlement = 0;     // largest displacement [m]
  std::string text;          // a sentence
};

/// Energies since the start or the last relaxation [J]. Their sum (eq. 25 there) closes but for the error of the step.
struct ExplicitEnergy {
  double kinetic = 0;
  double debris_kinetic = 0;     // of particles, not in `kinetic`
  double gravity = 0;            // potential, of what is left, from the start
  double loads = 0;              // work of nodal forces
  double elastic = 0;            // mean stress and stabilisation, of what is left, and bars
  double elastic_hourglass = 0;  // the share of `elastic` in the stabilisation, i.e. bending inside elements
  double corner_hourglass = 0;   // the share of `elastic` in modes that no beam theory knows (ξηζ)
  double plastic = 0;            // dissipated by the mean stress, and by bars
  double plastic_hourglass = 0;  // dissipated by stresses that vary over an element (bending)
  double plastic_corner = 0;     // the share of it in the mode ξηζ
  double bulk_viscosity = 0;     //
  double contact_elastic = 0;    // in penalty springs
  double contact_damping = 0;    //
  double friction = 0;           //
  double removed_internal = 0;   // elastic energy that went with elements
  double removed_kinetic = 0;    // of masses taken away, and of what debris loses when an element becomes particles
  double removed_gravity = 0;    // potential of masses taken away, from the start
  double start = 0;              // sum at the start
  double sum() const {
    return kinetic + debris_kinetic + gravity - loads + elastic + plastic + plastic_hourglass + bulk_viscosity +
           contact_elastic + contact_damping + friction + removed_internal + removed_kinetic + removed_gravity;
  }
  double residual() const { return sum() - start; }
};

enum class RemovalCause : std::uint32_t { Charge, Tension, Compression, Degenerate };
struct Removal {
  double time = 0;  // [s]
  int element = 0;
  RemovalCause cause = RemovalCause::Charge;
  double mass = 0;      // of the element [kg]
  double internal = 0;  // elastic energy that went [J]
};

/// A piece of what was an element, without rotation.
struct DebrisParticle {
  Vec3 p, v;          // [m], [m/s]
  double mass = 0;    // [kg]
  double radius = 0;  // grows from the inscribed one to that of equal volume as room permits [m]
  double full_radius = 0;
  int element = 0;  // that it was
};

/// What a step may have of the critical one of elements without viscosity (docs/theory/explicit.md, eq. 16).
double calc_step_share(const ExplicitOptions&);

enum class ExplicitEnding { ReachedTime, Cancelled, Diverged };

class ExplicitSystem {
 public:
  /// Throws InputError, see check_explicit_model.
  ExplicitSystem(const ExplicitModel&, const ExplicitOptions&);
  ~ExplicitSystem();
  ExplicitSystem(ExplicitSystem&&) noexcept;
  ExplicitSystem& operator=(ExplicitSystem&&) noexcept;

  double time() const;  // of positions; velocities are half a step older [s]
  double step() const;  // [s]
  long long steps() const;
  /// Mass that mass scaling added, and the number of elements concerned [kg].
  double added_mass() const;
  double added_mass(int element) const;
  int scaled_elements() const;

  /// Dead load into equilibrium without motion, by pseudo-dynamic relaxation (eq. 20); time stays, velocities are 0
  /// after.
  [[nodiscard]] RelaxationSummary relax(const RelaxationOptions&, const Progress& = {});

  /// Steps until the time is reached (to within half a step). Reports simulated time.
  [[nodiscard]] ExplicitEnding advance(double until, const Progress& = {});

  /// Takes elements away, with mass and energy; nothing stays of them. Those already gone are passed over.
  void remove(std::span<const int> elements);
  /// Begins one of the model's releases, which goes on by itself; one that has begun is passed over.
  void release(int number);

  /// Velocities of nodes (nodes) [m/s].
  void set_velocities(std::span<const Vec3>);
  void set_velocity(const Vec3&);

  // By the model's numbers.
  Vec3 p(int node) const;
  Vec3 v(int node) const;
  double node_mass(int node) const;  // 0 once all its elements are gone [kg]
  bool is_alive(int element) const;
  double plastic_strain(int element) const;
  double damage(int element) const;                 // 1: removed
  std::array<double, 6> stress(int element) const;  // mean, xx yy zz xy yz zx, positive in tension [Pa]
  void copy_positions(std::vector<Vec3>&) const;    // (nodes)
  bool bears(int bar) const;                        // from its release until it tears or loses an end
  Vec3 bar_force_of_ground(int bar) const;          // at its held end [N]

  const std::vector<Removal>& removals() const;       // in the order of time, then of elements
  const std::vector<DebrisParticle>& debris() const;  // never removed

  ExplicitEnergy calc_energy() const;
  /// By part; (largest part + 1).
  struct PartSummary {
    int alive = 0, removed = 0;
    double plastic_strain = 0;  // mean over the elements left
    double largest_plastic_strain = 0;
  };
  std::vector<PartSummary> calc_parts() const;
  /// Force on a ground of everything that touches it, at the last step; downwards where it carries [N].
  Vec3 ground_force(int ground) const;
  /// The same by its touching nodes: whether a node pressed on any ground at the last step.
  bool touches_ground(int node) const;
  /// First time at which a node of each part pressed on a ground, or a piece of its debris once that outweighs its
  /// elements; negative: never (largest part + 1).
  const std::vector<double>& touchdowns() const;
  int contacts() const;        // points that press on segments or debris at the last step
  double calc_mass() const;    // of what is left, debris included [kg]
  Vec3 calc_momentum() const;  // [kg m/s]
  Vec3 calc_centre_of_mass() const;

  /// Force and moment about `about` that elements exert on nodes (a section: elements of one side, nodes of the
  /// interface).
  struct Resultant {
    Vec3 force, moment;  // [N], [N·m]
  };
  Resultant calc_resultant(std::span<const int> elements, std::span<const int> nodes, const Vec3& about) const;

  /// What a snapshot holds: everything that changes. Going on from it on the same model, options and machine gives the
  /// same bits as without interruption. read throws InputError if the bytes are not of this model.
  std::vector<std::byte> write_snapshot() const;
  void read_snapshot(std::span<const std::byte>);

  struct Timing {
    double kernel = 0, boundary = 0, contact = 0, search = 0;  // [s] of the clock
    long long searches = 0;
  };
  const Timing& timing() const;
  std::string instruction_set() const;

  struct Inside;  // for this module

 private:
  std::unique_ptr<Inside> inside_;
};

}  // namespace topple::fem
