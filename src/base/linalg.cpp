#include "base/linalg.h"

namespace topple {

Quat to_quat(const Mat3& R) {
  const double t = R(0, 0) + R(1, 1) + R(2, 2);
  Quat q;
  if (t > R(0, 0) && t > R(1, 1) && t > R(2, 2)) {
    q = {1 + t, R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)};
  } else if (R(0, 0) >= R(1, 1) && R(0, 0) >= R(2, 2)) {
    q = {R(2, 1) - R(1, 2), 1 + R(0, 0) - R(1, 1) - R(2, 2), R(1, 0) + R(0, 1), R(0, 2) + R(2, 0)};
  } else if (R(1, 1) >= R(2, 2)) {
    q = {R(0, 2) - R(2, 0), R(1, 0) + R(0, 1), 1 + R(1, 1) - R(0, 0) - R(2, 2), R(2, 1) + R(1, 2)};
  } else {
    q = {R(1, 0) - R(0, 1), R(0, 2) + R(2, 0), R(2, 1) + R(1, 2), 1 + R(2, 2) - R(0, 0) - R(1, 1)};
  }
  return normalized(q);
}

Quat exp_rotation(const Vec3& r) {
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

Vec3 log_rotation(const Quat& q) {
  const double sign = q.w < 0 ? -1 : 1;
  const Vec3 v{sign * q.x, sign * q.y, sign * q.z};
  const double w = sign * q.w, s2 = dot(v, v);
  if (s2 < 1e-6) {
    // 2 asin(s)/s with s = |v|; the series is exact to round-off here
    return (2 * (1 + s2 / 6 * (1 + s2 * 9 / 20 * (1 + s2 * 25 / 42)))) * v;
  }
  const double s = std::sqrt(s2);
  return (2 * std::atan2(s, w) / s) * v;
}

}  // namespace topple
