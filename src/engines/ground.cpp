#include "engines/ground.h"

#include <algorithm>
#include <cmath>

#include "engines/course.h"

namespace topple::engines {

namespace {

/// Loss of speed for a damping ratio, see find_damping_ratio.
double calc_restitution(double ratio) {
  if (std::abs(ratio - 1) < 1e-6) return std::exp(-2);
  return ratio < 1 ? std::exp(-2 * ratio * std::acos(ratio) / std::sqrt(1 - ratio * ratio))
                   : std::exp(-2 * ratio * std::acosh(ratio) / std::sqrt(ratio * ratio - 1));
}

}  // namespace

double find_damping_ratio(double restitution) {
  if (!(restitution > 1e-6)) return 500;  // 1 / (4 ζ²) is left
  double low = 0, high = 1;
  while (calc_restitution(high) > restitution) high *= 2;
  for (int i = 0; i < 200 && high - low > 1e-15 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (calc_restitution(middle) > restitution ? low : high) = middle;
  }
  return high;
}

Ground::Ground(const mbs::Model& model) : model_(model), reach_(model.bodies.size(), 0) {
  if (!model.contact.ground) return;
  damping_ratio_ = find_damping_ratio(model.contact.restitution);
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (model.bodies[b].fixed) continue;
    const auto add = [&](const Vec3& p, double radius) {
      point_.push_back({static_cast<int>(b), p, radius});
      reach_[b] = std::max(reach_[b], norm(p) + radius);
    };
    for (const mbs::Shape& s : model.bodies[b].shapes) {
      using Kind = mbs::Shape::Kind;
      if (s.kind == Kind::Sphere) add(s.X_BS.p, s.radius);
      if (s.kind == Kind::Hull)
        for (const Vec3& v : s.vertices) add(s.X_BS * v, 0);
      if (s.kind == Kind::Box)
        for (int i = 0; i < 8; ++i)
          add(s.X_BS * Vec3{i & 1 ? s.half.x : -s.half.x, i & 2 ? s.half.y : -s.half.y, i & 4 ? s.half.z : -s.half.z},
              0);
    }
  }
}

double Ground::calc_overlap(const Point& point, const Motion& m) const {
  const mbs::Contact& c = model_.contact;
  return c.offset + point.radius - dot(c.normal, m.X_WB[static_cast<size_t>(point.body)] * point.p);
}

Vec3 Ground::calc(const Motion& m, const std::vector<BodyNow>& bodies, std::vector<Wrench>& on, double& power) const {
  const mbs::Contact& c = model_.contact;
  const Vec3 n = c.normal;
  Vec3 total;
  int far = -1;  // the body that is known to be above the ground
  for (const Point& point : point_) {
    if (!point.is_active || point.body == far) continue;
    const size_t b = static_cast<size_t>(point.body);
    if (dot(n, m.X_WB[b].p) - c.offset > reach_[b]) {
      far = point.body;
      continue;
    }
    const double depth = calc_overlap(point, m) - point.born;
    if (!(depth > 0)) continue;
    const Mat3 R = to_matrix(m.X_WB[b].q);
    const Vec3 r = R * point.p - point.radius * n, v = m.v_WB[b] + cross(m.w_WB[b], r);
    const double approach = -dot(n, v);
    // mass that the point feels: k and c go with it, so that frequency and restitution are those of the model
    const Vec3 lever = transpose_times(R, cross(r - R * bodies[b].p_BBcm, n));
    const double mass = 1 / (1 / bodies[b].mass + dot(lever, inverse(bodies[b].inertia) * lever));
    const double frequency = c.contact_frequency;
    const double normal = mass * frequency * (frequency * depth + 2 * damping_ratio_ * approach);
    if (!(normal > 0)) continue;
    const Vec3 slide = v + approach * n;
    const double speed = norm(slide);
    const double drag = speed > 0 ? std::min(c.friction * normal / speed, mass * frequency) : 0;
    const Vec3 force = normal * n - drag * slide;
    on[b].force += force;
    on[b].torque += cross(r, force);
    power += dot(force, v);
    total += force;
  }
  return total;
}

void Ground::advance(const Motion& m, const std::vector<unsigned char>& is_held) {
  for (Point& point : point_) {
    if (is_held[static_cast<size_t>(point.body)]) {
      point.is_active = false;
      continue;
    }
    const double overlap = std::max(0.0, calc_overlap(point, m));
    point.born = point.is_active ? std::min(point.born, overlap) : overlap;
    point.is_active = true;
  }
}

}  // namespace topple::engines
