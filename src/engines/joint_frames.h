#pragma once
/// Ideal joints seen from the poses of the two bodies, whoever computed them.

#include "mbs/model.h"

namespace topple::engines {

/// Frames F and M of a joint in W, and how their origins and axes move.
struct JointFrames {
  Pose X_WF, X_WM;
  Vec3 v_F, w_F, v_M, w_M;  // [m/s, rad/s]
};

struct JointGap {
  double length = 0;  // [m], or [m/s] of a gap in velocity
  double angle = 0;   // [rad], or [rad/s]
};

/// How far a joint is from closed.
///   distance  between the origins that a distance joint keeps [m]
JointGap calc_gap(mbs::Joint::Kind, const JointFrames&, double distance);
/// How fast it opens.
JointGap calc_gap_velocity(mbs::Joint::Kind, const JointFrames&);

/// Angle of M against F about z, the one nearest to `previous` [rad].
double calc_joint_angle(const JointFrames&, double previous);
/// Place of M's origin along z of F [m].
double calc_joint_displacement(const JointFrames&);

}  // namespace topple::engines
