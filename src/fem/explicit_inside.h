#pragma once
/// What an ExplicitSystem is made of: the constant arrangement, and the state that a snapshot holds.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "base/team.h"
#include "fem/contact_lanes.h"
#include "fem/contact_search.h"
#include "fem/explicit_chunks.h"
#include "fem/explicit_kernel.h"
#include "fem/explicit_system.h"
#include "fem/particle.h"

namespace topple::fem {

inline Vec3 vector_at(const double* r) { return {r[0], r[1], r[2]}; }

/// A point pressed on something rigid, with what its work is booked by.
struct GroundTouch {
  std::uint32_t row = 0;  // of a node, or number of a particle
  std::int32_t ground = 0;
  Vec3 normal_force, friction;
  double stored = 0;  // in the spring [J]
  Vec3 before;        // velocity half a step before
};

/// Of a share of the particles.
struct GroundShare {
  std::vector<GroundTouch> touches;
  std::vector<Vec3> forces;  // (grounds)
  TouchSums sums;
};

/// Work of contact so far, and what is in the springs now [J].
struct ContactWork {
  double normal = 0, friction = 0, stored = 0;
};

/// What debris exerts on a node from its forces to its next ones.
struct HeldPush {
  Vec3 normal_force, friction;         // [N]
  std::uint32_t row = 0, padding = 0;  // whose bytes snapshots hold
};

/// What an ExplicitBar has come through.
struct BarState {
  double length = 0;       // as it began [m]
  double stretched = 0;    // plastic elongation [m]
  double bent = 0;         // how much of its shortening stays, not positive [m]
  double force = 0;        // positive pulled [N]
  Vec3 pull, before;       // force on its end b [N]; speed of b against a half a step before [m/s]
  std::int64_t phase = 0;  // 0 not yet, 1 bears, 2 gone
};
/// How far an ExplicitRelease is.
struct ReleaseState {
  std::int64_t begun = -1;  // step; negative: not yet
  std::int64_t is_over = 0;
};

/// A touch of the step; forces on the point [N].
struct FaceTouch {
  Vec3 normal_force, friction;
  double weights[4] = {0, 0, 0, 0};  // of the face's corners
  double crushed = 0;                // of a particle [m]
  std::array<std::uint32_t, 4> rows{};
  ContactPoint point;
};
/// What a task has of near candidates and what touches.
struct ContactTask {
  bool is_debris = false;  // its touches are those of debris
  std::uint64_t look = 0;  // that candidates are of
  lanes::Faces faces;
  std::vector<ContactPoint> points;  // of faces
  std::vector<lanes::Touch> found;
  std::vector<FaceTouch> faces_touched;
  std::vector<ParticlePair> particles;  // that touch
  std::vector<ParticleTouch> particles_touched;
  TouchSums sums;
};

struct ExplicitState {
  long long steps = 0;
  bool begins = true;                   // speeds have been set: what they strained before does not count
  AlignedVector<double> rows;           // kNodeFields a node
  AlignedVector<double> elements;       // kElementFields x W a block
  AlignedVector<double> cracks;         // 3 x W a block
  std::vector<unsigned char> live;      // lanes of a block
  std::vector<std::uint8_t> flags;      // of rows
  AlignedVector<double> pushes;         // 4 a row, zero where not flagged
  std::vector<std::uint32_t> pushed;    // rows that contact has flagged
  std::vector<std::uint32_t> grounded;  // rows below a ground
  std::vector<std::uint16_t> uses;      // live elements of a row's node
  std::array<double, 4> sums{};         // dissipated, see kernel::ChunkJob
  AlignedVector<Particle> particles;
  std::vector<ParticlePush> particle_pushes;
  std::vector<ParticleMake> particle_makes;
  std::vector<GroundTouch> touches;  // of nodes
  TouchSums ground_touching;         // of particles, as ContactState::debris
  ContactWork ground_work, surface_work;
  std::vector<HeldPush> held;  // what debris exerts on nodes until its next forces
  ContactWork held_work;       // of it, not in surface_work; half of the first and of the last of its steps at a time
  ContactState contact;
  std::vector<Vec3> ground_forces, debris_forces;  // on grounds: of all, of particles at their last forces
  std::vector<double> touchdowns;                  // by part
  std::vector<double> whole_mass, debris_mass;     // of elements left, of particles; by part [kg]
  double removed_internal = 0, removed_kinetic = 0, removed_gravity = 0;
  std::vector<Removal> removals;
  std::vector<BarState> bars;
  std::vector<ReleaseState> releases;
  double bar_work = 0;  // of bars on nodes so far [J]
};

struct ExplicitSystem::Inside {
  ExplicitModel model;
  ExplicitOptions options;
  ExplicitChunks chunks;
  ContactSetup contact;
  std::vector<kernel::Law> laws, first_laws;  // now, and before any release
  std::vector<std::array<std::uint32_t, 8>> rows_of_element;
  std::vector<double> element_mass, element_volume;  // at the start
  std::vector<int> first_part_of_row;                // lowest part at a node
  AlignedVector<double> loads;                       // constant forces, 4 a row
  std::vector<std::uint32_t> loaded;                 // rows with such
  double h = 0, added_mass = 0;
  int debris_steps = 1;  // of h in a step of the debris
  int scaled_elements = 0, parts = 0;

  ExplicitState s;
  std::vector<Vec3> start;  // places from which potentials count (rows)
  double start_energy = 0;
  bool started = false;
  std::unique_ptr<Team> team;
  // room for a step
  AlignedVector<double> shared_forces;
  std::vector<std::vector<std::uint32_t>> failed, grounded;
  std::vector<std::array<double, 4>> chunk_sums;
  std::vector<kernel::Balance> balances;  // of chunks, then of shares of the shared nodes
  std::vector<ContactTask> contact_room;
  std::span<ContactTask> contact_tasks;   // of the step, in that room
  std::vector<std::uint32_t> held_place;  // of rows; 0: none (rows)
  ContactFaces contact_faces;             // of the last look
  mutable std::vector<GroundShare> ground_shares;
  ExplicitState spare;  // kept, so that copies need no new memory
  Timing timing;
  mutable std::vector<DebrisParticle> debris_view;

  Inside(const ExplicitModel&, const ExplicitOptions&);
  const double* row(const ExplicitState& state, int node) const {
    return state.rows.data() + 8 * static_cast<size_t>(chunks.row_of_node[static_cast<size_t>(node)]);
  }
  double* element_block(ExplicitState& state, int element, size_t& lane) const;
  const double* element_block(const ExplicitState& state, int element, size_t& lane) const;
  std::array<Vec3, 8> corners(const ExplicitState&, int element) const;

  kernel::StepJob make_step() const;
  /// Internal forces and motion of all nodes; fills failed, grounded, chunk_sums and balances.
  void advance_nodes(const kernel::StepJob&, ExplicitState&);
  /// One step of everything; `removes`: failed elements go.
  void advance_step(ExplicitState&, bool removes);
  void remove_element(ExplicitState&, int element, RemovalCause) const;
  /// Books what debris has done to a node that goes, and returns the impulse that it does not get any more [N s].
  Vec3 end_held(ExplicitState&, std::uint32_t row) const;
  void add_debris(ExplicitState&, int element, const std::array<Vec3, 8>& v) const;
  /// Whether forces of debris act in the step that is to come: impulses of debris_steps times as long.
  bool pushes_debris(const ExplicitState& state) const { return state.steps % debris_steps == 0; }
  double debris_step() const { return debris_steps * h; }
  /// Particles stand where they will be at their next forces, by so much time ahead [s].
  double calc_lead(const ExplicitState& state) const {
    return static_cast<double>((debris_steps - state.steps % debris_steps) % debris_steps) * h;
  }
  /// Takes away what releases have let go of.
  void end_releases(ExplicitState&);
  /// Laws of what is about to go, and of what a release that is over has damaged; all as a state has them.
  void fade_laws(const ExplicitState&);
  void weaken_laws(size_t release);
  void restore_laws(const ExplicitState&);
  void press_bars(ExplicitState&) const;
  /// Place or speed of a bar's end, by field.
  Vec3 calc_end(const ExplicitState&, const ExplicitBar::End&, int field) const;
  void book_bars(ExplicitState&) const;
  /// The ledger of bars begins anew.
  void restart_bars(ExplicitState&) const;
  void press_grounds(ExplicitState&, bool debris) const;
  void book_grounds(ExplicitState&, bool debris) const;
  void move_particles(ExplicitState&) const;
  /// Calls body(share, first, last) for shares of the particles, the same for any number of threads.
  template <class Body>
  void for_particles(const ExplicitState& state, const Body& body) const {
    const size_t count = state.particles.size(), shares = particle_shares(state);
    team->run(shares, [&](size_t share) { body(share, count * share / shares, count * (share + 1) / shares); });
  }
  static size_t particle_shares(const ExplicitState& state) {
    return std::clamp<size_t>(state.particles.size() / 256, 1, 16);
  }
  void push(ExplicitState& state, std::uint32_t row, const Vec3& force) const { push(state, row, force, state.pushed); }
  void push_load(ExplicitState& state, std::uint32_t row) const {
    const double* load = loads.data() + 4 * size_t{row};
    push(state, row, {load[0], load[1], load[2]});
  }
  /// `pushed` gets rows that are pushed for the first time in this step.
  void push(ExplicitState& state, std::uint32_t row, const Vec3& force, std::vector<std::uint32_t>& pushed) const {
    if ((state.flags[row] & kernel::kPushed) == 0) {
      state.flags[row] |= kernel::kPushed;
      pushed.push_back(row);
    }
    for (int c = 0; c < 3; ++c) state.pushes[4 * size_t{row} + static_cast<size_t>(c)] += force[c];
  }
  void clear_pushes(ExplicitState&) const;
  /// Whether all of the nodes' rows is finite.
  bool is_finite(const ExplicitState&) const;
  /// Elastic energy of an element: in all, in what varies over it, in the corner mode [J].
  std::array<double, 3> calc_elastic(const ExplicitState&, int element) const;
  ExplicitEnergy calc_energy();
};

}  // namespace topple::fem
