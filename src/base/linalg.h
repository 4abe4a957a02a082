#pragma once
/// Small fixed-size linear algebra for rigid-body mechanics: no allocation, no hidden normalisation.
/// A pose X_WB maps coordinates in B to coordinates in W: p_WQ = p_WB + R_WB * p_BQ.

#include <cmath>

namespace topple {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  constexpr double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr Vec3& operator+=(const Vec3& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  constexpr Vec3& operator-=(const Vec3& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  constexpr Vec3& operator*=(double s) {
    x *= s, y *= s, z *= s;
    return *this;
  }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
constexpr Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, double s) { return a *= s; }
constexpr Vec3 operator*(double s, Vec3 a) { return a *= s; }
constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline bool is_finite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// Row-major 3 x 3 matrix.
struct Mat3 {
  double m[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};

  static constexpr Mat3 identity() { return diagonal({1, 1, 1}); }
  static constexpr Mat3 diagonal(const Vec3& d) {
    Mat3 a;
    a.m[0][0] = d.x, a.m[1][1] = d.y, a.m[2][2] = d.z;
    return a;
  }
  static constexpr Mat3 from_columns(const Vec3& a, const Vec3& b, const Vec3& c) {
    return {{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}};
  }
  constexpr Vec3 column(int j) const { return {m[0][j], m[1][j], m[2][j]}; }
  constexpr Vec3 row(int i) const { return {m[i][0], m[i][1], m[i][2]}; }
  constexpr double& operator()(int i, int j) { return m[i][j]; }
  constexpr double operator()(int i, int j) const { return m[i][j]; }
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;
};

constexpr Vec3 operator*(const Mat3& a, const Vec3& v) {
  return {a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z, a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
          a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z};
}
/// Aᵀ v
constexpr Vec3 transpose_times(const Mat3& a, const Vec3& v) {
  return {a.m[0][0] * v.x + a.m[1][0] * v.y + a.m[2][0] * v.z, a.m[0][1] * v.x + a.m[1][1] * v.y + a.m[2][1] * v.z,
          a.m[0][2] * v.x + a.m[1][2] * v.y + a.m[2][2] * v.z};
}
constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return c;
}
constexpr Mat3 operator+(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[i][j] + b.m[i][j];
  return c;
}
constexpr Mat3 operator*(double s, const Mat3& a) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = s * a.m[i][j];
  return c;
}
constexpr Mat3 transpose(const Mat3& a) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[j][i];
  return c;
}
constexpr double determinant(const Mat3& a) { return dot(a.row(0), cross(a.row(1), a.row(2))); }
/// Inverse by cofactors; the caller knows that the matrix is regular.
constexpr Mat3 inverse(const Mat3& a) {
  const Vec3 r0 = cross(a.row(1), a.row(2)), r1 = cross(a.row(2), a.row(0)), r2 = cross(a.row(0), a.row(1));
  return (1 / dot(a.row(0), r0)) * Mat3::from_columns(r0, r1, r2);
}
/// The matrix of v ×.
constexpr Mat3 skew(const Vec3& v) { return {{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }

/// Unit quaternion w + xi + yj + zk of a rotation.
struct Quat {
  double w = 1, x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Quat&, const Quat&) = default;
};

constexpr Quat operator*(const Quat& a, const Quat& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
constexpr Quat conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
inline Quat normalized(const Quat& q) {
  const double s = 1 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}
constexpr Mat3 to_matrix(const Quat& q) {
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z,
               wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}}};
}
/// Quaternion of a rotation matrix (Shepperd's choice of the largest component).
Quat to_quat(const Mat3& R);
/// Rotation by the vector r [rad] (axis times angle).
inline Quat exp_rotation(const Vec3& r) {
  const double half2 = 0.25 * dot(r, r);
  // sin(a)/a and cos(a) of the half angle a; series below 1e-4 rad², where they are exact to round-off
  double s, c;
  if (half2 < 1e-4) {
    s = 1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42));
    c = 1 - half2 / 2 * (1 - half2 / 12 * (1 - half2 / 30));
  } else {
    const double a = std::sqrt(half2);
    s = std::sin(a) / a;
    c = std::cos(a);
  }
  return {c, 0.5 * s * r.x, 0.5 * s * r.y, 0.5 * s * r.z};
}
/// Rotation vector of q, angle in [0, π].
inline Vec3 log_rotation(const Quat& q) {
  const double sign = q.w < 0 ? -1 : 1;
  const Vec3 v{sign * q.x, sign * q.y, sign * q.z};
  const double s2 = dot(v, v);
  if (s2 < 1e-3) {
    // 2 asin(s)/s with s = |v|; the series is exact to round-off here
    return (2 * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * 945.0 / 42240)))))) *
           v;
  }
  const double s = std::sqrt(s2);
  return (2 * std::atan2(s, sign * q.w) / s) * v;
}

struct Pose {
  Vec3 p;
  Quat q;
  friend constexpr bool operator==(const Pose&, const Pose&) = default;
};
/// X_AC = X_AB * X_BC
inline Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.p + to_matrix(X_AB.q) * X_BC.p, X_AB.q * X_BC.q};
}
inline Vec3 operator*(const Pose& X_AB, const Vec3& p_B) { return X_AB.p + to_matrix(X_AB.q) * p_B; }
inline Pose inverse(const Pose& X_AB) {
  const Quat q = conjugate(X_AB.q);
  return {to_matrix(q) * -X_AB.p, q};
}

}  // namespace topple
