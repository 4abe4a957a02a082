#include "mbs/element_geometry.h"

#include <algorithm>

namespace topple::mbs {

double calc_kappa(double angle2) {
  if (angle2 < 1e-3) return 1.0 / 12 + angle2 / 720 + angle2 * angle2 / 30240;
  const double angle = std::sqrt(angle2);
  return 1 / angle2 - 1 / (2 * angle * std::tan(0.5 * angle));
}

Vec3 calc_conjugate_torque(const Vec3& r, const Vec3& m) {
  if (m == Vec3{}) return m;
  const Vec3 rm = cross(r, m);
  return m + 0.5 * rm + calc_kappa(dot(r, r)) * cross(r, rm);
}

namespace {

/// Torque conjugate to the rate of the rotation vector 2 h with the moments m, in the axes halfway along it (eq. 4d).
Vec3 calc_middle_torque(const Vec3& h, const Vec3& m) {
  const double angle2 = dot(h, h), angle = std::sqrt(angle2);
  // angle / sin(angle) = 1 + excess angle²
  const double excess =
      angle2 < 1e-3 ? 1.0 / 6 + angle2 * (7.0 / 360 + angle2 * 31.0 / 15120) : (angle / std::sin(angle) - 1) / angle2;
  return m - excess * cross(h, cross(h, m));
}

/// Half the tangent of half the angle of h, along h.
Vec3 find_half_tangent(const Vec3& h) {
  const Quat q = exp_rotation(h);
  return 0.5 / q.w * Vec3{q.x, q.y, q.z};
}

/// The least rotation that takes x to the unit vector e.
Quat find_least_rotation(const Vec3& e) {
  const double w = std::sqrt(std::max(0.5 * (1 + e.x), 1e-30));
  return {w, 0, -0.5 * e.z / w, 0.5 * e.y / w};
}

}  // namespace

ElementGeometry measure_element(const Pose& X_WF, const Pose& X_WM, const Span& span) {
  ElementGeometry g;
  g.span = span;
  double* deformation = g.deformation.c;
  const Mat3 F = to_matrix(X_WF.q);
  if (!span.is_member()) {
    const Vec3 turn = log_rotation(conjugate(X_WF.q) * X_WM.q);
    g.turn_a = g.turn_b = 0.5 * turn;
    g.axes = to_matrix(X_WF.q * exp_rotation(g.turn_a));
    g.p_a = g.p_b = 0.5 * (X_WF.p + X_WM.p);
    g.way = transpose_times(g.axes, X_WM.p - X_WF.p);
    for (int i = 0; i < 3; ++i) deformation[i] = g.way[i], deformation[3 + i] = turn[i];
    return g;
  }
  const Mat3 M = to_matrix(X_WM.q);
  g.p_a = X_WF.p + span.a * F.column(0);
  g.p_b = X_WM.p + span.b * M.column(0);
  const Vec3 chord = g.p_b - g.p_a;
  g.length = norm(chord);
  // the ends with their x laid along the chord, and the twist from one to the other
  const Quat swing_a = find_least_rotation((1 / g.length) * transpose_times(F, chord));
  const Quat swing_b = find_least_rotation((1 / g.length) * transpose_times(M, chord));
  const Quat laid_a = X_WF.q * swing_a, apart = conjugate(laid_a) * (X_WM.q * swing_b);
  const double sign = apart.w < 0 ? -1 : 1, cosine = sign * apart.w, sine = sign * apart.x;
  const double per_length = 1 / std::hypot(1 + cosine, sine);
  g.axes = to_matrix(laid_a * Quat{per_length * (1 + cosine), per_length * sine, 0, 0});
  const auto roll = [&](const Vec3& v, double s) { return Vec3{0, cosine * v.y - s * v.z, cosine * v.z + s * v.y}; };
  g.turn_a = roll(log_rotation(swing_a), -sine);
  g.turn_b = roll(-log_rotation(swing_b), sine);
  deformation[0] = g.length - span.length();
  deformation[1] = -(span.a * g.turn_a.z + span.b * g.turn_b.z);
  deformation[2] = span.a * g.turn_a.y + span.b * g.turn_b.y;
  deformation[3] = 2 * std::atan2(sine, cosine);
  for (int i = 1; i < 3; ++i) deformation[3 + i] = g.turn_a[i] + g.turn_b[i];
  return g;
}

ElementForces calc_element_forces(const ElementGeometry& g, const Six& resultants) {
  const double* f = resultants.c;
  const Span& span = g.span;
  if (!span.is_member()) {
    const Vec3 force{f[0], f[1], f[2]};
    // the axes turn with the mean of both bodies and, by the last term, with what parts them
    const Vec3 torque =
        calc_middle_torque(g.turn_a, {f[3], f[4], f[5]}) + cross(cross(g.way, force), find_half_tangent(g.turn_a));
    const Vec3 turned = g.axes * torque;
    return {g.axes * force, turned, turned};
  }
  // moments at both stations; what they leave between them is the shear across the chord
  const Vec3 m_a{0, f[4] + span.a * f[2], f[5] - span.a * f[1]};
  const Vec3 m_b{0, f[4] + span.b * f[2], f[5] - span.b * f[1]};
  const Vec3 on_a = calc_conjugate_torque(-g.turn_a, m_a);  // as seen from the chord
  const Vec3 on_b = calc_conjugate_torque(g.turn_b, m_b);
  // an end that is laid along the chord turns with it about the line halfway between both, which hands the torsion over
  const Vec3 t_a = 2 * find_half_tangent(g.turn_a), t_b = 2 * find_half_tangent(g.turn_b);
  const double from_a = f[3] + on_b.x, from_b = f[3] + on_a.x, torsion = from_a + on_a.x;
  const Vec3 torque_a{torsion, on_a.y - from_a * t_a.z, on_a.z + from_a * t_a.y};
  const Vec3 torque_b{torsion, on_b.y + from_b * t_b.z, on_b.z - from_b * t_b.y};
  const Vec3 left = torque_a - torque_b;
  return {g.axes * Vec3{f[0], left.z / g.length, -left.y / g.length}, g.axes * torque_a, g.axes * torque_b};
}

}  // namespace topple::mbs
