#include "base/rotation_fit.h"

#include <gtest/gtest.h>

namespace topple {
namespace {

TEST(RotationFit, OfARigidMotionIsThatMotion) {
  const Quat q = exp_rotation({0.3, -1.1, 0.4});
  std::vector<FitBody> bodies;
  for (int i = 0; i < 5; ++i) {
    FitBody b;
    b.mass = 1 + i;
    b.inertia = Mat3::diagonal({1, 2, 2.5});
    b.before = {{1.0 * i, 0.5 * i * i, -2.0 * (i % 3)}, exp_rotation({0.1 * i, 0, 0.2})};
    b.after = Pose{{3, 4, 5}, q} * b.before;
    bodies.push_back(b);
  }
  const Quat fit = fit_rotation(bodies);
  // round-off of an eigenvalue problem
  EXPECT_NEAR(norm(log_rotation(conjugate(q) * fit)), 0, 1e-12);
  bodies.resize(1);  // one body alone turns as it turns
  EXPECT_NEAR(norm(log_rotation(conjugate(q) * fit_rotation(bodies))), 0, 1e-12);
}

TEST(RotationFit, HardlyFollowsASmallPartThatSpins) {
  std::vector<FitBody> bodies;
  for (double x : {-5.0, 5.0}) {
    FitBody b;
    b.mass = 100;
    b.inertia = Mat3::diagonal({10, 10, 10});
    b.before = b.after = {{x, 0, 0}, {}};
    bodies.push_back(b);
  }
  bodies.push_back({1, Mat3::diagonal({0.1, 0.1, 0.1}), {{0, 0, 3}, {}}, {{0, 0, 3}, exp_rotation({0, 2, 0})}});
  EXPECT_LT(norm(log_rotation(fit_rotation(bodies))), 1e-3);
}

TEST(RotationFit, OfPointsIsThatOfTheMotion) {
  const Pose X{{3, 4, 5}, exp_rotation({0.3, -1.1, 0.4})};
  std::vector<FitPoint> points;
  for (int i = 0; i < 6; ++i) {
    const Vec3 p{1.0 * i, 0.5 * i * i, -2.0 * (i % 3)};
    points.push_back({1.0 + i, p, X * p});
  }
  const PointFit fit = fit_points(points);
  EXPECT_EQ(fit.mass, 21);
  // the trace that settles lines, 1e-12 of the second moment, over the share of the two smallest axes of these points
  EXPECT_NEAR(norm(log_rotation(conjugate(X.q) * fit.rotation)), 0, 1e-10);
  EXPECT_NEAR(norm(X * fit.before - fit.after), 0, 1e-12);
}

TEST(RotationFit, OfALineDoesNotSpinAboutIt) {
  std::vector<FitPoint> points;
  for (int i = 0; i < 4; ++i) points.push_back({1, {1.0 * i, 0, 0}, {0, 1.0 * i, 0}});
  const Vec3 turned = log_rotation(fit_points(points).rotation);
  // a quarter turn about z; what spins about the line is found to 1e-16 / 1e-12 of round-off over the weight that holds
  // it
  EXPECT_NEAR(norm(turned - Vec3{0, 0, 0.5 * 3.14159265358979323846}), 0, 1e-3);
}

}  // namespace
}  // namespace topple
