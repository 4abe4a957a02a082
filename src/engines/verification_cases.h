#pragma once
/// What the cases of the verification are built with. Plane models lie in x-z and turn about y.

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engines/verification.h"
#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::engines {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kGravity = 9.81;  // [m/s²]

/// No contact.
inline mbs::Model make_empty_model(const Vec3& gravity = {0, 0, -kGravity}) {
  mbs::Model m;
  m.gravity = gravity;
  m.contact.ground = m.contact.bodies = false;
  return m;
}

/// A body without shapes.
inline mbs::BodyId add_mass(mbs::Model& m, const std::string& name, double mass, const Vec3& inertia, const Vec3& p,
                            const Quat& q = {}) {
  mbs::Body b;
  b.name = name;
  b.mass = mass;
  b.inertia = Mat3::diagonal(inertia);
  b.X_WB = {p, q};
  return mbs::add_body(m, b);
}

/// z along W's y, so that joints turn in the plane; x upwards.
inline Quat axis_along_y() { return to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0})); }

/// A joint whose frames meet at a pose in W.
inline mbs::JointId add_joint_at(mbs::Model& m, mbs::Joint::Kind kind, mbs::BodyId parent, mbs::BodyId child,
                                 const Pose& X_WF) {
  mbs::Joint j;
  j.kind = kind;
  j.name = "j" + std::to_string(m.joints.size());
  j.parent = parent;
  j.child = child;
  const auto pose = [&m](mbs::BodyId b) {
    return b == mbs::kGround ? Pose{} : m.bodies[static_cast<size_t>(b.index)].X_WB;
  };
  j.X_PF = inverse(pose(parent)) * X_WF;
  j.X_CM = inverse(pose(child)) * X_WF;
  return mbs::add_joint(m, j);
}

/// From the poses of the model, with a frame at each step unless another interval is given.
inline mbs::Options make_options(double duration, double step, double frame_interval = 0) {
  mbs::Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = frame_interval > 0 ? frame_interval : step;
  return o;
}

/// A value and its rate at equidistant instants, each cubic between them (error of fourth order). The two are not
/// combined: engines find rates at other instants than values, and such errors would depend on where a passage lies in
/// its step.
class Trace {
 public:
  /// Where the value passes 0.
  struct Passage {
    double time, rate;
  };
  /// Where the rate passes 0.
  struct Peak {
    double time, value;
  };

  void add(double time, double value, double rate);
  std::vector<Passage> falling, rising;
  std::vector<Peak> peaks;  // of either kind

 private:
  struct Sample {
    double time, value, rate;
  };
  Sample last_[4] = {};
  long count_ = 0;
};

/// Integral by Simpson's rule with n (even) intervals.
template <class F>
double integrate(const F& f, double from, double to, int n = 2000) {
  const double d = (to - from) / n;
  double sum = f(from) + f(to);
  for (int i = 1; i < n; ++i) sum += (i % 2 ? 4 : 2) * f(from + i * d);
  return sum * d / 3;
}

inline std::vector<double> halve(double step) { return {step, step / 2, step / 4}; }

void add_motion_cases(std::vector<VerificationCase>&);
void add_contact_cases(std::vector<VerificationCase>&);
void add_force_cases(std::vector<VerificationCase>&);
void add_structure_cases(std::vector<VerificationCase>&);

}  // namespace topple::engines
