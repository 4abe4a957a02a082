/// Joints that share no moving body with others: what the kernel needs of them, and what it leaves
/// (docs/theory/multibody.md, "Joints between two bodies").

#include <algorithm>
#include <array>

#include "mbs/joint_rows.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

using kernel::PairKind;

PairKind kind_of(const CompiledJoint& j, bool is_planar) {
  switch (j.kind) {
    case Joint::Kind::Fixed:
      return PairKind::Weld;
    case Joint::Kind::Spherical:
      return PairKind::Ball;
    case Joint::Kind::Universal:
      return PairKind::Universal;
    case Joint::Kind::Revolute:
      return is_planar && is_about_y(j.R_PF) && is_about_y(j.R_CM) ? PairKind::PlanarHinge : PairKind::Hinge;
    case Joint::Kind::Prismatic:
    case Joint::Kind::Cylindrical:
    case Joint::Kind::Distance:
      break;
  }
  return PairKind::None;
}

}  // namespace

void System::pack_pairs() {
  Lanes& l = *lanes;
  const size_t W = l.W;
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  pair_slot.assign(joints.size(), Lanes::kNoSlot);
  joint_over.assign(joints.size(), 0);
  paired.clear();
  for (JointCluster& c : clusters) {
    if (c.joints.size() != 1) continue;
    const CompiledJoint& j = joints[static_cast<size_t>(c.joints[0])];
    const PairKind kind = kind_of(j, l.is_planar);
    // a body welded to one that does not move has nothing left to solve, and no composite
    c.is_pair = kind != PairKind::None && (kind != PairKind::Weld || (moving(j.parent) && moving(j.child)));
    if (c.is_pair) paired.push_back(c.joints[0]);
  }
  std::sort(paired.begin(), paired.end());
  const auto body_slot = [&](int b) {
    const size_t item = b < 0 ? B : static_cast<size_t>(b);
    return static_cast<std::uint32_t>(l.is_batch ? item * W + lane : item);
  };
  if (l.is_batch) {
    if (l.pairs.blocks != joints.size()) {
      l.allocate_pairs(joints.size());
      for (size_t j = 0; j < joints.size(); ++j) {
        l.pairs.kind[j] = kind_of(joints[j], l.is_planar);
        const auto item = [&](int b) { return b < 0 ? B : static_cast<size_t>(b); };
        for (size_t i = 0; i < W; ++i) {
          l.pairs.parent[j * W + i] = static_cast<std::uint32_t>(item(joints[j].parent) * W + i);
          l.pairs.child[j * W + i] = static_cast<std::uint32_t>(item(joints[j].child) * W + i);
          l.pairs.joint[j * W + i] = static_cast<std::uint32_t>(j);
        }
      }
      l.find_straight_pairs();
    }
    for (size_t j = 0; j < joints.size(); ++j) l.pair_constant(j * W + lane, kernel::kPairLive) = 0;
    for (const int j : paired)
      pair_slot[static_cast<size_t>(j)] = static_cast<std::uint32_t>(static_cast<size_t>(j) * W + lane);
  } else {
    // blocks of one kind each
    std::vector<PairKind> kinds;
    size_t slot = 0;
    for (const PairKind kind :
         {PairKind::Weld, PairKind::Ball, PairKind::Universal, PairKind::Hinge, PairKind::PlanarHinge}) {
      for (const int j : paired) {
        if (kind_of(joints[static_cast<size_t>(j)], l.is_planar) != kind) continue;
        if (slot % W == 0) kinds.push_back(kind);
        pair_slot[static_cast<size_t>(j)] = static_cast<std::uint32_t>(slot++);
      }
      slot = (slot + W - 1) / W * W;
    }
    l.allocate_pairs(kinds.size());
    l.pairs.kind = kinds;
    for (const int j : paired) {
      const size_t s = pair_slot[static_cast<size_t>(j)];
      l.pairs.parent[s] = body_slot(joints[static_cast<size_t>(j)].parent);
      l.pairs.child[s] = body_slot(joints[static_cast<size_t>(j)].child);
      l.pairs.joint[s] = static_cast<std::uint32_t>(j);
    }
    l.find_straight_pairs();
  }
  for (const JointCluster& c : clusters)
    if (c.is_pair) pack_pair(static_cast<size_t>(c.joints[0]), c);
}

void System::pack_pair(size_t joint, const JointCluster& c) {
  using namespace kernel;
  const CompiledJoint& j = joints[joint];
  const size_t slot = pair_slot[joint];
  const auto put = [&](int f, double x) { lanes->pair_constant(slot, f) = x; };
  const auto put3 = [&](int f, const Vec3& x) {
    for (int i = 0; i < 3; ++i) put(f + i, x[i]);
  };
  const auto put6 = [&](int f, const Mat3& x) {
    const double part[6] = {x(0, 0), x(0, 1), x(0, 2), x(1, 1), x(1, 2), x(2, 2)};
    for (int i = 0; i < 6; ++i) put(f + i, part[i]);
  };
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  const auto constants = [&](int b) { return moving(b) ? state.body[static_cast<size_t>(b)] : BodyConstants{}; };
  const auto offset = [&](int b) { return b < 0 ? Vec3{} : state.p_offset[static_cast<size_t>(b)]; };
  const BodyConstants parent = constants(j.parent), child = constants(j.child);
  const Vec3 to_F = j.p_PF - offset(j.parent), to_M = j.p_CM - offset(j.child);
  put(kPairLive, 1);
  put(kInverseMassParent, parent.inverse_mass);
  put(kInverseMassChild, child.inverse_mass);
  put3(kLeverParent, to_F);
  put3(kLimitAxis, j.R_PF.column(0));
  put(kTensionLimit, j.tension_limit);
  put(kShearLimit2, j.shear_limit * j.shear_limit);
  put(kMomentLimit2, j.moment_limit * j.moment_limit);
  put(kGapTolerance, c.tolerance);
  put(kTurnTolerance, c.tolerance / c.length);
  if (j.kind == Joint::Kind::Fixed) {
    const Mat3 child_in_parent = j.R_PF * transpose(j.R_CM);
    const Vec3 reach = to_F - child_in_parent * to_M;
    const double whole = parent.mass + child.mass, reduced = parent.mass * child.mass / whole;
    const Mat3 inertia = child_in_parent * child.inertia * transpose(child_in_parent);
    const Mat3 apart = dot(reach, reach) * Mat3::identity() +
                       -1.0 * Mat3::from_columns(reach.x * reach, reach.y * reach, reach.z * reach);
    put3(kLeverChild, child_in_parent * to_M);
    put3(kReach, reach);
    const Quat q = to_quat(child_in_parent);
    // of both quaternions of the child that which it has goes on
    double sign = 1;
    if (moving(j.parent) && moving(j.child)) {
      const Quat now = conjugate(state.q[static_cast<size_t>(j.parent)]) * state.q[static_cast<size_t>(j.child)];
      if (now.w * q.w + now.x * q.x + now.y * q.y + now.z * q.z < 0) sign = -1;
    }
    const double parts[4] = {sign * q.w, sign * q.x, sign * q.y, sign * q.z};
    for (int i = 0; i < 4; ++i) put(kRelative + i, parts[i]);
    put(kChildShare, child.mass / whole);
    put(kReducedMass, reduced);
    put6(kInverseWhole, inverse(parent.inertia + inertia + reduced * apart));
    put6(kInertiaParent, parent.inertia);
    put6(kInertiaChild, inertia);
    return;
  }
  put3(kLeverChild, to_M);
  put6(kInverseInertiaParent, parent.inverse_inertia);
  put6(kInverseInertiaChild, child.inverse_inertia);
  const bool is_universal = j.kind == Joint::Kind::Universal;
  for (int i = 0; i < 2; ++i) {
    put3(kParentAxes + 3 * i, j.R_PF.column(i));
    put3(kChildAxes + 3 * i, j.R_CM.column(is_universal ? 1 : 2));
  }
  put3(kChildX, j.R_CM.column(0));
  for (int r = 0; r < 6; ++r) lanes->pair_state(slot, kCurvature + r) = state.joint[joint].curvature[r];
}

void System::take_pairs(double h) {
  using namespace kernel;
  const Pairs& pairs = lanes->pairs;
  const auto mine = [&](std::uint32_t slot) { return !lanes->is_batch || slot % lanes->W == lane; };
  for (const int joint : paired) joint_over[static_cast<size_t>(joint)] = 0;
  for (const std::uint32_t slot : pairs.unfit)
    if (mine(slot)) joint_over[pairs.joint[slot]] = 1;  // to be looked at
  for (const int joint : paired) {
    const size_t j = static_cast<size_t>(joint), slot = pair_slot[j];
    JointState& js = state.joint[j];
    const auto get3 = [&](int f) {
      return Vec3{lanes->pair_state(slot, f), lanes->pair_state(slot, f + 1), lanes->pair_state(slot, f + 2)};
    };
    js.force = get3(kForce);
    js.moment = get3(kMoment);
    if (joints[j].kind == Joint::Kind::Fixed) continue;
    for (int r = 0; r < joints[j].rows; ++r) js.curvature[r] = lanes->pair_state(slot, kCurvature + r);
    state.largest_drift = std::max(state.largest_drift, lanes->pair_state(slot, kOpen));
    // what the kernel leaves has no new cosine and sine there
    if (joints[j].kind == Joint::Kind::Revolute && !joint_over[j])
      update_angle(j, lanes->pair_state(slot, kCosine), lanes->pair_state(slot, kSine));
  }
  for (const std::uint32_t slot : pairs.over)
    if (mine(slot)) joint_over[pairs.joint[slot]] = 1;
  for (const std::uint32_t slot : pairs.unfit) {
    if (!mine(slot)) continue;
    const size_t j = pairs.joint[slot];
    for (JointCluster& c : clusters)
      if (c.joints[0] == static_cast<int>(j)) solve_cluster(c, h);
    for (int r = 0; r < joints[j].rows; ++r) lanes->pair_state(slot, kCurvature + r) = state.joint[j].curvature[r];
  }
}

}  // namespace topple::mbs
