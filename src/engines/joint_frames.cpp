#include "engines/joint_frames.h"

#include <cmath>
#include <numbers>

namespace topple::engines {

namespace {

double across(const Vec3& v) { return std::hypot(v.x, v.y); }

}  // namespace

JointGap calc_gap(mbs::Joint::Kind kind, const JointFrames& f, double distance) {
  using Kind = mbs::Joint::Kind;
  const Mat3 F = to_matrix(f.X_WF.q), M = to_matrix(f.X_WM.q);
  const Vec3 apart = f.X_WM.p - f.X_WF.p, in_F = transpose_times(F, apart);
  // angles by their sines: only small ones occur
  const double tilt = across(transpose_times(F, M.column(2)));
  const double turn = norm(log_rotation(conjugate(f.X_WF.q) * f.X_WM.q));
  switch (kind) {
    case Kind::Fixed:
      return {norm(apart), turn};
    case Kind::Revolute:
      return {norm(apart), tilt};
    case Kind::Spherical:
      return {norm(apart), 0};
    case Kind::Universal:
      return {norm(apart), std::abs(dot(F.column(0), M.column(1)))};
    case Kind::Prismatic:
      return {across(in_F), turn};
    case Kind::Cylindrical:
      return {across(in_F), tilt};
    case Kind::Distance:
      return {std::abs(norm(apart) - distance), 0};
  }
  return {};
}

JointGap calc_gap_velocity(mbs::Joint::Kind kind, const JointFrames& f) {
  using Kind = mbs::Joint::Kind;
  const Mat3 F = to_matrix(f.X_WF.q), M = to_matrix(f.X_WM.q);
  const Vec3 apart = f.X_WM.p - f.X_WF.p;
  // of M's origin as seen from F, in F
  const Vec3 v = transpose_times(F, f.v_M - f.v_F - cross(f.w_F, apart)), w = transpose_times(F, f.w_M - f.w_F);
  switch (kind) {
    case Kind::Fixed:
      return {norm(v), norm(w)};
    case Kind::Revolute:
      return {norm(v), across(w)};
    case Kind::Spherical:
      return {norm(v), 0};
    case Kind::Universal: {
      const Vec3 held = transpose_times(F, cross(F.column(0), M.column(1)));
      return {norm(v), std::abs(dot(w, held))};
    }
    case Kind::Prismatic:
      return {across(v), norm(w)};
    case Kind::Cylindrical:
      return {across(v), across(w)};
    case Kind::Distance: {
      const double distance = norm(apart);
      return {distance > 0 ? std::abs(dot(apart, f.v_M - f.v_F)) / distance : norm(v), 0};
    }
  }
  return {};
}

double calc_joint_angle(const JointFrames& f, double previous) {
  const Mat3 F = to_matrix(f.X_WF.q), M = to_matrix(f.X_WM.q);
  const double angle = std::atan2(dot(M.column(0), F.column(1)) - dot(M.column(1), F.column(0)),
                                  dot(M.column(0), F.column(0)) + dot(M.column(1), F.column(1)));
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((previous - angle) / turn);
}

double calc_joint_displacement(const JointFrames& f) { return dot(to_matrix(f.X_WF.q).column(2), f.X_WM.p - f.X_WF.p); }

}  // namespace topple::engines
