#pragma once
/// What the kernel works on: bodies and elements in blocks of lanes, of one run or of a batch of samples.

#include <cstdint>
#include <vector>

#include "base/aligned.h"
#include "mbs/joint_kernel.h"
#include "mbs/kernel.h"
#include "mbs/lane_array.h"

namespace topple::mbs {

/// Joints that share no moving body with others. A run packs them by kind; in a batch block j is joint j.
struct Pairs {
  size_t blocks = 0;
  std::vector<kernel::PairKind> kind;        // of each block
  std::vector<unsigned char> straight;       // as of the job
  std::vector<std::uint32_t> parent, child;  // slots of bodies (W a block)
  std::vector<std::uint32_t> joint;          // of each slot
  AlignedVector<double> constants, states;
  std::vector<std::uint32_t> unfit, over;  // reports of the kernel
};

struct Lanes {
  size_t W = 1;
  bool is_batch = false;
  bool is_planar = false;      // bodies keep to y = const and turn about y alone
  bool sums_in_plane = false;  // batch: forces of elements across y = const are left out, as Model::is_planar asks
  size_t body_blocks = 0, element_blocks = 0;
  // bodies, the ground behind the last one
  AlignedVector<double> p, v, L, w, q, R, force, torque, joint_force, joint_torque, body_constants;
  AlignedVector<double> poses;        // a row for each body, as lay_poses() left them; one run
  AlignedVector<double> bounds, low;  // boxes around the shapes in B, and how low they reach (kernel::LowJob)
  AlignedVector<double> reach, way;   // radius of a body's shapes, and its farthest point's way in a step (WayJob)
  AlignedVector<double> ground_states, ground_constants, watch;  // boxes on the ground (kernel::GroundJob)
  Pairs pairs;
  // elements
  AlignedVector<double> states, flows, element_forces;
  AlignedVector<double> pool;                 // lane vectors of constants, shared by blocks
  std::vector<std::uint32_t> constants;       // of each block, in the pool (kConstants)
  std::vector<std::uint32_t> uses;            // of each vector of the pool
  size_t shared = 0;                          // vectors when they were last shared
  std::vector<unsigned char> live, softened;  // lanes of each block
  std::vector<kernel::Plane> planes;          // of each block
  std::vector<unsigned char> single;          // of each block: as of the job
  // one run: slots of elements (several may be gone), bodies of slots; elements meeting in each body
  std::vector<std::uint32_t> slot_of, element_of, body_a, body_b;  // batch: bodies of each block
  std::vector<std::uint32_t> first_entry, entries;                 // 2 * slot (batch: block) + side
  bool has_dead_entries = false;                                   // batch: blocks have died
  size_t live_elements = 0, used_slots = 0;                        // one run
  // one value a lane
  AlignedVector<double> kick, h, gx, gy, gz, sum;
  AlignedVector<double> nx, ny, nz, offset;            // of the ground
  AlignedVector<double> search_x, search_y, search_z;  // State::search_velocity
  // reports of the kernel
  std::vector<std::uint32_t> outside, cracked, spins, landed;

  static constexpr std::uint32_t kNoSlot = 0xffffffff;

  LaneLayout body_layout(size_t lane) const;
  /// Field f of a slot; a slot is block * W + lane.
  double field(size_t slot, int f) const {
    return f < kernel::kStateFields ? states[state_at(slot, f)]
                                    : pool[size_t{constants[constant_at(slot, f)]} * W + slot % W];
  }
  void set_state(size_t slot, int f, double x) { states[state_at(slot, f)] = x; }
  void set(size_t slot, int f, double x) {
    if (f < kernel::kStateFields)
      set_state(slot, f, x);
    else if (pool[size_t{constants[constant_at(slot, f)]} * W + slot % W] != x)
      set_constant(slot, f, x);
  }
  /// Lets blocks share what is equal in all lanes.
  void share_constants();
  /// The same when many vectors have been added.
  void share_again();
  double& force_field(size_t slot, size_t f) {
    return element_forces[(slot / W * kernel::kForceFields + f) * W + slot % W];
  }
  double force_field(size_t slot, size_t f) const {
    return element_forces[(slot / W * kernel::kForceFields + f) * W + slot % W];
  }

  /// Field f of a slot's flow.
  double& flow(size_t slot, int f) {
    return flows[(slot / W * kernel::kFlowFields + static_cast<size_t>(f)) * W + slot % W];
  }
  double flow(size_t slot, int f) const {
    return flows[(slot / W * kernel::kFlowFields + static_cast<size_t>(f)) * W + slot % W];
  }

  /// Puts slots in another order, each where the one of `from` lay, a whole number of blocks; kNoSlot: an empty one.
  void move_slots(const std::vector<std::uint32_t>& from);

  void allocate_bodies(size_t bodies);
  void allocate_elements(size_t elements);
  /// Nothing in it: no force, and never a report.
  void clear_slot(size_t slot);
  /// The same of one that was live; what does nothing without stiffness stays, so that blocks go on sharing it.
  void still_slot(size_t slot);
  /// Kicks all bodies and moves those that drift.
  void advance_bodies();
  /// Empty blocks of joints, whose lanes stand on the ground.
  void allocate_pairs(size_t blocks);
  double& pair_constant(size_t slot, int f) {
    return pairs.constants[(slot / W * kernel::kPairConstants + static_cast<size_t>(f)) * W + slot % W];
  }
  double& pair_state(size_t slot, int f) {
    return pairs.states[(slot / W * kernel::kPairStates + static_cast<size_t>(f)) * W + slot % W];
  }
  /// Whether the bodies of blocks lie side by side.
  void find_straight_pairs();
  /// Moves the bodies of all pairs.
  void close_pairs();
  /// How low bodies reach above the ground.
  void find_lows();
  /// Adds what the ground does to boxes that touch nothing else, whose lows are known.
  void press_ground();
  /// Ways of the bodies' farthest points in the last motion.
  void find_ways();
  /// Where the bodies are now, for evaluate_elements() of a run of its own.
  void lay_poses();
  /// Forces of the elements in blocks [first, last).
  void evaluate_elements(size_t first, size_t last, const kernel::FlowWriter& writer,
                         std::vector<std::uint32_t>& beyond, std::vector<std::uint32_t>& cracking);
  /// Elements that meet in each body, 2 * element + side; batch only.
  void list_entries(const std::vector<std::vector<int>>& incidence);
  /// Forces of the elements on every body; batch only.
  void sum_forces();
  /// Memory for flows, before the first is written.
  void open_flows();

 private:
  AlignedVector<double> moved_states_, moved_forces_, moved_flows_, moved_pool_;  // scratch of move_slots()
  std::vector<std::uint32_t> moved_constants_;
  void drop_dead_entries();
  void set_constant(size_t slot, int f, double x);
  size_t state_at(size_t slot, int f) const {
    return (slot / W * kernel::kStateFields + static_cast<size_t>(f)) * W + slot % W;
  }
  size_t constant_at(size_t slot, int f) const {
    return slot / W * kernel::kConstants + static_cast<size_t>(f - kernel::kStateFields);
  }
};

}  // namespace topple::mbs
