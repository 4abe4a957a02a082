#include "fem/segment_contact.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "fem/contact_lanes.h"
#include "fem/explicit_inside.h"

namespace topple::fem {

namespace {

/// Of the mass felt: what a dashpot of friction stops in a step.
constexpr double kGrip = 0.02;

struct Quad {
  std::array<std::uint32_t, 4> rows;
};
Quad quad_of(const ContactSetup& setup, std::uint32_t face) {
  Quad q{};
  for (size_t k = 0; k < 4; ++k) q.rows[k] = setup.rows_of_element[face / 6][static_cast<size_t>(kFaces[face % 6][k])];
  return q;
}

/// A point as it is now.
void set_point(const ContactSetup& setup, const ExplicitState& s, const ContactPoint& point, lanes::Point& q) {
  if (point.kind == ContactPoint::Debris) {
    const Particle& particle = s.particles[point.index];
    q.p = particle.p, q.v = particle.v, q.inverse_mass = 1 / particle.mass, q.radius = particle.radius;
  } else if (point.kind == ContactPoint::Node) {
    const double* r = s.rows.data() + 8 * size_t{point.index};
    q.p = vector_at(r), q.v = vector_at(r + kernel::kSpeed), q.inverse_mass = r[kernel::kInverseMass];
  } else {
    q.p = q.v = {}, q.inverse_mass = 0;
    for (const std::uint32_t row : quad_of(setup, point.index).rows) {
      const double* r = s.rows.data() + 8 * size_t{row};
      q.p += 0.25 * vector_at(r), q.v += 0.25 * vector_at(r + kernel::kSpeed);
      q.inverse_mass += r[kernel::kInverseMass] / 16;
    }
  }
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

/// Whether a point behind a face is in the face's element and leaves it there.
bool is_inside(const ContactSetup& setup, const ExplicitState& s, const Vec3& p, const NearCandidate& near,
               double height) {
  Vec3 x[4], far;
  for (size_t k = 0; k < 4; ++k) x[k] = vector_at(s.rows.data() + 8 * size_t{near.rows[k]});
  for (const std::uint32_t row : quad_of(setup, near.candidate.face ^ 1).rows)
    far += 0.25 * vector_at(s.rows.data() + 8 * size_t{row});
  const Vec3 middle = 0.25 * (x[0] + x[1] + x[2] + x[3]), n = cross(x[2] - x[0], x[3] - x[1]);
  if (-height * norm(n) > kFaceDepth * dot(n, middle - far)) return false;
  return is_nearest(setup, s, p, near.candidate.face, -height);
}

/// Candidates side by side, points once; for all steps until the next look.
void list_faces(const ContactSetup& setup, const ExplicitOptions& options, const ExplicitState& s,
                std::span<const NearCandidate> near, ContactTask& task) {
  lanes::Faces& faces = task.faces;
  faces.points.clear(), faces.number.clear(), faces.point.clear(), task.points.clear();
  for (auto& rows : faces.corners) rows.clear();
  for (size_t i = 0; i < near.size(); ++i) {
    const ContactPoint& point = near[i].candidate.point;
    const bool is_ball = point.kind == ContactPoint::Debris;
    if (!is_ball && !setup.enabled) continue;
    if (task.points.empty() || task.points.back() != point) {
      lanes::Point& q = faces.points.emplace_back();
      if (is_ball)
        q.ball = 1, q.stiffness = s.particle_makes[point.index].stiffness,
        q.bears = s.particle_makes[point.index].bears;
      q.damping = is_ball ? options.debris_damping : options.contact_damping;
      task.points.push_back(point);
    }
    faces.number.push_back(static_cast<std::uint32_t>(i));
    faces.point.push_back(static_cast<std::uint32_t>(task.points.size() - 1));
    for (size_t k = 0; k < 4; ++k) faces.corners[k].push_back(near[i].rows[k]);
  }
}

/// Touches of candidates in the order of points.
void press_points(const ContactSetup& setup, const ExplicitOptions& options, double h, const ExplicitState& s,
                  std::span<const NearCandidate> near, ContactTask& task) {
  constexpr size_t kAhead = 8;  // points that lie all over memory
  constexpr size_t kRun = 256;  // candidates whose touches stay in the cache
  const ContactState& c = s.contact;
  lanes::Faces& faces = task.faces;
  for (size_t i = 0; i < task.points.size(); ++i) {
    if (i + kAhead < task.points.size() && task.points[i + kAhead].kind == ContactPoint::Debris)
      hwy::Prefetch(&s.particles[task.points[i + kAhead].index]);
    set_point(setup, s, task.points[i], faces.points[i]);
  }
  const auto add = [&](const lanes::Touch& t) {
    FaceTouch& touch = task.faces_touched.emplace_back();
    touch.normal_force = t.normal_force, touch.friction = t.friction;
    std::copy_n(t.weights, 4, touch.weights);
    touch.crushed = t.crushed, touch.rows = near[faces.number[t.candidate]].rows;
    touch.point = task.points[faces.point[t.candidate]];
    task.sums.stored += t.stored;
    if (!task.is_debris) {
      task.sums.normal += t.normal, task.sums.friction += t.rubbing;
      return;
    }
    const Vec3& v = faces.points[faces.point[t.candidate]].v;
    task.sums.normal += dot(t.normal_force, v), task.sums.friction += dot(t.friction, v);
  };
  // elements may have gone since the look
  const auto is_there = [&](const lanes::Touch& t) {
    if (c.removed.empty()) return true;
    const std::uint32_t number = faces.point[t.candidate];
    const ContactPoint& point = task.points[number];
    if (point.kind == ContactPoint::Centre && c.gone[point.index / 6] != 0) return false;
    return faces.points[number].inverse_mass > 0 && c.gone[near[faces.number[t.candidate]].candidate.face / 6] == 0;
  };
  const lanes::Setup lanes_setup{s.rows.data(), h, options.friction, kTouchRate, kGrip};
  for (size_t first = 0; first < faces.point.size();) {
    size_t last = std::min(first + kRun, faces.point.size());
    while (last < faces.point.size() && faces.point[last] == faces.point[last - 1]) ++last;
    lanes::press_faces(lanes_setup, faces, first, last, task.found);
    first = last;
    const lanes::Touch* nearest = nullptr;  // a point inside bodies goes out by the nearest face alone
    for (size_t i = 0; i < task.found.size(); ++i) {
      const lanes::Touch& t = task.found[i];
      const std::uint32_t number = faces.point[t.candidate];
      const lanes::Point& q = faces.points[number];
      if (is_there(t) && (!(t.height < 0) || is_inside(setup, s, q.p, near[faces.number[t.candidate]], t.height))) {
        if (t.depth <= q.radius)
          add(t);
        else if (nearest == nullptr || t.depth < nearest->depth)
          nearest = &t;
      }
      const bool is_last = i + 1 == task.found.size() || faces.point[task.found[i + 1].candidate] != number;
      if (is_last && nearest != nullptr) add(*nearest), nearest = nullptr;
    }
  }
}

void press_particles(const ExplicitOptions& options, double h, const ExplicitState& s,
                     std::span<const ParticlePair> near, ContactTask& task) {
  constexpr size_t kAhead = 8;
  task.particles.resize(near.size());
  size_t touching = 0;
  for (size_t i = 0; i < near.size(); ++i) {
    if (i + kAhead < near.size())
      for (const std::uint32_t number : near[i + kAhead]) hwy::Prefetch(&s.particles[number]);
    const Particle &a = s.particles[near[i][0]], &b = s.particles[near[i][1]];
    const Vec3 d = a.p - b.p;
    const double reach = a.radius + b.radius, square = dot(d, d);
    // every second one does, so no branch
    task.particles[touching] = near[i];
    touching += static_cast<size_t>((square < reach * reach) & (square > 0));
    for (const std::uint32_t number : near[i]) hwy::Prefetch(&s.particle_makes[number]);
  }
  task.particles.resize(touching);
  const lanes::ParticleSetup setup{s.particles.data(), s.particle_makes.data(), h,
                                   options.friction,   options.debris_damping,  kGrip};
  lanes::press_particles(setup, task.particles, task.particles_touched, task.sums);
}

/// Forces of debris on nodes, until its next ones.
void list_held(ExplicitSystem::Inside& in, ExplicitState& s) {
  std::vector<std::uint32_t>& place = in.held_place;
  place.resize(s.flags.size(), 0);
  s.held.clear();
  for (const ContactTask& task : in.contact_tasks) {
    if (!task.is_debris) continue;
    for (const FaceTouch& touch : task.faces_touched)
      for (size_t k = 0; k < 4; ++k) {
        std::uint32_t& at = place[touch.rows[k]];
        if (at == 0) s.held.push_back({{}, {}, touch.rows[k]}), at = static_cast<std::uint32_t>(s.held.size());
        HeldPush& held = s.held[at - 1];
        held.normal_force += -touch.weights[k] * touch.normal_force;
        held.friction += -touch.weights[k] * touch.friction;
      }
  }
  for (const HeldPush& held : s.held) place[held.row] = 0;
}
/// Calls body(held) for all, with work of so many steps at the present speeds: half where forces begin and end.
template <class Body>
void for_held(const ExplicitSystem::Inside& in, ExplicitState& s, double steps, const Body& body) {
  constexpr size_t kAhead = 8;  // rows that lie all over memory
  double normal = 0, friction = 0;
  for (size_t i = 0; i < s.held.size(); ++i) {
    if (i + kAhead < s.held.size()) {
      const size_t row = s.held[i + kAhead].row;
      hwy::Prefetch(s.rows.data() + 8 * row), hwy::Prefetch(s.pushes.data() + 4 * row);
    }
    const HeldPush& held = s.held[i];
    const Vec3 v = vector_at(s.rows.data() + 8 * size_t{held.row} + kernel::kSpeed);
    normal += dot(held.normal_force, v), friction += dot(held.friction, v);
    body(held);
  }
  s.held_work.normal += steps * in.h * normal, s.held_work.friction += steps * in.h * friction;
}

}  // namespace

void press_surfaces(ExplicitSystem::Inside& in, ExplicitState& s, bool debris) {
  ContactState& c = s.contact;
  const std::span<const NearCandidate> near = c.near;
  const size_t pairs = c.near_particles.size();
  const auto is_surface = [](const NearCandidate& n) { return n.candidate.point.kind != ContactPoint::Debris; };
  const auto surfaces = static_cast<size_t>(std::partition_point(near.begin(), near.end(), is_surface) - near.begin());
  // their numbers depend on nothing else, so that sums over them are always the same
  const auto tasks_of = [](size_t work) { return work > 0 ? std::clamp<size_t>(work / 256, 1, 16) : 0; };
  const size_t first_debris = tasks_of(surfaces);
  const size_t tasks = first_debris + (debris ? tasks_of(near.size() - surfaces + pairs) : 0);
  in.contact_room.resize(std::max(tasks, in.contact_room.size()));
  in.contact_tasks = std::span(in.contact_room).first(tasks);
  in.team->run(tasks, [&](size_t number) {
    ContactTask& task = in.contact_tasks[number];
    task.faces_touched.clear(), task.particles_touched.clear(), task.sums = {};
    task.is_debris = number >= first_debris;
    const std::span<const NearCandidate> mine = task.is_debris ? near.subspan(surfaces) : near.first(surfaces);
    const size_t place = task.is_debris ? number - first_debris : number;
    const size_t shares = task.is_debris ? tasks - first_debris : first_debris;
    // all candidates of a point belong to one task
    const auto begin_of = [&](size_t share) {
      size_t i = mine.size() * share / shares;
      while (i > 0 && i < mine.size() && mine[i].candidate.point == mine[i - 1].candidate.point) ++i;
      return i;
    };
    const size_t first = begin_of(place), last = begin_of(place + 1);
    const std::span<const NearCandidate> candidates = mine.subspan(first, last - first);
    if (c.look == 0 || task.look != c.look) list_faces(in.contact, in.options, s, candidates, task);
    task.look = c.look;
    press_points(in.contact, in.options, in.h, s, candidates, task);
    if (task.is_debris) {
      const size_t from = pairs * place / shares, to = pairs * (place + 1) / shares;
      press_particles(in.options, in.h, s, std::span(c.near_particles).subspan(from, to - from), task);
    }
    task.sums.count = static_cast<long long>(task.faces_touched.size() + task.particles_touched.size());
  });
  c.touching = {};
  if (debris) c.debris = {};
  c.debris.normal = c.debris.friction = 0;
  for (const ContactTask& task : in.contact_tasks) (task.is_debris ? c.debris : c.touching) += task.sums;
  c.debris.normal *= in.debris_steps, c.debris.friction *= in.debris_steps;
  // faces first, then pairs of particles: an order that the number of tasks does not change
  constexpr size_t kAhead = 8;  // rows and particles that lie all over memory
  const auto push_rows = [&] {
    if (debris) {
      for_held(in, s, 0.5, [](const HeldPush&) {});
      list_held(in, s);
    }
    for_held(in, s, debris ? 0.5 : 1,
             [&](const HeldPush& held) { in.push(s, held.row, held.normal_force + held.friction); });
    for (const ContactTask& task : in.contact_tasks.first(first_debris))
      for (size_t i = 0; i < task.faces_touched.size(); ++i) {
        if (i + kAhead < task.faces_touched.size())
          for (const std::uint32_t row : task.faces_touched[i + kAhead].rows)
            hwy::Prefetch(s.pushes.data() + 4 * size_t{row}), hwy::Prefetch(s.flags.data() + row);
        const FaceTouch& touch = task.faces_touched[i];
        const Vec3 force = touch.normal_force + touch.friction;
        if (touch.point.kind == ContactPoint::Node)
          in.push(s, touch.point.index, force);
        else
          for (const std::uint32_t row : quad_of(in.contact, touch.point.index).rows) in.push(s, row, 0.25 * force);
        for (size_t k = 0; k < 4; ++k) in.push(s, touch.rows[k], -touch.weights[k] * force);
      }
  };
  const auto push_particles = [&] {
    const auto push = [&](std::uint32_t number, const Vec3& force, double crushed) {
      ParticlePush& to = s.particle_pushes[number];
      to.crushed = std::max({0.0, to.crushed, crushed}), to.force += force;
    };
    for (const ContactTask& task : in.contact_tasks.last(tasks - first_debris))
      for (const FaceTouch& touch : task.faces_touched)
        push(touch.point.index, touch.normal_force + touch.friction, touch.crushed);
    for (const ContactTask& task : in.contact_tasks)
      for (size_t i = 0; i < task.particles_touched.size(); ++i) {
        if (i + kAhead < task.particles_touched.size())
          for (const std::uint32_t number : task.particles_touched[i + kAhead].pair)
            hwy::Prefetch(&s.particle_pushes[number]);
        const ParticleTouch& touch = task.particles_touched[i];
        const Vec3 force = touch.normal_force + touch.friction;
        push(touch.pair[0], force, touch.crushed[0]), push(touch.pair[1], -force, touch.crushed[1]);
      }
  };
  if (c.touching.count + (debris ? c.debris.count : 0) < 256)
    push_rows(), push_particles();
  else
    in.team->run(2, [&](size_t task) { task == 0 ? push_rows() : push_particles(); });
}

void book_surfaces(const ExplicitSystem::Inside& in, ExplicitState& s) {
  const std::span<const ContactTask> tasks = in.contact_tasks;
  std::vector<ContactWork> work(tasks.size());
  const auto speed_of = [&](std::uint32_t row) { return vector_at(s.rows.data() + 8 * size_t{row} + kernel::kSpeed); };
  in.team->run(tasks.size(), [&](size_t number) {
    const ContactTask& task = tasks[number];
    double normal = task.sums.normal, friction = task.sums.friction;  // at the speeds before, then at both
    constexpr size_t kAhead = 8;                                      // rows that lie all over memory
    for (size_t i = 0; i < task.faces_touched.size(); ++i) {
      const FaceTouch& touch = task.faces_touched[i];
      if (task.is_debris) {  // what is held on faces is booked as it goes
        const Vec3& v = s.particles[touch.point.index].v;
        normal += dot(touch.normal_force, v), friction += dot(touch.friction, v);
        continue;
      }
      if (i + kAhead < task.faces_touched.size())
        for (const std::uint32_t row : task.faces_touched[i + kAhead].rows)
          hwy::Prefetch(s.rows.data() + 8 * size_t{row});
      Vec3 v;
      if (touch.point.kind == ContactPoint::Node)
        v = speed_of(touch.point.index);
      else
        for (const std::uint32_t row : quad_of(in.contact, touch.point.index).rows) v += 0.25 * speed_of(row);
      for (size_t k = 0; k < 4; ++k) v -= touch.weights[k] * speed_of(touch.rows[k]);
      normal += dot(touch.normal_force, v), friction += dot(touch.friction, v);
    }
    for (const ParticleTouch& touch : task.particles_touched) {
      const Vec3 v = s.particles[touch.pair[0]].v - s.particles[touch.pair[1]].v;
      normal += dot(touch.normal_force, v), friction += dot(touch.friction, v);
    }
    const double half = 0.5 * (task.is_debris ? in.debris_step() : in.h);
    work[number].normal = half * normal, work[number].friction = half * friction;
  });
  for (const ContactWork& w : work) s.surface_work.normal += w.normal, s.surface_work.friction += w.friction;
}

}  // namespace topple::fem
