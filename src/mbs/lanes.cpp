#include "mbs/lanes.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <string_view>

#include "mbs/contact_kernel.h"
#include "mbs/ground_kernel.h"

namespace topple::mbs {

namespace {

size_t log2_of(size_t W) {
  size_t shift = 0;
  while ((size_t{1} << shift) < W) ++shift;
  return shift;
}

/// Field f of a slot with nothing in it.
double empty_field(int f) {
  using namespace kernel;
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  const bool is_one =
      f == kMarkerA + 3 || f == kMarkerB + 3 || f == kSoft || f == kSoft + 3 || f == kSoft + 4 || f == kSoft + 7;
  const bool is_unlimited = f == kMostForce || f == kMostTurn;
  return is_one ? 1 : is_unlimited ? unlimited : f == kLeastForce ? -unlimited : 0;
}

/// Fields of slots that change places; `moved` is scratch. Where nothing comes from, what lies there stays.
void move_fields(const std::vector<std::uint32_t>& from, size_t fields, size_t W, AlignedVector<double>& values,
                 AlignedVector<double>& moved) {
  moved.resize(from.size() * fields);
  for (size_t slot = 0; slot < from.size(); ++slot) {
    if (from[slot] == Lanes::kNoSlot) continue;
    const double* old = values.data() + from[slot] / W * fields * W + from[slot] % W;
    double* to = moved.data() + slot / W * fields * W + slot % W;
    for (size_t f = 0; f < fields; ++f) to[f * W] = old[f * W];
  }
  values.swap(moved);
}

}  // namespace

LaneLayout Lanes::body_layout(size_t lane) const {
  return is_batch ? LaneLayout{W, 0, lane} : LaneLayout{W, log2_of(W), 0};
}

void Lanes::allocate_bodies(size_t bodies) {
  const size_t items = bodies + 1;  // the ground
  body_blocks = body_layout(0).blocks(items);
  for (AlignedVector<double>* x : {&p, &v, &L, &w, &force, &torque, &joint_force, &joint_torque})
    x->assign(body_blocks * 3 * W, 0);
  q.assign(body_blocks * 4 * W, 0);
  R.assign(body_blocks * 9 * W, 0);
  body_constants.assign(body_blocks * kernel::kBodyFields * W, 0);
  bounds.assign(body_blocks * 6 * W, 0);
  low.assign(body_blocks * W, 0);
  reach.assign(body_blocks * W, 0);
  way.assign(body_blocks * W, 0);
  ground_states.assign(body_blocks * kernel::kGroundFields * W, 0);
  ground_constants.assign(body_blocks * kernel::kGroundConstants * W, 0);
  watch.assign(body_blocks * W, kernel::kNeverLook);
  // idle lanes and the ground keep a valid orientation
  for (size_t block = 0; block < body_blocks; ++block)
    for (size_t l = 0; l < W; ++l) {
      q[block * 4 * W + l] = 1;
      for (size_t i = 0; i < 3; ++i) R[(block * 9 + 4 * i) * W + l] = 1;
    }
  for (AlignedVector<double>* x :
       {&kick, &h, &gx, &gy, &gz, &sum, &nx, &ny, &nz, &offset, &search_x, &search_y, &search_z})
    x->assign(W, 0);
}

void Lanes::allocate_elements(size_t elements) {
  element_blocks = is_batch ? elements : (elements + W - 1) / W;
  states.assign(element_blocks * kernel::kStateFields * W, 0);
  // one vector of zeros for all to begin with
  pool.assign(W, 0);
  constants.assign(element_blocks * kernel::kConstants, 0);
  uses.assign(1, static_cast<std::uint32_t>(constants.size()));
  flows.clear();
  element_forces.assign(element_blocks * kernel::kForceFields * W, 0);
  live.assign(element_blocks, 0);
  softened.assign(element_blocks, 0);
  planes.assign(element_blocks, kernel::Plane::Space);
  single.assign(element_blocks, 0);
}

void Lanes::still_slot(size_t slot) {
  using namespace kernel;
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  for (int f = 0; f < kStateFields; ++f) set(slot, f, 0);
  for (int i = 0; i < 6; ++i) set(slot, kStiffness + i, 0);
  set(slot, kLeastForce, -unlimited), set(slot, kMostForce, unlimited);
  set(slot, kMostTurn, unlimited);
  set(slot, kFlows, 0);
  for (size_t f = 0; f < static_cast<size_t>(kForceFields); ++f) force_field(slot, f) = 0;
}

void Lanes::clear_slot(size_t slot) {
  for (int f = 0; f < kernel::kSlotFields; ++f) set(slot, f, empty_field(f));
  for (size_t f = 0; f < static_cast<size_t>(kernel::kForceFields); ++f) force_field(slot, f) = 0;
}

void Lanes::move_slots(const std::vector<std::uint32_t>& from) {
  using namespace kernel;
  element_blocks = from.size() / W;
  if (!flows.empty()) {
    std::vector<std::uint32_t> flowing = from;
    for (std::uint32_t& slot : flowing)
      if (slot != kNoSlot && !(field(slot, kFlows) > 0)) slot = kNoSlot;
    move_fields(flowing, kFlowFields, W, flows, moved_flows_);
  }
  move_fields(from, kStateFields, W, states, moved_states_);
  move_fields(from, kForceFields, W, element_forces, moved_forces_);
  for (size_t slot = 0; slot < from.size(); ++slot) {
    if (from[slot] != kNoSlot) continue;
    for (int f = 0; f < kStateFields; ++f) states[state_at(slot, f)] = 0;
    for (size_t f = 0; f < static_cast<size_t>(kForceFields); ++f) force_field(slot, f) = 0;
  }
  pool.swap(moved_pool_);
  constants.swap(moved_constants_);
  pool.clear();
  constants.clear();
  uses.clear();
  for (size_t block = 0; block < element_blocks; ++block) {
    const std::uint32_t* slots = from.data() + block * W;
    for (size_t f = 0; f < static_cast<size_t>(kConstants); ++f) {
      alignas(kCacheLine) double x[kMostLanes];
      const double empty = empty_field(static_cast<int>(f) + kStateFields);
      for (size_t l = 0; l < W; ++l)
        x[l] = slots[l] == kNoSlot
                   ? empty
                   : moved_pool_[size_t{moved_constants_[slots[l] / W * kConstants + f]} * W + slots[l] % W];
      // shared with the block before
      if (block > 0) {
        const std::uint32_t last = constants[(block - 1) * kConstants + f];
        if (std::equal(x, x + W, pool.begin() + static_cast<std::ptrdiff_t>(size_t{last} * W))) {
          constants.push_back(last);
          ++uses[last];
          continue;
        }
      }
      constants.push_back(static_cast<std::uint32_t>(uses.size()));
      uses.push_back(1);
      pool.insert(pool.end(), x, x + W);
    }
  }
  shared = uses.size();
}

void Lanes::set_constant(size_t slot, int f, double x) {
  std::uint32_t& entry = constants[constant_at(slot, f)];
  if (uses[entry] > 1) {
    // a vector of its own
    --uses[entry];
    const size_t from = size_t{entry} * W;
    entry = static_cast<std::uint32_t>(uses.size());
    uses.push_back(1);
    pool.resize(pool.size() + W);
    std::copy_n(pool.begin() + static_cast<std::ptrdiff_t>(from), W, pool.end() - static_cast<std::ptrdiff_t>(W));
  }
  pool[size_t{entry} * W + slot % W] = x;
}

void Lanes::open_flows() {
  if (flows.empty()) flows.assign(element_blocks * kernel::kFlowFields * W, 0);
}

void Lanes::list_entries(const std::vector<std::vector<int>>& incidence) {
  first_entry.assign(1, 0);
  entries.clear();
  for (const std::vector<int>& of_body : incidence) {
    entries.insert(entries.end(), of_body.begin(), of_body.end());
    first_entry.push_back(static_cast<std::uint32_t>(entries.size()));
  }
  has_dead_entries = true;
}

void Lanes::drop_dead_entries() {
  size_t kept = 0;
  std::uint32_t from = 0;
  for (size_t b = 0; b + 1 < first_entry.size(); ++b) {
    const std::uint32_t to = first_entry[b + 1];
    for (; from < to; ++from)
      if (live[entries[from] / 2] > 0) entries[kept++] = entries[from];
    first_entry[b + 1] = static_cast<std::uint32_t>(kept);
  }
  entries.resize(kept);
  has_dead_entries = false;
}

void Lanes::share_again() {
  if (uses.size() > 2 * shared + 512) share_constants();
}

void Lanes::share_constants() {
  AlignedVector<double> merged;
  std::vector<std::uint32_t> counts, moved(uses.size(), kNoSlot);
  // vectors of `merged` by the hash of their bytes, with open addressing
  size_t places = 64;
  while (places < 2 * uses.size()) places *= 2;
  std::vector<std::uint32_t> known(places, kNoSlot);
  const size_t size = W * sizeof(double);
  const auto find = [&](const double* x) {
    size_t place = std::hash<std::string_view>()({reinterpret_cast<const char*>(x), size}) & (places - 1);
    while (known[place] != kNoSlot && std::memcmp(merged.data() + size_t{known[place]} * W, x, size) != 0)
      place = (place + 1) & (places - 1);
    if (known[place] == kNoSlot) {
      known[place] = static_cast<std::uint32_t>(counts.size());
      merged.insert(merged.end(), x, x + W);
      counts.push_back(0);
    }
    return known[place];
  };
  for (std::uint32_t& entry : constants) {
    if (moved[entry] == kNoSlot) moved[entry] = find(pool.data() + size_t{entry} * W);
    entry = moved[entry];
    ++counts[entry];
  }
  pool = std::move(merged);
  uses = std::move(counts);
  shared = uses.size();
}

void Lanes::allocate_pairs(size_t blocks) {
  pairs = {};
  pairs.blocks = blocks;
  pairs.kind.assign(blocks, kernel::PairKind::None);
  pairs.straight.assign(blocks, 0);
  const size_t last = body_blocks * W - 1;  // no body, or the ground
  for (std::vector<std::uint32_t>* x : {&pairs.parent, &pairs.child})
    x->assign(blocks * W, static_cast<std::uint32_t>(last));
  pairs.joint.assign(blocks * W, kNoSlot);
  pairs.constants.assign(blocks * kernel::kPairConstants * W, 0);
  pairs.states.assign(blocks * kernel::kPairStates * W, 0);
}

void Lanes::find_straight_pairs() {
  const auto is_straight = [&](const std::uint32_t* slots) {
    for (size_t l = 0; l < W; ++l)
      if (slots[l] != slots[0] + l) return false;
    return slots[0] % W == 0;
  };
  for (size_t block = 0; block < pairs.blocks; ++block)
    pairs.straight[block] = static_cast<unsigned char>((is_straight(&pairs.parent[block * W]) ? 1 : 0) +
                                                       (is_straight(&pairs.child[block * W]) ? 2 : 0));
}

void Lanes::close_pairs() {
  pairs.unfit.clear();
  pairs.over.clear();
  if (pairs.blocks == 0) return;
  const kernel::PairJob job{pairs.blocks,
                            pairs.kind.data(),
                            pairs.straight.data(),
                            pairs.parent.data(),
                            pairs.child.data(),
                            pairs.constants.data(),
                            pairs.states.data(),
                            p.data(),
                            v.data(),
                            L.data(),
                            w.data(),
                            q.data(),
                            R.data(),
                            joint_force.data(),
                            joint_torque.data(),
                            kick.data(),
                            h.data(),
                            &pairs.unfit,
                            &pairs.over};
  if (W == kernel::lanes()) {
    kernel::close_pairs(job);
  } else {
    kernel::close_pairs_singly(job);
  }
}

void Lanes::advance_bodies() {
  spins.clear();
  const kernel::BodyJob job{body_blocks, p.data(),   v.data(),     L.data(),      w.data(),
                            q.data(),    R.data(),   force.data(), torque.data(), body_constants.data(),
                            kick.data(), h.data(),   gx.data(),    gy.data(),     gz.data(),
                            is_planar,   sum.data(), &spins};
  if (W == kernel::lanes()) {
    kernel::advance_bodies(job);
  } else {
    kernel::advance_bodies_singly(job);
  }
}

void Lanes::find_lows() {
  const kernel::LowJob job{body_blocks, p.data(),  R.data(),      bounds.data(), nx.data(),
                           ny.data(),   nz.data(), offset.data(), low.data()};
  if (W == kernel::lanes()) {
    kernel::find_lows(job);
  } else {
    kernel::find_lows_singly(job);
  }
}

void Lanes::press_ground() {
  landed.clear();
  const kernel::GroundJob job{body_blocks,
                              p.data(),
                              v.data(),
                              w.data(),
                              R.data(),
                              body_constants.data(),
                              joint_force.data(),
                              joint_torque.data(),
                              force.data(),
                              torque.data(),
                              reach.data(),
                              watch.data(),
                              ground_states.data(),
                              ground_constants.data(),
                              nx.data(),
                              ny.data(),
                              nz.data(),
                              offset.data(),
                              gx.data(),
                              gy.data(),
                              gz.data(),
                              h.data(),
                              &landed};
  if (W == kernel::lanes()) {
    kernel::press_ground(job);
  } else {
    kernel::press_ground_singly(job);
  }
}

void Lanes::find_ways() {
  const kernel::WayJob job{body_blocks,     v.data(),        w.data(), reach.data(), search_x.data(),
                           search_y.data(), search_z.data(), h.data(), way.data()};
  if (W == kernel::lanes()) {
    kernel::find_ways(job);
  } else {
    kernel::find_ways_singly(job);
  }
}

void Lanes::lay_poses() {
  poses.resize(body_blocks * W * kernel::kPoseRow);
  const kernel::PoseJob job{body_blocks, p.data(), q.data(), poses.data()};
  if (W == kernel::lanes()) {
    kernel::lay_poses(job);
  } else {
    kernel::lay_poses_singly(job);
  }
}

void Lanes::evaluate_elements(size_t first, size_t last, const kernel::FlowWriter& writer,
                              std::vector<std::uint32_t>& beyond, std::vector<std::uint32_t>& cracking) {
  kernel::ElementJob job;
  job.first = first, job.last = last;
  job.live = live.data(), job.softened = softened.data(), job.planes = planes.data();
  job.single = single.data();
  job.states = states.data(), job.pool = pool.data(), job.constants = constants.data(), job.flows = flows.data(),
  job.forces = element_forces.data();
  job.a = is_batch ? nullptr : body_a.data(), job.b = is_batch ? nullptr : body_b.data();
  job.body_a = body_a.data(), job.body_b = body_b.data();
  job.p = p.data(), job.q = q.data(), job.poses = poses.data();
  job.writer = writer;
  job.outside = &beyond;
  job.cracked = &cracking;
  if (W == kernel::lanes()) {
    kernel::evaluate_elements(job);
  } else {
    kernel::evaluate_elements_singly(job);
  }
}

void Lanes::sum_forces() {
  if (has_dead_entries) drop_dead_entries();
  const kernel::SumJob job{first_entry.size() - 1, first_entry.data(), entries.data(), element_forces.data(),
                           sums_in_plane,          force.data(),       torque.data()};
  if (W == kernel::lanes()) {
    kernel::sum_forces(job);
  } else {
    kernel::sum_forces_singly(job);
  }
}

}  // namespace topple::mbs
