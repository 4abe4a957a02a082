#pragma once
/// Small multibody models with known answers.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "mbs/model.h"
#include "mbs/solver.h"
#include "mbs/zone.h"

namespace topple::mbs::test {

inline Mat3 box_inertia(double mass, const Vec3& half) {
  const double c = mass / 3;
  return Mat3::diagonal({c * (half.y * half.y + half.z * half.z), c * (half.x * half.x + half.z * half.z),
                         c * (half.x * half.x + half.y * half.y)});
}

inline Body make_box(const std::string& name, double mass, const Vec3& half, const Vec3& p) {
  Body b;
  b.name = name;
  b.mass = mass;
  b.inertia = box_inertia(mass, half);
  b.X_WB.p = p;
  Shape s;
  s.half = half;
  b.shapes.push_back(s);
  return b;
}

/// Rotation that takes the member axis x upwards and leaves y along -y... the frame of columns: x up, z along W's y.
inline Quat upright() { return to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0})); }

/// Prismatic member of n rigid segments along +x from the ground, joined by bushings at the cells' centres: bodies are
/// the pieces between the centres of the cells of length L/n, so the first and the last are half as long.
struct Cantilever {
  Model model;
  BodyId tip;
};
inline Cantilever make_cantilever(int n, double length, double width, double height, double E, double density) {
  Cantilever c;
  c.model.gravity = {};
  c.model.contact.ground = c.model.contact.bodies = false;
  const double cell = length / n, area = width * height;
  const double Iy = width * std::pow(height, 3) / 12, Iz = height * std::pow(width, 3) / 12;
  BodyId before = kGround;
  Vec3 p_before;
  for (int i = 0; i < n; ++i) {
    const double begin = (i + 0.5) * cell, end = i + 1 < n ? (i + 1.5) * cell : length;
    const Vec3 p{(begin + end) / 2, 0, 0};
    const Vec3 half{(end - begin) / 2, width / 2, height / 2};
    const BodyId b = add_body(c.model, make_box("s" + std::to_string(i), density * area * (end - begin), half, p));
    ZoneElement e;
    e.name = "z" + std::to_string(i);
    e.a = before;
    e.b = b;
    e.X_AF.p = Vec3{begin, 0, 0} - p_before;
    e.X_BM.p = Vec3{begin, 0, 0} - p;
    e.translational_stiffness = {E * area / cell, 12 * E * Iz / std::pow(cell, 3), 12 * E * Iy / std::pow(cell, 3)};
    e.rotational_stiffness = {0.4 * E * 2 * Iy / cell, E * Iy / cell, E * Iz / cell};
    e.damping_ratio = 0;
    add_element(c.model, e);
    before = b;
    p_before = p;
    c.tip = b;
  }
  return c;
}

/// A whole member as one zone with a station at each end, laws 0 and `second`: bends like a beam of this length and EI.
inline constexpr double kMemberLength = 3, kMemberEI = 3e7;
inline ZoneParameters make_member(int second = 0) {
  constexpr double L = kMemberLength, EI = kMemberEI;
  ZoneParameters p;
  for (double& k : p.stiffness) k = 1e8;
  p.stiffness[1] = p.stiffness[2] = 12 * EI / (L * L * L);
  p.stiffness[4] = p.stiffness[5] = EI / L;
  p.stations = 2;
  p.x[0] = -L / 2, p.x[1] = L / 2;
  p.law[0] = 0, p.law[1] = second;
  return p;
}

/// Elastic-plastic law of one axis: limit moment about z whatever the normal force, bending about y unlimited.
inline ZoneLaw plastic_hinge(double moment) {
  ZoneLaw law;
  law.moment_z.normal_force = {-1e12, 1e12};
  law.moment_z.plastic_rotation = {0, 10};
  law.moment_z.positive = {moment, moment, moment, moment};
  law.moment_z.negative = law.moment_z.positive;
  return law;
}

/// Does one thing to an element (RemoveElement) or a joint.
inline Event make_event(double time, Action::Kind kind, int item, const std::string& name = "") {
  Event e;
  e.time = time;
  e.name = name;
  e.actions.resize(1);
  e.actions[0].kind = kind;
  if (kind == Action::Kind::RemoveElement)
    e.actions[0].element = {item};
  else
    e.actions[0].joint = {item};
  return e;
}

/// A tower of boxes on weak zones that comes down: yielding, breaking, ground and body contact, a joint that is
/// released.
inline Model make_tower() {
  Model m;
  ZoneLaw law = plastic_hinge(2e4);
  law.rupture_rotation = 0.05;
  law.compression = {{0, 0.02, 0.3}, {4e5, 2e5, 2e5}};
  law.crush_length = 0.2;
  law.shear_y = law.shear_z = 1e5;
  law.slip_rupture = 0.1;
  law.slip_softening = 0.05;
  const LawId id = add_law(m, law);
  BodyId below = kGround;
  for (int i = 0; i < 6; ++i) {
    const BodyId b =
        add_body(m, make_box("b" + std::to_string(i), 4000, {0.5, 0.4, 0.5}, {0.02 * i, 0.01 * i, 0.6 + 1.1 * i}));
    ZoneElement e;
    e.name = "z" + std::to_string(i);
    e.a = below;
    e.b = b;
    e.X_AF = {below == kGround ? Vec3{0, 0, 0.05} : Vec3{0.02, 0.01, 0.55}, upright()};
    e.X_BM = {{0, 0, -0.55}, upright()};
    if (below == kGround) e.X_AF.p = {0, 0, 0.05};
    e.translational_stiffness = {4e8, 1e8, 1e8};
    e.rotational_stiffness = {2e7, 2e7, 2e7};
    e.stations = {{0, id}};
    add_element(m, e);
    below = b;
  }
  const BodyId flag = add_body(m, make_box("flag", 500, {0.2, 0.2, 0.2}, {0.8, 0.05, 6.1}));
  Joint j;
  j.name = "arm";
  j.parent = below;
  j.child = flag;
  j.X_PF.p = Vec3{0.6, 0.05, 6.1} - m.bodies[5].X_WB.p;
  j.X_CM.p = {-0.2, 0, 0};
  j.shear_limit = 3e4;
  add_joint(m, j);
  m.events.push_back(make_event(0.1, Action::Kind::RemoveElement, 0, "cut"));
  return m;
}

/// Of places and energies.
inline std::uint64_t hash_of(const View& v) {
  std::uint64_t h = 1469598103934665603ULL;
  const auto add = [&](double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    h = (h ^ bits) * 1099511628211ULL;
  };
  for (const Pose& X : v.X_WB) {
    for (const double x : {X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z}) add(x);
  }
  for (const auto* list : {&v.v_WB, &v.w_WB, &v.joint_force, &v.joint_moment})
    for (const Vec3& x : *list) add(x.x), add(x.y), add(x.z);
  for (const double x : v.joint_angle) add(x);
  add(v.energy.residual);
  add(v.energy.friction);
  return h;
}

}  // namespace topple::mbs::test
