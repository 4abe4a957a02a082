#pragma once
/// Multibody models that several engines solve.

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engines/engine.h"
#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::engines::test {

inline constexpr double kAdamsGravity = 9.80665;

/// Orientation whose z lies along W's y and whose x lies along W's x.
inline Quat z_along_y() { return to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0})); }

inline mbs::Model make_empty(const Vec3& gravity) {
  mbs::Model m;
  m.gravity = gravity;
  m.contact.ground = m.contact.bodies = false;
  return m;
}

inline mbs::Body make_body(const std::string& name, double mass, const Vec3& inertia, const Vec3& p) {
  mbs::Body b;
  b.name = name;
  b.mass = mass;
  b.inertia = Mat3::diagonal(inertia);
  b.X_WB.p = p;
  return b;
}

/// A joint between two bodies whose frames meet at a pose in W.
inline mbs::Joint make_joint(const mbs::Model& m, mbs::Joint::Kind kind, mbs::BodyId parent, mbs::BodyId child,
                             const Pose& X_WF) {
  mbs::Joint j;
  j.kind = kind;
  j.name = "j" + std::to_string(m.joints.size());
  j.parent = parent;
  j.child = child;
  const auto pose = [&](mbs::BodyId b) {
    return b == mbs::kGround ? Pose{} : m.bodies[static_cast<size_t>(b.index)].X_WB;
  };
  j.X_PF = inverse(pose(parent)) * X_WF;
  j.X_CM = inverse(pose(child)) * X_WF;
  return j;
}

/// The bar of the MSC.ADAMS cases: 1 kg, its centre 2 m along x from a joint at the origin.
inline mbs::Model make_bar(mbs::Joint::Kind kind, const Quat& axes) {
  mbs::Model m = make_empty({0, 0, -kAdamsGravity});
  mbs::add_body(m, make_body("bar", 1, {0.04, 0.1, 0.1}, {2, 0, 0}));
  mbs::add_joint(m, make_joint(m, kind, mbs::kGround, {0}, {{}, axes}));
  return m;
}

inline mbs::BodyId add_box(mbs::Model& m, const std::string& name, double mass, const Vec3& half, const Vec3& p) {
  const double c = mass / 3;
  mbs::Body b = make_body(name, mass,
                          {c * (half.y * half.y + half.z * half.z), c * (half.x * half.x + half.z * half.z),
                           c * (half.x * half.x + half.y * half.y)},
                          p);
  mbs::Shape s;
  s.half = half;
  b.shapes.push_back(s);
  return mbs::add_body(m, b);
}

/// A ball of 0.1 m over the ground.
inline mbs::Model make_ball(double height, double restitution) {
  mbs::Model m = make_empty({0, 0, -9.81});
  mbs::Body b = make_body("ball", 1, {0.004, 0.004, 0.004}, {0, 0, height + 0.1});
  mbs::Shape s;
  s.kind = mbs::Shape::Kind::Sphere;
  s.radius = 0.1;
  b.shapes.push_back(s);
  mbs::add_body(m, b);
  m.contact.ground = true;
  m.contact.restitution = restitution;
  return m;
}

/// Rows of time, x, y, z.
inline std::vector<std::array<double, 4>> read_adams(const std::string& name) {
  std::ifstream in(std::string(TOPPLE_SOURCE_DIR) + "/tests/data/adams/" + name);
  std::vector<std::array<double, 4>> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::array<double, 4> row{};
    if (words >> row[0] >> row[1] >> row[2] >> row[3]) rows.push_back(row);
  }
  return rows;
}

/// A run's frames.
struct Course {
  std::vector<mbs::View> frames;
  std::vector<mbs::Happening> happenings;
  mbs::Summary summary;
};

inline Course run(const Engine& engine, const mbs::Model& model, mbs::Options o) {
  Course c;
  o.on_frame = [&](const mbs::View& v) { c.frames.push_back(v); };
  o.on_happening = [&](const mbs::Happening& h) { c.happenings.push_back(h); };
  c.summary = engine.run(model, o);
  return c;
}

/// From the poses of the model, frames every `interval`, `duration` long.
inline mbs::Options make_options(double duration, double interval, double step = 0) {
  mbs::Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.frame_interval = interval;
  o.step = step;
  return o;
}

inline bool is_available(const std::string& name) {
  for (const EngineInfo& e : list_engines())
    if (e.name == name) return e.is_available();
  return false;
}

}  // namespace topple::engines::test

#define TOPPLE_NEEDS_ENGINE(name) \
  if (!topple::engines::test::is_available(name)) GTEST_SKIP() << "built without the engine " << (name)
