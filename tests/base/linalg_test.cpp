#include "base/linalg.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace topple {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double eps = std::numeric_limits<double>::epsilon();

/// Rotation of the vector by Rodrigues' formula, written down independently of quaternions.
Vec3 rotated(const Vec3& axis, double angle, const Vec3& v) {
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + ((1 - std::cos(angle)) * dot(axis, v)) * axis;
}

double distance(const Mat3& a, const Mat3& b) {
  double worst = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) worst = std::max(worst, std::abs(a(i, j) - b(i, j)));
  return worst;
}

double distance(const Quat& a, const Quat& b) {
  return std::max({std::abs(a.w - b.w), std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

std::vector<Vec3> axes() {
  std::vector<Vec3> all = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 50; ++i) {
    const Vec3 v{normal(random), normal(random), normal(random)};
    all.push_back((1 / norm(v)) * v);
  }
  return all;
}

TEST(Rotation, AgreesWithRodrigues) {
  for (const Vec3& axis : axes())
    for (const double angle : {1e-9, 1e-3, 0.0199, 0.0201, 0.5, 2.0, 3.1}) {
      const Vec3 v{0.3, -1.2, 2.5};
      const Vec3 got = to_matrix(exp_rotation(angle * axis)) * v;
      // round-off of about twenty operations on numbers up to 3
      EXPECT_LT(norm(got - rotated(axis, angle, v)), 40 * eps);
    }
}

TEST(Rotation, LogUndoesExpFromZeroToPi) {
  for (const Vec3& axis : axes())
    for (const double angle : {0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 1.9e-3, 2.1e-3, 0.0199, 0.0201, 1.0, 3.0,
                               pi - 1e-3, pi - 1e-8, pi - 1e-13}) {
      const Vec3 r = angle * axis;
      // relative: round-off of a few operations; near π, w = cos(angle/2) keeps its absolute precision
      EXPECT_LE(norm(log_rotation(exp_rotation(r)) - r), 8 * eps * angle) << "angle " << angle;
    }
}

TEST(Rotation, LogTakesTheShortWay) {
  const Vec3 r{0, 0, 1.5 * pi};
  const Vec3 back = log_rotation(exp_rotation(r));
  EXPECT_NEAR(back.z, -0.5 * pi, 8 * eps);
  EXPECT_EQ(back.x, 0);
  const Quat q = exp_rotation({0.1, 0.2, 0.3});
  const Vec3 a = log_rotation(q), b = log_rotation({-q.w, -q.x, -q.y, -q.z});
  EXPECT_EQ(a, b) << "q and -q are the same rotation";
}

TEST(Rotation, LogOfHalfATurnHasLengthPi) { EXPECT_NEAR(norm(log_rotation({0, 0.6, 0, 0.8})), pi, 4 * eps); }

TEST(Rotation, ExpGivesUnitQuaternions) {
  for (const Vec3& axis : axes())
    for (const double angle : {1e-6, 0.019, 0.021, 1.0, 3.0, 100.0}) {
      const Quat q = exp_rotation(angle * axis);
      EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 8 * eps);
    }
}

TEST(Rotation, MatrixAndQuaternionAgree) {
  for (const Vec3& axis : axes())
    for (const double angle : {0.0, 0.3, 1.6, 2.2, 3.0, pi - 1e-9}) {
      const Quat q = exp_rotation(angle * axis);
      const Quat back = to_quat(to_matrix(q));
      const double sign = back.w * q.w + back.x * q.x + back.y * q.y + back.z * q.z < 0 ? -1 : 1;
      // the largest component is at least 1/2, so that round-off grows by no more than a small factor
      EXPECT_LT(distance({sign * back.w, sign * back.x, sign * back.y, sign * back.z}, q), 8 * eps);
    }
}

TEST(Rotation, MatrixIsOrthogonalWithDeterminantOne) {
  for (const Vec3& axis : axes()) {
    const Mat3 R = to_matrix(exp_rotation(2.3 * axis));
    EXPECT_LT(distance(R * transpose(R), Mat3::identity()), 8 * eps);
    EXPECT_NEAR(determinant(R), 1, 8 * eps);
  }
}

TEST(Rotation, ProductOfQuaternionsIsTheProductOfMatrices) {
  const Quat a = exp_rotation({0.4, -1.1, 0.2}), b = exp_rotation({-2, 0.5, 1});
  EXPECT_LT(distance(to_matrix(a * b), to_matrix(a) * to_matrix(b)), 8 * eps);
  EXPECT_LT(distance(a * conjugate(a), Quat{}), 4 * eps);
}

TEST(Mat3, InverseUndoesTheMatrix) {
  const Mat3 a{{{4, -2, 1}, {0.5, 3, 7}, {-1, 2, 5}}};
  // condition number about 20
  EXPECT_LT(distance(a * inverse(a), Mat3::identity()), 100 * eps);
  EXPECT_LT(distance(inverse(a) * a, Mat3::identity()), 100 * eps);
}

TEST(Mat3, InverseOfADiagonalIsExact) {
  EXPECT_EQ(inverse(Mat3::diagonal({2, 4, 0.5})), Mat3::diagonal({0.5, 0.25, 2}));
}

TEST(Mat3, SkewIsTheCrossProduct) {
  const Vec3 a{1, -2, 3}, b{-4, 5, 6};
  EXPECT_EQ(skew(a) * b, cross(a, b));
  EXPECT_EQ(transpose_times(skew(a), b), cross(b, a));
  EXPECT_EQ(transpose(skew(a)), -1 * skew(a));
}

TEST(Mat3, RowsColumnsAndTransposeAgree) {
  const Mat3 a{{{1, 2, 3}, {4, 5, 6}, {7, 8, 10}}};
  EXPECT_EQ(a.row(1), (Vec3{4, 5, 6}));
  EXPECT_EQ(a.column(1), (Vec3{2, 5, 8}));
  EXPECT_EQ(Mat3::from_columns(a.column(0), a.column(1), a.column(2)), a);
  EXPECT_EQ(transpose(a).row(2), a.column(2));
  EXPECT_EQ(transpose_times(a, {1, 2, 3}), transpose(a) * (Vec3{1, 2, 3}));
  EXPECT_EQ(determinant(a), -3);
}

TEST(PoseTest, ComposesLikeItsPoints) {
  const Pose X_WA{{1, 2, 3}, exp_rotation({0.3, -0.7, 1.9})}, X_AB{{-4, 0.5, 2}, exp_rotation({-1, 0.2, 0.1})};
  const Vec3 p_B{0.7, -3, 1.1};
  // round-off of two rotations of lengths up to 5
  EXPECT_LT(norm((X_WA * X_AB) * p_B - X_WA * (X_AB * p_B)), 40 * eps);
}

TEST(PoseTest, InverseLeadsBack) {
  const Pose X_WA{{1, 2, 3}, exp_rotation({0.3, -0.7, 1.9})};
  const Pose still = X_WA * inverse(X_WA);
  EXPECT_LT(norm(still.p), 20 * eps);
  EXPECT_LT(distance(still.q, Quat{}), 4 * eps);
  const Vec3 p{5, -6, 7};
  EXPECT_LT(norm(inverse(X_WA) * (X_WA * p) - p), 60 * eps);
}

TEST(PoseTest, QuarterTurnAboutZTakesXToY) {
  const Pose X{{10, 0, 0}, exp_rotation({0, 0, pi / 2})};
  EXPECT_LT(norm(X * Vec3{1, 0, 0} - Vec3{10, 1, 0}), 4 * eps);
}

TEST(Vec3, FiniteMeansEveryComponent) {
  EXPECT_TRUE(is_finite({1, 2, 3}));
  EXPECT_FALSE(is_finite({1, std::nan(""), 3}));
  EXPECT_FALSE(is_finite({1, 2, std::numeric_limits<double>::infinity()}));
}

}  // namespace
}  // namespace topple
