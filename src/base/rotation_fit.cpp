#include "base/rotation_fit.h"

#include <Eigen/Dense>

namespace topple {

namespace {

void add_outer(Mat3& B, double mass, const Vec3& x, const Vec3& X) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) B(i, j) += mass * x[i] * X[j];
}

}  // namespace

Quat fit_rotation(const Mat3& B) {
  // Davenport: the unit quaternion to the largest eigenvalue of this matrix
  Eigen::Matrix4d K;
  const Vec3 v{B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1)};
  const double trace = B(0, 0) + B(1, 1) + B(2, 2);
  K(0, 0) = trace;
  for (int i = 0; i < 3; ++i) {
    K(0, i + 1) = K(i + 1, 0) = v[i];
    for (int j = 0; j < 3; ++j) K(i + 1, j + 1) = B(i, j) + B(j, i) - (i == j ? trace : 0);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(K);
  const Eigen::Vector4d q = solver.eigenvectors().col(3);
  const double sign = q(0) < 0 ? -1 : 1;
  return normalized(Quat{sign * q(0), sign * q(1), sign * q(2), sign * q(3)});
}

Quat fit_rotation(const std::vector<FitBody>& bodies) {
  double mass = 0;
  Vec3 before, after;
  for (const FitBody& b : bodies) {
    mass += b.mass;
    before += b.mass * b.before.p;
    after += b.mass * b.after.p;
  }
  if (!(mass > 0)) return {};
  before *= 1 / mass;
  after *= 1 / mass;
  Mat3 B;
  for (const FitBody& b : bodies) {
    const double half_trace = 0.5 * (b.inertia(0, 0) + b.inertia(1, 1) + b.inertia(2, 2));
    const Mat3 second = half_trace * Mat3::identity() + -1.0 * b.inertia;
    B = B + to_matrix(b.after.q) * second * transpose(to_matrix(b.before.q));
    add_outer(B, b.mass, b.after.p - after, b.before.p - before);
  }
  return fit_rotation(B);
}

PointFit fit_points(const std::vector<FitPoint>& points) {
  PointFit fit;
  for (const FitPoint& p : points) {
    fit.mass += p.mass;
    fit.before += p.mass * p.before;
    fit.after += p.mass * p.after;
  }
  if (!(fit.mass > 0)) return fit;
  fit.before *= 1 / fit.mass;
  fit.after *= 1 / fit.mass;
  Mat3 B;
  double size = 0;
  for (const FitPoint& p : points) {
    const Vec3 x = p.after - fit.after, X = p.before - fit.before;
    add_outer(B, p.mass, x, X);
    size += p.mass * norm(x) * norm(X);
  }
  // a trace of the identity chooses the smallest of rotations that fit alike
  B = B + Mat3::diagonal({1e-12 * size, 1e-12 * size, 1e-12 * size});
  fit.rotation = fit_rotation(B);
  return fit;
}

}  // namespace topple
