#pragma once
/// Mechanisms of rods and ideal joints with known motions. Planar ones lie in the plane x, z with gravity along -z.

#include <string>
#include <vector>

#include "models.h"

namespace topple::mbs::test {

/// Rotation whose z axis is `axis`; its x axis is W's x or, where that is too near, W's z, made square to it.
inline Quat along(const Vec3& axis) {
  const Vec3 z = (1 / norm(axis)) * axis;
  const Vec3 seed = std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const Vec3 x = seed - dot(seed, z) * z, ex = (1 / norm(x)) * x;
  return to_quat(Mat3::from_columns(ex, cross(z, ex), z));
}

/// A slender uniform rod from one point to another, x of B along it; about its own axis it has a thousandth.
inline Body make_rod(const std::string& name, double mass, const Vec3& from, const Vec3& to) {
  Body b;
  b.name = name;
  b.mass = mass;
  const Vec3 d = to - from;
  const double I = mass * dot(d, d) / 12;
  b.inertia = Mat3::diagonal({1e-3 * I, I, I});
  const Vec3 x = (1 / norm(d)) * d, y = std::abs(x.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  const Vec3 z0 = cross(x, y), z = (1 / norm(z0)) * z0;
  b.X_WB = {0.5 * (from + to), to_quat(Mat3::from_columns(x, cross(z, x), z))};
  return b;
}

/// Joins two bodies at a point of W, both frames there with the given orientation.
inline JointId join(Model& m, Joint::Kind kind, BodyId parent, BodyId child, const Vec3& p, const Quat& q,
                    const std::string& name = "") {
  const auto pose = [&](BodyId b) { return b == kGround ? Pose{} : m.bodies[static_cast<size_t>(b.index)].X_WB; };
  Joint j;
  j.kind = kind;
  j.name = name.empty() ? "j" + std::to_string(m.joints.size()) : name;
  j.parent = parent;
  j.child = child;
  j.X_PF = inverse(pose(parent)) * Pose{p, q};
  j.X_CM = inverse(pose(child)) * Pose{p, q};
  return add_joint(m, j);
}

/// A hinge about W's y, the axis of planar mechanisms.
inline JointId pin(Model& m, BodyId parent, BodyId child, const Vec3& p, const std::string& name = "") {
  return join(m, Joint::Kind::Revolute, parent, child, p, along({0, 1, 0}), name);
}

inline Model empty_model() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  return m;
}

/// Windows of rods of 1 m and 1 kg: upright cranks 0 to n on the ground, couplers above; the crank's ends move with 1
/// m/s along x. Body i is crank i, body n + 1 + i coupler i.
inline Model make_four_bars(int n) {
  Model m = empty_model();
  for (int i = 0; i <= n; ++i) {
    Body b = make_rod("crank " + std::to_string(i), 1, {1.0 * i, 0, 0}, {1.0 * i, 0, 1});
    b.v_WB = {0.5, 0, 0};
    b.w_WB = {0, 1, 0};
    add_body(m, b);
  }
  for (int i = 0; i < n; ++i) {
    Body b = make_rod("coupler " + std::to_string(i), 1, {1.0 * i, 0, 1}, {1.0 * i + 1, 0, 1});
    b.v_WB = {1, 0, 0};
    add_body(m, b);
  }
  for (int i = 0; i <= n; ++i) pin(m, kGround, {i}, {1.0 * i, 0, 0}, "A" + std::to_string(i));
  for (int i = 0; i < n; ++i) {
    pin(m, {i}, {n + 1 + i}, {1.0 * i, 0, 1}, "B" + std::to_string(i));
    pin(m, {i + 1}, {n + 1 + i}, {1.0 * i + 1, 0, 1}, "C" + std::to_string(i + 1));
  }
  return m;
}

}  // namespace topple::mbs::test
