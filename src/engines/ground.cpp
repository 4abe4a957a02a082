#include "engines/ground.h"

#include <algorithm>
#include <cmath>

#include "engines/course.h"
#include "engines/requirements.h"

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
  if (!(restitution > 1e-4)) return 50;  // 1 / (4 ζ²) is left
  double low = 0, high = 1;
  while (calc_restitution(high) > restitution) high *= 2;
  for (int i = 0; i < 200 && high - low > 1e-15 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (calc_restitution(middle) > restitution ? low : high) = middle;
  }
  return high;
}

Ground::Ground(const mbs::Model& model, const std::vector<BodyNow>& bodies, double step)
    : model_(model), body_(model.bodies.size()), is_there_(can_touch_ground(model)), step_(step) {
  if (!is_there_) return;
  damping_ratio_ = find_damping_ratio(model.contact.restitution);
  update_shapes(bodies);
}

void Ground::update_shapes(const std::vector<BodyNow>& bodies) {
  if (!is_there_) return;
  for (size_t b = 0; b < bodies.size(); ++b) {
    Body& body = body_[b];
    if (model_.bodies[b].fixed || body.replaced == bodies[b].replaced) continue;
    body = {};
    body.replaced = bodies[b].replaced;
    const auto add = [&](const Vec3& p, double radius) {
      body.points.push_back({p, radius});
      body.reach = std::max(body.reach, norm(p) + radius);
    };
    for (const mbs::Shape& s : bodies[b].shapes) {
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

double Ground::calc_overlap(const Point& point, const Pose& X_WB) const {
  const mbs::Contact& c = model_.contact;
  return c.offset + point.radius - dot(c.normal, X_WB * point.p);
}

double Ground::find_bearable_ratio(size_t b, const Pose& X_WB) const {
  if (!(step_ > 0)) return damping_ratio_;
  double touching = 0;
  for (const Point& point : body_[b].points)
    touching += point.is_active && calc_overlap(point, X_WB) > point.born ? 1 : 0;
  // n points that share a body brake its fastest motion by up to some n / 2 of what one does; more than half at once
  // falls between the stages
  const double most = std::min(0.5, 1 / std::max(touching, 1.0));
  return std::min(damping_ratio_, most / (2 * model_.contact.contact_frequency * step_));
}

Vec3 Ground::calc(const Motion& m, const std::vector<BodyNow>& bodies, std::vector<Wrench>& on, double& power) const {
  const mbs::Contact& c = model_.contact;
  const Vec3 n = c.normal;
  const double frequency = c.contact_frequency;
  Vec3 total;
  for (size_t b = 0; b < body_.size(); ++b) {
    if (body_[b].points.empty() || dot(n, m.X_WB[b].p) - c.offset > body_[b].reach) continue;
    const Mat3 R = to_matrix(m.X_WB[b].q), inverse_inertia = inverse(bodies[b].inertia);
    const double damping_ratio = find_bearable_ratio(b, m.X_WB[b]);
    for (const Point& point : body_[b].points) {
      if (!point.is_active) continue;
      const double depth = calc_overlap(point, m.X_WB[b]) - point.born;
      if (!(depth > 0)) continue;
      const Vec3 r = R * point.p - point.radius * n, v = m.v_WB[b] + cross(m.w_WB[b], r);
      const double approach = -dot(n, v);
      // mass that the point feels: spring and damper go with it, so that frequency and restitution are the model's
      const Vec3 lever = transpose_times(R, cross(r - R * bodies[b].p_BBcm, n));
      const double mass = 1 / (1 / bodies[b].mass + dot(lever, inverse_inertia * lever));
      const double normal = mass * frequency * (frequency * depth + 2 * damping_ratio * approach);
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
  }
  return total;
}

void Ground::advance(const Motion& m, const std::vector<unsigned char>& is_held) {
  for (size_t b = 0; b < body_.size(); ++b)
    for (Point& point : body_[b].points) {
      if (is_held[b]) {
        point.is_active = false;
        continue;
      }
      const double overlap = std::max(0.0, calc_overlap(point, m.X_WB[b]));
      point.born = point.is_active ? std::min(point.born, overlap) : overlap;
      point.is_active = true;
    }
}

}  // namespace topple::engines
