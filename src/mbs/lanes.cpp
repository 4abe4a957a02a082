#include "mbs/lanes.h"

#include <limits>

namespace topple::mbs {

namespace {

size_t log2_of(size_t W) {
  size_t shift = 0;
  while ((size_t{1} << shift) < W) ++shift;
  return shift;
}

}  // namespace

LaneLayout Lanes::body_layout(size_t lane) const {
  return is_batch ? LaneLayout{W, 0, lane} : LaneLayout{W, log2_of(W), 0};
}

void Lanes::allocate_bodies(size_t bodies) {
  const size_t items = bodies + 1;  // the ground
  body_blocks = body_layout(0).blocks(items);
  for (AlignedVector<double>* x : {&p, &v, &L, &w, &force, &torque}) x->assign(body_blocks * 3 * W, 0);
  q.assign(body_blocks * 4 * W, 0);
  R.assign(body_blocks * 9 * W, 0);
  constants.assign(body_blocks * kernel::kBodyFields * W, 0);
  // idle lanes and the ground keep a valid orientation
  for (size_t block = 0; block < body_blocks; ++block)
    for (size_t l = 0; l < W; ++l) {
      q[block * 4 * W + l] = 1;
      for (size_t i = 0; i < 3; ++i) R[(block * 9 + 4 * i) * W + l] = 1;
    }
  for (AlignedVector<double>* x : {&kick, &h, &gx, &gy, &gz, &sum}) x->assign(W, 0);
}

void Lanes::allocate_elements(size_t elements) {
  element_blocks = is_batch ? elements : (elements + W - 1) / W;
  slots.assign(element_blocks * kernel::kSlotFields * W, 0);
  flows.assign(element_blocks * kernel::kFlowFields * W, 0);
  element_forces.assign(element_blocks * kernel::kForceFields * W, 0);
  live.assign(element_blocks, 0);
  softened.assign(element_blocks, 0);
}

void Lanes::clear_slot(size_t slot) {
  using namespace kernel;
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  for (int f = 0; f < kSlotFields; ++f) field(slot, f) = 0;
  field(slot, kMarkerA + 3) = field(slot, kMarkerB + 3) = 1;
  field(slot, kLeastForce) = -unlimited;
  field(slot, kMostForce) = field(slot, kMostTurn) = unlimited;
  for (const int i : {0, 3, 4, 7}) field(slot, kSoft + i) = 1;
  for (size_t f = 0; f < static_cast<size_t>(kForceFields); ++f) force_field(slot, f) = 0;
}

void Lanes::advance_bodies() {
  spins.clear();
  const kernel::BodyJob job{body_blocks, p.data(),     v.data(),      L.data(),         w.data(),    q.data(),
                            R.data(),    force.data(), torque.data(), constants.data(), kick.data(), h.data(),
                            gx.data(),   gy.data(),    gz.data(),     sum.data(),       &spins};
  if (W == kernel::lanes()) {
    kernel::advance_bodies(job);
  } else {
    kernel::advance_bodies_singly(job);
  }
}

void Lanes::evaluate_elements(size_t first, size_t last, std::vector<std::uint32_t>& beyond) {
  kernel::ElementJob job;
  job.first = first, job.last = last;
  job.live = live.data(), job.softened = softened.data();
  job.slots = slots.data(), job.flows = flows.data(), job.forces = element_forces.data();
  job.a = is_batch ? nullptr : body_a.data(), job.b = is_batch ? nullptr : body_b.data();
  job.body_a = body_a.data(), job.body_b = body_b.data();
  job.p = p.data(), job.q = q.data();
  job.body_shift = body_layout(0).shift;
  job.outside = &beyond;
  if (W == kernel::lanes()) {
    kernel::evaluate_elements(job);
  } else {
    kernel::evaluate_elements_singly(job);
  }
}

void Lanes::sum_forces() {
  const kernel::SumJob job{first_entry.size() - 1, first_entry.data(), entries.data(),
                           element_forces.data(),  force.data(),       torque.data()};
  if (W == kernel::lanes()) {
    kernel::sum_forces(job);
  } else {
    kernel::sum_forces_singly(job);
  }
}

}  // namespace topple::mbs
