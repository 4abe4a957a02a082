#pragma once
/// What each kind of joint holds: constraint rows, gaps and their second derivatives (docs/theory/multibody.md, "Ideal
/// joints"). Shared by the step, the equilibrium and the reactions of a view. Lines come first, rotations after them.

#include "mbs/system.h"

namespace topple::mbs {

/// How many rows a kind has: lines of action, then rotations.
struct RowCount {
  int lines = 0, rotations = 0;
};
RowCount row_count(Joint::Kind);

/// Whether z of a frame is y of its body.
inline bool is_about_y(const Mat3& R) { return norm(R.column(2) - Vec3{0, 1, 0}) < 1e-12; }

/// A joint's frames F and M at the present poses; vectors in W.
struct JointFrames {
  Mat3 F, M;                       // axes in W as columns
  Vec3 lever_parent, lever_child;  // from the centres of mass to the origins of F and M [m]
  Vec3 gap;                        // from the origin of F to that of M [m]
};
JointFrames calc_joint_frames(const State&, const CompiledJoint&);

/// Velocities of the two bodies' centres of mass and their spins, in W.
struct JointMotion {
  Vec3 v_parent, w_parent, v_child, w_child;
};

/// How far the joint is from closed: j.rows values, lengths [m] and angles [rad].
void calc_joint_gaps(const CompiledJoint&, const JointFrames&, double* gaps);
/// Rows of the joint: j.rows of them.
void calc_joint_rows(const CompiledJoint&, const JointFrames&, JointRow* rows);
/// Second time derivative of the gaps without accelerations: j.rows values [m/s², rad/s²].
void calc_joint_bias(const CompiledJoint&, const JointFrames&, const JointMotion&, double* bias);

}  // namespace topple::mbs
