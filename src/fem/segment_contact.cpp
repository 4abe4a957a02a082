#include "fem/segment_contact.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "fem/explicit_inside.h"

namespace topple::fem {

namespace {

/// Penalty rate over the mass felt and the step squared, and the share of that mass that a dashpot of friction stops in
/// a step: a node takes part in up to ten touches.
constexpr double kRate = 0.03, kGrip = 0.02;

Vec3 vector_at(const double* r) { return {r[0], r[1], r[2]}; }

struct Quad {
  std::array<std::uint32_t, 4> rows;
};
Quad quad_of(const ContactSetup& setup, std::uint32_t face) {
  Quad q{};
  for (size_t k = 0; k < 4; ++k) q.rows[k] = setup.rows_of_element[face / 6][static_cast<size_t>(kFaces[face % 6][k])];
  return q;
}

struct PointState {
  Vec3 p, v;
  double inverse_mass = 0, radius = 0;
};
PointState find_point(const ContactSetup& setup, const ExplicitState& s, const ContactPoint& point) {
  PointState q;
  if (point.kind == ContactPoint::Debris) {
    const Particle& particle = s.particles[point.index];
    return {particle.p, particle.v, 1 / particle.mass, particle.radius};
  }
  if (point.kind == ContactPoint::Node) {
    const double* r = s.rows.data() + 8 * size_t{point.index};
    return {vector_at(r), vector_at(r + kernel::kSpeed), r[kernel::kInverseMass], 0};
  }
  const Quad quad = quad_of(setup, point.index);
  for (const std::uint32_t row : quad.rows) {
    const double* r = s.rows.data() + 8 * size_t{row};
    q.p += 0.25 * vector_at(r), q.v += 0.25 * vector_at(r + kernel::kSpeed);
    q.inverse_mass += r[kernel::kInverseMass] / 16;
  }
  return q;
}
/// The place of a point on a quadrilateral: x(ξ, η) + height n = p with the normal n of its middle (eq. 22).
struct Projection {
  double weights[4];
  Vec3 normal;  // from the face to the point
  double height = 0;
  bool inside = false;
};
/// None where a ball of `radius`, clamped to the face, or a point that is to be above or below it cannot touch.
std::optional<Projection> project(const Vec3& p, const Vec3 (&x)[4], double radius, bool clamps) {
  constexpr double kEdge = 1.001;  // faces that meet at an edge leave no gap
  Projection out;
  const Vec3 c = 0.25 * (x[0] + x[1] + x[2] + x[3]), a = 0.25 * (x[1] + x[2] - x[0] - x[3]),
             b = 0.25 * (x[2] + x[3] - x[0] - x[1]), d = 0.25 * (x[0] + x[2] - x[1] - x[3]);
  const Vec3 n = cross(a, b);
  out.normal = (1 / std::max(norm(n), 1e-300)) * n;
  // in the plane of the middle, with one axis along a
  const Vec3 along = (1 / std::max(norm(a), 1e-300)) * a, across = cross(out.normal, along);
  const double a1 = dot(a, along), b1 = dot(b, along), b2 = dot(b, across), d1 = dot(d, along), d2 = dot(d, across);
  const double p1 = dot(p - c, along), p2 = dot(p - c, across);
  // beside the rectangle around the face
  const double beside1 = std::abs(p1) - kEdge * kEdge * (std::abs(a1) + std::abs(b1) + std::abs(d1)),
               beside2 = std::abs(p2) - kEdge * kEdge * (std::abs(b2) + std::abs(d2));
  const double far1 = std::max(0.0, beside1), far2 = std::max(0.0, beside2);
  if (far1 * far1 + far2 * far2 > radius * radius) return {};
  double xi = 0, eta = 0;
  for (int i = 0; i < 4; ++i) {
    const double t1 = a1 + eta * d1, t2 = eta * d2, u1 = b1 + xi * d1, u2 = b2 + xi * d2;
    const double r1 = p1 - (xi * t1 + eta * b1), r2 = p2 - (xi * t2 + eta * b2);
    if (std::abs(r1) + std::abs(r2) < 1e-14 * a1) break;
    const double area = t1 * u2 - t2 * u1;
    if (!(std::abs(area) > 1e-300)) break;
    const double dx = (r1 * u2 - r2 * u1) / area, dy = (t1 * r2 - t2 * r1) / area;
    xi = std::clamp(xi + dx, -3.0, 3.0), eta = std::clamp(eta + dy, -3.0, 3.0);
    if (std::abs(dx) + std::abs(dy) < 1e-12) break;
  }
  out.inside = std::abs(xi) <= kEdge && std::abs(eta) <= kEdge;
  if (clamps) xi = std::clamp(xi, -1.0, 1.0), eta = std::clamp(eta, -1.0, 1.0);
  out.weights[0] = 0.25 * (1 - xi) * (1 - eta), out.weights[1] = 0.25 * (1 + xi) * (1 - eta);
  out.weights[2] = 0.25 * (1 + xi) * (1 + eta), out.weights[3] = 0.25 * (1 - xi) * (1 + eta);
  const Vec3 r = p - (c + xi * a + eta * b + (xi * eta) * d);
  out.height = dot(r, out.normal);
  if (clamps && !out.inside) {
    const double length = norm(r);
    if (length > 0) out.normal = (1 / length) * r;
    out.height = length;
  }
  return out;
}

/// Forces on the point for a depth and a relative velocity.
void calc_forces(double depth, const Vec3& normal, const Vec3& v, double rate, double inverse_mass,
                 const ExplicitOptions& options, double h, SurfaceTouch& touch) {
  const bool debris = touch.point.kind == ContactPoint::Debris;
  const double damping = debris ? options.debris_damping : options.contact_damping;
  const double closing = -dot(normal, v);
  const double push = std::max(0.0, rate * depth + 2 * damping * std::sqrt(rate / inverse_mass) * closing);
  const Vec3 along = v + closing * normal;
  const double slide = norm(along);
  const double grip = std::min(options.friction * push, kGrip * slide / (inverse_mass * h));
  touch.normal_force = push * normal;
  touch.friction = slide > 0 ? (-grip / slide) * along : Vec3{};
  touch.stored = 0.5 * rate * depth * depth;
  touch.before = v;
  touch.depth = depth;
}

/// Whether a point behind a face of an element at some depth is behind its other outer faces too, and deeper there.
bool is_nearest(const ContactSetup& setup, const ExplicitState& s, const Vec3& p, std::uint32_t face, double depth) {
  const size_t e = face / 6;
  for (std::uint32_t f = 0; f < 6; ++f) {
    const int beside = setup.surface.neighbour[e][f];
    if (f == face % 6 || (beside >= 0 && s.contact.gone[static_cast<size_t>(beside)] == 0)) continue;
    const Quad quad = quad_of(setup, static_cast<std::uint32_t>(6 * e) + f);
    Vec3 x[4];
    for (size_t k = 0; k < 4; ++k) x[k] = vector_at(s.rows.data() + 8 * size_t{quad.rows[k]});
    const Vec3 n = cross(x[2] - x[0], x[3] - x[1]);
    if (-dot(p - 0.25 * (x[0] + x[1] + x[2] + x[3]), n) < depth * norm(n)) return false;
  }
  return true;
}

/// A candidate's touch of a face, if it touches.
std::optional<SurfaceTouch> press_face(const ContactSetup& setup, const ExplicitOptions& options, double h,
                                       const ExplicitState& s, const PointState& q, const NearCandidate& near) {
  const ContactState& c = s.contact;
  const ContactCandidate& candidate = near.candidate;
  const bool debris = candidate.point.kind == ContactPoint::Debris;
  if (!debris && !setup.enabled) return {};
  if (c.gone[candidate.face / 6] != 0) return {};
  if (candidate.point.kind == ContactPoint::Centre && c.gone[candidate.point.index / 6] != 0) return {};
  if (!(q.inverse_mass > 0)) return {};
  Vec3 x[4];
  for (size_t k = 0; k < 4; ++k) x[k] = vector_at(s.rows.data() + 8 * size_t{near.rows[k]});
  // a look before the projection: above the middle by more than the face is uneven
  const Vec3 middle = 0.25 * (x[0] + x[1] + x[2] + x[3]), n = cross(x[2] - x[0], x[3] - x[1]);
  const double size = norm(n), above = dot(q.p - middle, n);
  if (above > q.radius * size + std::abs(dot(x[0] - middle, n))) return {};
  const std::optional<Projection> found = project(q.p, x, q.radius, debris);
  if (!found) return {};
  const Projection& on = *found;
  double share = 1;
  if (!on.inside) {
    if (!debris || above < 0) return {};
    share = 0.5;  // two faces have the edge
  }
  const double depth = q.radius - on.height;
  if (!(depth > 0)) return {};
  if (on.height < 0) {
    Vec3 far;
    for (const std::uint32_t row : quad_of(setup, candidate.face ^ 1).rows)
      far += 0.25 * vector_at(s.rows.data() + 8 * size_t{row});
    if (-on.height * size > kFaceDepth * dot(n, middle - far)) return {};
    if (!is_nearest(setup, s, q.p, candidate.face, -on.height)) return {};
  }
  double inverse = q.inverse_mass;
  Vec3 v = q.v;
  SurfaceTouch touch;
  touch.point = candidate.point, touch.face = candidate.face, touch.rows = near.rows;
  if (candidate.point.kind == ContactPoint::Node)
    touch.point_rows[0] = candidate.point.index;
  else if (candidate.point.kind == ContactPoint::Centre)
    touch.point_rows = quad_of(setup, candidate.point.index).rows;
  for (size_t k = 0; k < 4; ++k) {
    const double* r = s.rows.data() + 8 * size_t{near.rows[k]};
    touch.weights[k] = on.weights[k];
    inverse += on.weights[k] * on.weights[k] * r[kernel::kInverseMass];
    v -= on.weights[k] * vector_at(r + kernel::kSpeed);
  }
  double rate = kRate / (h * h * inverse);
  if (debris) rate = std::min(rate, s.particles[candidate.point.index].stiffness);
  calc_forces(depth, on.normal, v, share * rate, inverse, options, h, touch);
  return touch;
}

/// Touches of candidates in the order of points.
void press_points(const ContactSetup& setup, const ExplicitOptions& options, double h, const ExplicitState& s,
                  std::span<const NearCandidate> near, std::vector<SurfaceTouch>& touches) {
  constexpr size_t kAhead = 8;  // corners that lie all over memory
  PointState q;
  std::optional<SurfaceTouch> nearest;  // a point inside bodies goes out by the nearest face alone
  for (size_t i = 0; i < near.size(); ++i) {
    if (i + kAhead < near.size())
      for (const std::uint32_t row : near[i + kAhead].rows) hwy::Prefetch(s.rows.data() + 8 * size_t{row});
    const ContactPoint& point = near[i].candidate.point;
    if (i == 0 || near[i - 1].candidate.point != point) q = find_point(setup, s, point);
    const std::optional<SurfaceTouch> touch = press_face(setup, options, h, s, q, near[i]);
    if (touch && touch->depth <= q.radius)
      touches.push_back(*touch);
    else if (touch && (!nearest || touch->depth < nearest->depth))
      nearest = touch;
    if (nearest && (i + 1 == near.size() || near[i + 1].candidate.point != point))
      touches.push_back(*nearest), nearest.reset();
  }
}

void press_particles(const ExplicitOptions& options, double h, const ExplicitState& s,
                     std::span<const ParticlePair> near, std::vector<SurfaceTouch>& touches) {
  for (const ParticlePair& pair : near) {
    const Particle &a = s.particles[pair[0]], &b = s.particles[pair[1]];
    const Vec3 d = a.p - b.p;
    const double reach = a.radius + b.radius, square = dot(d, d);
    if (square >= reach * reach || !(square > 0)) continue;
    const double distance = std::sqrt(square);
    SurfaceTouch touch;
    touch.point = {ContactPoint::Debris, pair[0]}, touch.other = pair[1] + 1;
    calc_forces(reach - distance, (1 / distance) * d, a.v - b.v, std::min(a.stiffness, b.stiffness),
                1 / a.mass + 1 / b.mass, options, h, touch);
    touches.push_back(touch);
  }
}

/// What touches of a task exert, by the share that adds it up: neighbouring rows and particles belong to one.
void list_pushes(const ExplicitState& s, const std::vector<SurfaceTouch>& touches, ContactPushes& pushes) {
  for (auto& share : pushes.shares) share.rows.clear(), share.particles.clear();
  const auto push = [&](std::uint32_t row, const Vec3& force) {
    pushes.shares[row / 64 % kContactShares].rows.push_back({force, row});
  };
  const auto press = [&](std::uint32_t number, const SurfaceTouch& touch, double rate, const Vec3& force) {
    const double crushed = rate > 0 ? s.particles[number].calc_crushed(rate, touch.depth) : 0;
    pushes.shares[number / 16 % kContactShares].particles.push_back({force, crushed, number});
  };
  for (const SurfaceTouch& touch : touches) {
    const Vec3 force = touch.normal_force + touch.friction;
    const double rate = touch.depth > 0 ? 2 * touch.stored / (touch.depth * touch.depth) : 0;
    if (touch.point.kind == ContactPoint::Debris)
      press(touch.point.index, touch, rate, force);
    else if (touch.point.kind == ContactPoint::Node)
      push(touch.point_rows[0], force);
    else
      for (const std::uint32_t row : touch.point_rows) push(row, 0.25 * force);
    if (touch.other > 0)
      press(touch.other - 1, touch, rate, -force);
    else
      for (size_t k = 0; k < 4; ++k) push(touch.rows[k], -touch.weights[k] * force);
  }
}

}  // namespace

void press_surfaces(ExplicitSystem::Inside& in, ExplicitState& s) {
  ContactState& c = s.contact;
  const std::vector<NearCandidate>& near = c.near;
  // their number depends on nothing else, so that sums over them are always the same
  const size_t pairs = c.near_particles.size(), tasks = std::clamp<size_t>((near.size() + pairs) / 256, 1, 16);
  // all candidates of a point belong to one task
  const auto begin_of = [&](size_t task) {
    size_t i = near.size() * task / tasks;
    while (i > 0 && i < near.size() && near[i].candidate.point == near[i - 1].candidate.point) ++i;
    return i;
  };
  c.touches.resize(tasks);
  if (in.contact_pushes.size() < tasks) in.contact_pushes.resize(tasks);
  in.team->run(tasks, [&](size_t task) {
    std::vector<SurfaceTouch>& touches = c.touches[task];
    touches.clear();
    const size_t first = begin_of(task), last = begin_of(task + 1);
    press_points(in.contact, in.options, in.h, s, std::span(near).subspan(first, last - first), touches);
    const size_t from = pairs * task / tasks, to = pairs * (task + 1) / tasks;
    press_particles(in.options, in.h, s, std::span(c.near_particles).subspan(from, to - from), touches);
    list_pushes(s, touches, in.contact_pushes[task]);
  });
  // each share adds what falls to its rows and particles, in the order of touches whoever does it
  std::array<std::vector<std::uint32_t>, kContactShares> pushed;
  const auto add_up = [&](size_t share) {
    for (size_t task = 0; task < tasks; ++task) {
      const ContactPushes::Share& from = in.contact_pushes[task].shares[share];
      for (const auto& [force, row] : from.rows) in.push(s, row, force, pushed[share]);
      for (const auto& [force, crushed, number] : from.particles) {
        Particle& particle = s.particles[number];
        particle.crushed = std::max(particle.crushed, crushed);
        particle.force += force, particle.touched = 1;
      }
    }
  };
  if (tasks > 1)
    in.team->run(kContactShares, add_up);
  else
    for (size_t share = 0; share < kContactShares; ++share) add_up(share);
  for (const auto& rows : pushed) s.pushed.insert(s.pushed.end(), rows.begin(), rows.end());
}

namespace {

/// Of a touch's point.
Vec3 find_speed(const ExplicitState& s, const SurfaceTouch& touch) {
  const auto of_row = [&](std::uint32_t row) { return vector_at(s.rows.data() + 8 * size_t{row} + kernel::kSpeed); };
  if (touch.point.kind == ContactPoint::Debris) return s.particles[touch.point.index].v;
  if (touch.point.kind == ContactPoint::Node) return of_row(touch.point_rows[0]);
  Vec3 v;
  for (const std::uint32_t row : touch.point_rows) v += 0.25 * of_row(row);
  return v;
}

}  // namespace

void book_surfaces(const ExplicitSystem::Inside& in, ExplicitState& s) {
  const auto& touches = s.contact.touches;
  std::vector<ContactWork> work(touches.size());
  in.team->run(touches.size(), [&](size_t task) {
    for (const SurfaceTouch& touch : touches[task]) {
      Vec3 now = find_speed(s, touch);
      if (touch.other > 0) {
        now -= s.particles[touch.other - 1].v;
      } else {
        for (size_t k = 0; k < 4; ++k)
          now -= touch.weights[k] * vector_at(s.rows.data() + 8 * size_t{touch.rows[k]} + kernel::kSpeed);
      }
      const Vec3 path = (0.5 * in.h) * (touch.before + now);
      work[task].normal += dot(touch.normal_force, path);
      work[task].friction += dot(touch.friction, path);
    }
  });
  for (const ContactWork& w : work) s.surface_work.normal += w.normal, s.surface_work.friction += w.friction;
}

}  // namespace topple::fem
