#include "mbs/joint_rows.h"

#include <cmath>

namespace topple::mbs {

namespace {

/// A pair of axes that stay at right angles, one in each body.
struct AxisPair {
  Vec3 child, parent;
};

/// The pairs of the kinds that do not hold the whole orientation.
AxisPair axis_pair(Joint::Kind kind, const JointFrames& f, int i) {
  if (kind == Joint::Kind::Universal) return {f.M.column(1), f.F.column(0)};
  return {f.M.column(2), f.F.column(i)};
}

bool holds_orientation(Joint::Kind kind) { return kind == Joint::Kind::Fixed || kind == Joint::Kind::Prismatic; }
bool slides(Joint::Kind kind) { return kind == Joint::Kind::Prismatic || kind == Joint::Kind::Cylindrical; }

Vec3 unit(int i) {
  Vec3 e;
  e[i] = 1;
  return e;
}

/// Acceleration of a vector that is fixed in a body turning evenly.
Vec3 centripetal(const Vec3& w, const Vec3& r) { return cross(w, cross(w, r)); }

}  // namespace

RowCount row_count(Joint::Kind kind) {
  switch (kind) {
    case Joint::Kind::Fixed:
      return {3, 3};
    case Joint::Kind::Revolute:
      return {3, 2};
    case Joint::Kind::Spherical:
      return {3, 0};
    case Joint::Kind::Universal:
      return {3, 1};
    case Joint::Kind::Prismatic:
      return {2, 3};
    case Joint::Kind::Cylindrical:
      return {2, 2};
    case Joint::Kind::Distance:
      return {1, 0};
  }
  return {};
}

JointFrames calc_joint_frames(const State& s, const CompiledJoint& j) {
  JointFrames f;
  Vec3 p_F = j.p_PF, p_M = j.p_CM;
  f.F = j.R_PF;
  f.M = j.R_CM;
  if (j.parent >= 0) {
    const size_t b = static_cast<size_t>(j.parent);
    const Mat3 R = s.R[b];
    f.lever_parent = R * (j.p_PF - s.p_offset[b]);
    p_F = s.p[b] + f.lever_parent;
    f.F = R * j.R_PF;
  }
  if (j.child >= 0) {
    const size_t b = static_cast<size_t>(j.child);
    const Mat3 R = s.R[b];
    f.lever_child = R * (j.p_CM - s.p_offset[b]);
    p_M = s.p[b] + f.lever_child;
    f.M = R * j.R_CM;
  }
  f.gap = p_M - p_F;
  return f;
}

void calc_joint_gaps(const CompiledJoint& j, const JointFrames& f, double* out) {
  if (j.kind == Joint::Kind::Distance) {
    out[0] = norm(f.gap) - j.length;
    return;
  }
  for (int i = 0; i < j.lines; ++i) out[i] = slides(j.kind) ? dot(f.gap, f.F.column(i)) : f.gap[i];
  double* turn = out + j.lines;
  if (holds_orientation(j.kind)) {
    // rotation vector between the frames from the skew part: exact to third order, and only small angles occur
    const Vec3 r = 0.5 * (cross(f.F.column(0), f.M.column(0)) + cross(f.F.column(1), f.M.column(1)) +
                          cross(f.F.column(2), f.M.column(2)));
    turn[0] = r.x, turn[1] = r.y, turn[2] = r.z;
    return;
  }
  for (int i = 0; i < j.rows - j.lines; ++i) {
    const AxisPair a = axis_pair(j.kind, f, i);
    turn[i] = dot(a.child, a.parent);
  }
}

void calc_joint_rows(const CompiledJoint& j, const JointFrames& f, JointRow* rows) {
  // forces act at the origin of M, on the parent too where that is away from the origin of F
  for (int i = 0; i < j.lines; ++i) {
    const Vec3 e = j.kind == Joint::Kind::Distance ? (1 / norm(f.gap)) * f.gap
                   : slides(j.kind)                ? f.F.column(i)
                                                   : unit(i);
    const Vec3 reach = j.kind == Joint::Kind::Distance || slides(j.kind) ? f.lever_parent + f.gap : f.lever_parent;
    rows[i] = {e, cross(f.lever_child, e), cross(e, reach)};
  }
  for (int i = 0; i < j.rows - j.lines; ++i) {
    Vec3 axis = unit(i);
    if (!holds_orientation(j.kind)) {
      const AxisPair a = axis_pair(j.kind, f, i);
      axis = cross(a.child, a.parent);
    }
    rows[j.lines + i] = {{}, axis, -axis};
  }
}

void calc_joint_bias(const CompiledJoint& j, const JointFrames& f, const JointMotion& m, double* out) {
  const Vec3 &wp = m.w_parent, &wc = m.w_child;
  const Vec3 curve = centripetal(wc, f.lever_child) - centripetal(wp, f.lever_parent);
  if (j.kind == Joint::Kind::Distance || slides(j.kind)) {
    const Vec3 rate = m.v_child + cross(wc, f.lever_child) - m.v_parent - cross(wp, f.lever_parent);
    if (j.kind == Joint::Kind::Distance) {
      const double length = norm(f.gap), along = dot(f.gap, rate) / length;
      out[0] = dot(f.gap, curve) / length + (dot(rate, rate) - along * along) / length;
      return;
    }
    for (int i = 0; i < j.lines; ++i) {
      const Vec3 e = f.F.column(i);
      out[i] = dot(curve, e) + 2 * dot(rate, cross(wp, e)) + dot(f.gap, centripetal(wp, e));
    }
  } else {
    for (int i = 0; i < j.lines; ++i) out[i] = curve[i];
  }
  double* turn = out + j.lines;
  for (int i = 0; i < j.rows - j.lines; ++i) {
    if (holds_orientation(j.kind)) {
      turn[i] = 0;  // both bodies turn alike
      continue;
    }
    const AxisPair a = axis_pair(j.kind, f, i);
    turn[i] = dot(centripetal(wc, a.child), a.parent) + 2 * dot(cross(wc, a.child), cross(wp, a.parent)) +
              dot(a.child, centripetal(wp, a.parent));
  }
}

}  // namespace topple::mbs
