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
  g.p_a = X_WF.p + span.a * F.column(0);
  g.p_b = X_WM.p + span.b * to_matrix(X_WM.q).column(0);
  const Vec3 chord = transpose_times(F, g.p_b - g.p_a);
  g.length = norm(chord);
  const Vec3 e = (1 / g.length) * chord;
  g.along_a = e;
  // the least rotation from x of a to the chord
  const double w = std::sqrt(std::max(0.5 * (1 + e.x), 1e-30));
  const Quat swing{w, 0, -0.5 * e.z / w, 0.5 * e.y / w};
  const Quat q_WC = X_WF.q * swing;
  g.axes = to_matrix(q_WC);
  g.turn_a = log_rotation(swing);
  g.turn_b = log_rotation(conjugate(q_WC) * X_WM.q);
  deformation[0] = g.length - span.length();
  deformation[1] = -(span.a * g.turn_a.z + span.b * g.turn_b.z);
  deformation[2] = span.a * g.turn_a.y + span.b * g.turn_b.y;
  for (int i = 0; i < 3; ++i) deformation[3 + i] = g.turn_a[i] + g.turn_b[i];
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
  const Vec3 m_b{f[3], f[4] + span.b * f[2], f[5] - span.b * f[1]};
  const Vec3 on_a = calc_conjugate_torque(-g.turn_a, m_a);  // as seen from the chord
  const Vec3 on_b = calc_conjugate_torque(g.turn_b, m_b);
  const Vec3 left = on_a - on_b;
  // the chord turns with a about the line halfway between both, which hands the torsion over
  const double handed = left.x / (1 + g.along_a.x);
  const double y = handed * g.along_a.y, z = handed * g.along_a.z;
  const Vec3 force{f[0], (left.z + z) / g.length, -(left.y + y) / g.length};
  return {g.axes * force, g.axes * Vec3{on_b.x, on_a.y + y, on_a.z + z}, g.axes * on_b};
}

}  // namespace topple::mbs
