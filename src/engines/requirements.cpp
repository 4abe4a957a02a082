#include "engines/requirements.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <string>

#include "engines/joint_frames.h"

namespace topple::engines {

namespace {

constexpr double kSlack = 1e-10;  // of an inertia's trace; beyond round-off, below what anybody writes

bool is_possible(const Mat3& inertia) {
  const Vec3 I = calc_principal_moments(inertia);
  return I.z <= I.x + I.y + kSlack * (I.x + I.y + I.z);
}

}  // namespace

Vec3 calc_principal_moments(const Mat3& inertia) {
  Eigen::Matrix3d I;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) I(i, k) = inertia(i, k);
  const Eigen::Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I, Eigen::EigenvaluesOnly).eigenvalues();
  return {principal[0], principal[1], principal[2]};
}

std::vector<Unsupported> find_impossible_inertias(const mbs::Model& model) {
  std::vector<Unsupported> out;
  const std::string what = "an inertia with a principal moment larger than the sum of the two others";
  for (size_t i = 0; i < model.bodies.size(); ++i)
    if (!model.bodies[i].fixed && !is_possible(model.bodies[i].inertia))
      out.push_back({place_of("bodies", i, model.bodies[i].name) + ".inertia", what});
  for (size_t i = 0; i < model.events.size(); ++i)
    for (const mbs::Action& a : model.events[i].actions)
      if (a.kind == mbs::Action::Kind::ReplaceBody && !is_possible(a.replacement.inertia))
        out.push_back({place_of("events", i, model.events[i].name) + ".replacement.inertia", what});
  return out;
}

std::vector<Unsupported> find_planes(const mbs::Model& model) {
  if (!model.is_planar) return {};
  return {{"is_planar", "bodies that keep to a plane"}};
}

std::vector<Unsupported> find_opening_joints(const mbs::Model& model, const mbs::Options& options) {
  std::vector<Unsupported> out;
  if (options.equilibrium) return out;
  for (size_t i = 0; i < model.joints.size(); ++i) {
    const mbs::Joint& j = model.joints[i];
    JointFrames f;
    double speed = 0, spin = 0;
    const auto look = [&](mbs::BodyId id, const Pose& X_BF, Pose& X, Vec3& v, Vec3& w) {
      X = X_BF;
      if (id == mbs::kGround) return;
      const mbs::Body& b = model.bodies[static_cast<size_t>(id.index)];
      X = b.X_WB * X_BF;
      if (b.fixed) return;
      w = b.w_WB;
      v = b.v_WB + cross(w, X.p - b.X_WB.p);
      speed = std::max(speed, norm(v));
      spin = std::max(spin, norm(w));
    };
    look(j.parent, j.X_PF, f.X_WF, f.v_F, f.w_F);
    look(j.child, j.X_CM, f.X_WM, f.v_M, f.w_M);
    const JointGap gap = calc_gap_velocity(j.kind, f);
    if (gap.length > 1e-9 * (1e-3 + speed) || gap.angle > 1e-9 * (1e-3 + spin))
      out.push_back(
          {place_of("joints", i, j.name),
           fmt::format("velocities at the start that open a joint ({:.3g} m/s, {:.3g} rad/s)", gap.length, gap.angle)});
  }
  return out;
}

namespace {

/// Whether a body has a shape, now or after an event.
bool can_have_shape(const mbs::Model& model, size_t b) {
  if (!model.bodies[b].shapes.empty()) return true;
  for (const mbs::Event& e : model.events)
    for (const mbs::Action& a : e.actions)
      if (a.kind == mbs::Action::Kind::ReplaceBody && a.body.index == static_cast<int>(b) &&
          !a.replacement.shapes.empty())
        return true;
  return false;
}

}  // namespace

bool can_touch_ground(const mbs::Model& model) {
  if (!model.contact.ground) return false;
  for (size_t b = 0; b < model.bodies.size(); ++b)
    if (!model.bodies[b].fixed && can_have_shape(model, b)) return true;
  return false;
}

bool can_touch_bodies(const mbs::Model& model) {
  if (!model.contact.bodies) return false;
  size_t moving = 0, all = 0;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (!can_have_shape(model, b)) continue;
    ++all;
    moving += !model.bodies[b].fixed;
  }
  return moving > 0 && all > 1;
}

}  // namespace topple::engines
