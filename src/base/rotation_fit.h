#pragma once
/// The rotation that best describes how mass moved.

#include <vector>

#include "base/linalg.h"

namespace topple {

/// A rigid body of a group, before and after.
struct FitBody {
  double mass = 0;
  Mat3 inertia;  // about its mass centre, in its frame
  Pose before, after;
};

/// Rotation that brings the mass of the bodies as they were nearest to where it is now, in the sense of least squares
/// over all their mass, the displacement of the mass centre taken out. The identity without mass.
Quat fit_rotation(const std::vector<FitBody>&);

/// A point with mass, before and after.
struct FitPoint {
  double mass = 0;
  Vec3 before, after;
};

/// What moved the mass centre of points, and how they turned about it in the sense of least squares.
struct PointFit {
  double mass = 0;
  Vec3 before, after;  // mass centres
  Quat rotation;
};
/// Points on a line leave the rotation about it open; it is then the smallest one.
PointFit fit_points(const std::vector<FitPoint>&);

/// Rotation R that maximises tr(Rᵀ B), B = ∫ x Xᵀ dm of the places after (x) and before (X) from their mass centres
/// (Davenport's q method; Markley & Crassidis 2014, section 5.2).
Quat fit_rotation(const Mat3& B);

}  // namespace topple
