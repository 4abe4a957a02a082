/// Contact with the ground and between bodies (docs/theory/contact.md).
/// A point's normal force is k δ while bodies approach and e² k δ while they part, so that the impulse of restitution
/// is e times that of compression (Poisson). Penetration that was there when contact became possible carries no force.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "mbs/boxes.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kSearchMargin = 0.2;    // [m]; shapes nearer than this are watched
constexpr double kSearchTravel = 0.09;   // [m]; less than half the margin
constexpr long kSearchPause = 80;        // steps between searches that breaks ask for
constexpr double kUnforeseenSpeed = 2;   // [m/s]; what two bodies may gain while they are left alone
constexpr long kLongestRest = 40;        // steps
constexpr double kStickStiffness = 0.3;  // of the restituting normal stiffness
constexpr double kStickDamping = 0.3;    // times mass times contact frequency

/// Share of the full spring rate that acts: 1 while approaching for the whole step, 0 while parting, between them the
/// part of the step before the approach ends under the forces of `points` such contacts.
double approach_share(double speed, double full_force, double inverse_mass, int points, double h) {
  if (speed <= 0) return 0;
  const double after = speed - h * inverse_mass * points * full_force;
  return after >= 0 ? 1 : speed / (speed - after);
}

}  // namespace

void System::find_pairs() {
  State& s = state;
  if (s.search_due && s.last_search != 0 && s.step_index - s.last_search < kSearchPause && !s.p_at_search.empty())
    return;
  s.search_due = false;
  s.last_search = std::max(s.step_index, 1L);
  s.p_at_search = s.p;

  // who holds whom
  std::vector<std::array<int, 2>> links;
  links.reserve(2 * (elements.size() + joints.size()));
  std::fill(s.tied_to_ground.begin(), s.tied_to_ground.end(), 0);
  const auto link = [&](int a, int b) {
    if (a >= 0 && b >= 0) {
      links.push_back({a, b});
      links.push_back({b, a});
    }
    const auto grounded = [&](int x) { return x < 0 || fixed[static_cast<size_t>(x)]; };
    if (grounded(a) && b >= 0) s.tied_to_ground[static_cast<size_t>(b)] = 1;
    if (grounded(b) && a >= 0) s.tied_to_ground[static_cast<size_t>(a)] = 1;
  };
  for (size_t e = 0; e < elements.size(); ++e)
    if (s.element[e].live) link(elements[e].a, elements[e].b);
  for (size_t i = 0; i < forces.bushings.size(); ++i)
    if (s.bushing[i].live) link(forces.bushings[i].a, forces.bushings[i].b);
  for (size_t j = 0; j < joints.size(); ++j)
    if (s.joint[j].live) link(joints[j].parent, joints[j].child);
  std::vector<int> first(B + 1, 0), held(links.size());
  for (const auto& l : links) ++first[static_cast<size_t>(l[0]) + 1];
  for (size_t b = 0; b < B; ++b) first[b + 1] += first[b];
  std::vector<int> filled(first.begin(), first.end() - 1);
  for (const auto& l : links) held[static_cast<size_t>(filled[static_cast<size_t>(l[0])]++)] = l[1];
  const auto holders = [&](int b) {
    const size_t i = static_cast<size_t>(b);
    return std::span<const int>(held.data() + first[i], static_cast<size_t>(first[i + 1] - first[i]));
  };

  if (model.contact.bodies) {
    struct Item {
      Vec3 low, high;
      int body, shape;
    };
    std::vector<Item> items;
    for (size_t b = 0; b < B; ++b)
      for (int i = 0; i < s.body[b].shapes; ++i) {
        const CompiledShape& shape = s.shapes[static_cast<size_t>(s.body[b].first_shape + i)];
        const Vec3 c = s.p[b] + s.R[b] * shape.p_BS;
        Vec3 reach{shape.radius, shape.radius, shape.radius};
        if (shape.kind == Shape::Kind::Box) {
          const Mat3 R = s.R[b] * shape.R_BS;
          for (int k = 0; k < 3; ++k)
            reach[k] =
                std::abs(R(k, 0)) * shape.half.x + std::abs(R(k, 1)) * shape.half.y + std::abs(R(k, 2)) * shape.half.z;
        }
        const Vec3 pad = reach + 0.5 * Vec3{kSearchMargin, kSearchMargin, kSearchMargin};
        items.push_back({c - pad, c + pad, static_cast<int>(b), i});
      }
    // sweep along the axis on which the shapes spread most
    Vec3 mean, spread;
    for (const Item& it : items) mean += (0.5 / static_cast<double>(items.size())) * (it.low + it.high);
    for (const Item& it : items)
      for (int k = 0; k < 3; ++k) spread[k] += std::pow(0.5 * (it.low[k] + it.high[k]) - mean[k], 2);
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    std::vector<std::pair<double, int>> order(items.size());
    for (size_t i = 0; i < items.size(); ++i) order[i] = {items[i].low[axis], static_cast<int>(i)};
    std::sort(order.begin(), order.end());
    using Key = std::array<int, 4>;  // bodies, shapes
    std::vector<Key> found;
    // joined, or joined to the same third body: the joint or element between them governs
    std::vector<int> near(B, -1);  // the last body that the body is near to in this sense
    const auto mark_near = [&](int a) {
      near[static_cast<size_t>(a)] = a;
      for (const int n : holders(a)) {
        near[static_cast<size_t>(n)] = a;
        for (const int m : holders(n)) near[static_cast<size_t>(m)] = a;
      }
    };
    for (size_t i = 0; i < order.size(); ++i) {
      const Item& x = items[static_cast<size_t>(order[i].second)];
      mark_near(x.body);
      for (size_t k = i + 1; k < order.size() && order[k].first <= x.high[axis]; ++k) {
        const Item& y = items[static_cast<size_t>(order[k].second)];
        if (x.body == y.body) continue;
        if (x.low.x > y.high.x || y.low.x > x.high.x || x.low.y > y.high.y || y.low.y > x.high.y ||
            x.low.z > y.high.z || y.low.z > x.high.z)
          continue;
        if (near[static_cast<size_t>(y.body)] == x.body) continue;
        if (fixed[static_cast<size_t>(x.body)] && fixed[static_cast<size_t>(y.body)]) continue;
        found.push_back(x.body < y.body ? Key{x.body, y.body, x.shape, y.shape}
                                        : Key{y.body, x.body, y.shape, x.shape});
      }
    }
    std::sort(found.begin(), found.end());
    // keep what old pairs remember
    std::vector<PairState> pairs(found.size());
    std::vector<long> apart_until(found.size(), 0);
    size_t old = 0;
    const auto key = [](const PairState& p) { return Key{p.a, p.b, p.shape_a, p.shape_b}; };
    for (size_t i = 0; i < found.size(); ++i) {
      PairState& p = pairs[i];
      p.a = found[i][0], p.b = found[i][1], p.shape_a = found[i][2], p.shape_b = found[i][3];
      while (old < s.pairs.size() && key(s.pairs[old]) < found[i]) ++old;
      if (old < s.pairs.size() && key(s.pairs[old]) == found[i]) {
        p = s.pairs[old];
        apart_until[i] = s.pair_apart_until[old];
        s.pairs[old].energy = s.pairs[old].stick_energy = 0;
      }
    }
    for (const PairState& p : s.pairs) {
      s.contact_energy -= p.energy;
      s.stick_energy -= p.stick_energy;
    }
    s.pairs = std::move(pairs);
    s.pair_apart_until = std::move(apart_until);
  }
}

void System::push(size_t b, const Vec3& lever, const Vec3& normal, const Vec3& friction) {
  const Vec3 f = normal + friction, t_friction = cross(lever, friction), t = cross(lever, normal) + t_friction;
  force[b] += f;
  torque[b] += t;
  contact_force[b] += f;
  contact_torque[b] += t;
  friction_force[b] += friction;
  friction_torque[b] += t_friction;
}

void System::add_contact_work(double h) {
  double power = 0, friction = 0;
  for (size_t b = 0; b < B; ++b) {
    const Vec3 &f = contact_force[b], &t = contact_torque[b];
    if ((f == Vec3{} && t == Vec3{}) || fixed[b]) continue;
    const Vec3 v = calc_velocity(b), w = calc_angular_velocity(b);
    power += dot(f, v) + dot(t, w);
    friction += dot(friction_force[b], v) + dot(friction_torque[b], w);
  }
  state.contact_work += 0.5 * h * (state.contact_power + power);
  state.friction_work += 0.5 * h * (state.friction_power + friction);
  state.contact_power = power;
  state.friction_power = friction;
}

void System::evaluate_ground_contact(double h) {
  State& s = state;
  const Contact& c = model.contact;
  const double e2 = c.restitution * c.restitution;
  const Vec3 n = c.normal;
  for (size_t b = 0; b < B; ++b) {
    if (fixed[b] || s.body[b].shapes == 0) continue;
    const BodyConstants& body = s.body[b];
    const bool possible = !s.tied_to_ground[b];
    // far above the ground nothing is remembered but that contact is possible
    const double above = dot(n, s.p[b]) - c.offset - body.radius;
    if (above > 0.05 && possible) continue;
    const double stiffness = body.mass * c.contact_frequency * c.contact_frequency;
    const double stick_stiffness = kStickStiffness * e2 * stiffness;
    const double stick_damping = kStickDamping * body.mass * c.contact_frequency;
    for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
      CompiledShape& shape = s.shapes[static_cast<size_t>(i)];
      const bool box = shape.kind == Shape::Kind::Box;
      const Vec3 centre = s.R[b] * shape.p_BS;
      const Mat3 R = box ? s.R[b] * shape.R_BS : Mat3{};
      if (possible && shape.is_clear) {
        // all its points are known not to touch: they do not as long as it stays above the ground
        const Vec3 down = box ? transpose_times(R, n) : Vec3{};
        const double reach =
            box ? std::abs(down.x) * shape.half.x + std::abs(down.y) * shape.half.y + std::abs(down.z) * shape.half.z
                : shape.radius;
        if (dot(n, s.p[b] + centre) - c.offset > reach) continue;
      }
      shape.is_clear = possible;
      for (int corner = 0; corner < (box ? 8 : 1); ++corner) {
        GroundPoint& g = s.ground_points[static_cast<size_t>(shape.first_corner + corner)];
        const Vec3 r = box ? centre + R * Vec3{corner & 1 ? shape.half.x : -shape.half.x,
                                               corner & 2 ? shape.half.y : -shape.half.y,
                                               corner & 4 ? shape.half.z : -shape.half.z}
                           : centre - shape.radius * n;
        const double penetration = c.offset - dot(n, s.p[b] + r);
        if (!possible) {
          g = {};
          continue;
        }
        if (!g.active) {
          g.active = true;
          g.born = std::max(0.0, penetration);
        }
        g.born = std::max(0.0, std::min(g.born, penetration));
        const double depth = penetration - g.born;
        const Vec3 v = s.v[b] + cross(s.w[b], r);
        const double approach = -dot(n, v);
        const Vec3 v_t = v + approach * n;
        if (g.born > 0 || depth > 0) shape.is_clear = false;
        if (depth <= 0) {
          if (g.touching) {
            s.contact_energy -= 0.5 * e2 * stiffness * g.depth * g.depth;
            s.stick_energy -= 0.5 * stick_stiffness * dot(g.stick, g.stick);
            g.touching = false;
            g.stick = {};
            g.depth = 0;
          }
          continue;
        }
        const Vec3 lever = transpose_times(s.R[b], cross(r, n));
        const double inverse_mass = body.inverse_mass + dot(lever, body.inverse_inertia * lever);
        const double full = stiffness * depth;
        const double share = approach_share(approach, full, inverse_mass, std::max(1, s.contact_count[b]), h);
        const double f = full * (e2 + (1 - e2) * share);

        const double limit = c.friction * f;
        Vec3 stick = g.touching ? g.stick + h * v_t : Vec3{};
        stick -= dot(n, stick) * n;
        Vec3 ft = -(stick_stiffness * stick + stick_damping * v_t);
        const double magnitude = norm(ft);
        if (magnitude > limit) {
          ft *= limit / magnitude;
          // the spring follows: it holds what friction can hold
          stick = stick_stiffness > 0
                      ? (-1 / stick_stiffness) * (ft + std::min(1.0, limit / magnitude) * stick_damping * v_t)
                      : Vec3{};
        }
        s.contact_energy += 0.5 * e2 * stiffness * (depth * depth - g.depth * g.depth);
        s.stick_energy += 0.5 * stick_stiffness * (dot(stick, stick) - dot(g.stick, g.stick));

        g.depth = depth;
        g.stick = stick;
        ++contact_count[b];
        if (!g.touching) {
          g.touching = true;
          if (!s.touched_ground[b]) {
            s.touched_ground[b] = 1;
            say({Happening::Kind::GroundContact, s.time, static_cast<int>(b), -1, {}, std::max(0.0, approach)});
          }
        }
        push(b, r, f * n, ft);
        ground_contact += f * n + ft;
      }
    }
  }
}

void System::evaluate_body_contact(double h) {
  State& s = state;
  const Contact& c = model.contact;
  const double e2 = c.body_restitution * c.body_restitution;
  if (s.p_at_search.size() == B) {
    for (size_t b = 0; b < B && !s.search_due; ++b) {
      const Vec3 d = s.p[b] - s.p_at_search[b];
      // rotation moves a shape's far end as well
      const double turned = norm(s.w[b]) * s.body[b].radius * h * static_cast<double>(s.step_index - s.last_search);
      if (norm(d) + turned > kSearchTravel) {
        s.search_due = true;
        s.last_search = 0;  // not to be put off
      }
    }
  }
  // each shape where it is now, at most once a step
  solids.resize(s.shapes.size());
  solid_step.resize(s.shapes.size(), -1);
  const auto solid_of = [&](size_t body, int shape) -> const Solid& {
    const size_t i = static_cast<size_t>(s.body[body].first_shape + shape);
    if (solid_step[i] != s.step_index) {
      solid_step[i] = s.step_index;
      const CompiledShape& c_shape = s.shapes[i];
      solids[i] = {c_shape.kind,
                   s.p[body] + s.R[body] * c_shape.p_BS,
                   s.R[body] * c_shape.R_BS,
                   c_shape.half,
                   c_shape.radius,
                   c_shape.kind == Shape::Kind::Box ? norm(c_shape.half) : c_shape.radius};
    }
    return solids[i];
  };
  BoxContact points;
  for (size_t number_of_pair = 0; number_of_pair < s.pairs.size(); ++number_of_pair) {
    if (s.step_index < s.pair_apart_until[number_of_pair]) continue;
    PairState& pair = s.pairs[number_of_pair];
    const size_t a = static_cast<size_t>(pair.a), b = static_cast<size_t>(pair.b);
    const Solid &A = solid_of(a, pair.shape_a), &Bb = solid_of(b, pair.shape_b);
    const double reach = A.reach + Bb.reach;
    points.count = 0;
    if (const double distance2 = dot(Bb.p - A.p, Bb.p - A.p); distance2 < reach * reach) {
      find_contact(A, Bb, pair.axis, points);
    } else {
      points.gap = std::sqrt(distance2) - reach;
    }
    if (points.count == 0 && points.gap > 0 && pair.seen && !pair.touching && h > 0) {
      // nothing to do until they can have met
      const double closing = norm(s.v[a] - s.v[b]) + norm(s.w[a]) * s.body[a].radius + norm(s.w[b]) * s.body[b].radius;
      const double steps = points.gap / ((closing + kUnforeseenSpeed) * h);
      s.pair_apart_until[number_of_pair] = s.step_index + std::min(kLongestRest, static_cast<long>(steps));
      pair.born = 0;
      continue;
    }
    double deepest = 0;
    for (int i = 0; i < points.count; ++i) deepest = std::max(deepest, points.depth[i]);
    if (!pair.seen) {
      pair.seen = true;
      pair.born = deepest;
    }
    pair.born = std::min(pair.born, deepest);
    double stored = 0, stick_stored = 0;
    bool touching = false;
    if (points.count > 0 && deepest > pair.born) {
      const double wa = s.body[a].inverse_mass, wb = s.body[b].inverse_mass;
      const double reduced = 1 / (wa + wb);
      // shared among the points, so that a change of their number is no jolt
      const double stiffness = reduced * c.contact_frequency * c.contact_frequency / points.count;
      const int others = std::max({points.count, fixed[a] ? 0 : s.contact_count[a], fixed[b] ? 0 : s.contact_count[b]});
      const Vec3 n = points.normal;  // from a to b
      struct Point {
        Vec3 ra, rb, v_t;
        double normal_force, inverse_mass, approach;
      };
      Point found[8];  // written before it is read
      int count = 0;
      double total_force = 0;
      Vec3 slide;  // velocity of a against b in the plane of contact, weighted by the normal forces
      for (int i = 0; i < points.count; ++i) {
        const double depth = points.depth[i] - pair.born;
        if (depth <= 0) continue;
        Point& p = found[count++];
        p.ra = points.p[i] - s.p[a];
        p.rb = points.p[i] - s.p[b];
        const Vec3 v = s.v[a] + cross(s.w[a], p.ra) - s.v[b] - cross(s.w[b], p.rb);
        p.approach = dot(n, v);
        p.v_t = v - p.approach * n;
        const Vec3 la = transpose_times(s.R[a], cross(p.ra, n)), lb = transpose_times(s.R[b], cross(p.rb, n));
        p.inverse_mass = wa + wb + dot(la, s.body[a].inverse_inertia * la) + dot(lb, s.body[b].inverse_inertia * lb);
        const double full = stiffness * depth;
        p.normal_force = full * (e2 + (1 - e2) * approach_share(p.approach, full, p.inverse_mass, others, h));
        total_force += p.normal_force;
        slide += p.normal_force * p.v_t;
        stored += 0.5 * e2 * stiffness * depth * depth;
      }
      // Coulomb friction: a spring that sticks until the limit, and viscous below it, though never more than brings all
      // the points to rest within two steps
      const double stick_stiffness = kStickStiffness * e2 * stiffness * points.count;
      if (!pair.touching) pair.stick = {};
      if (total_force > 0) pair.stick += (h / total_force) * slide;
      pair.stick -= dot(pair.stick, n) * n;
      const double held = stick_stiffness * norm(pair.stick), most = c.body_friction * total_force;
      if (held > most) pair.stick *= most / held;
      stick_stored = 0.5 * stick_stiffness * dot(pair.stick, pair.stick);
      for (int i = 0; i < count; ++i) {
        const Point& p = found[i];
        double viscous = 0.5 * reduced * c.contact_frequency;
        if (h > 0) viscous = std::min(viscous, 0.5 / (h * p.inverse_mass * others));
        Vec3 t = -(stick_stiffness * p.normal_force / total_force) * pair.stick - viscous * p.v_t;
        if (const double size = norm(t), limit = c.body_friction * p.normal_force; size > limit) t *= limit / size;
        const Vec3 normal = -p.normal_force * n, total = normal + t;  // on a
        push(a, p.ra, normal, t);
        push(b, p.rb, -normal, -t);
        if (fixed[a]) ground_contact -= total;
        if (fixed[b]) ground_contact += total;
        touching = true;
        ++body_contacts;
        ++contact_count[a];
        ++contact_count[b];
        if (!pair.touching) {
          const long number = static_cast<long>(pair.a) * static_cast<long>(B) + pair.b;
          const auto at = std::lower_bound(s.touched_pairs.begin(), s.touched_pairs.end(), number);
          if (at == s.touched_pairs.end() || *at != number) {
            s.touched_pairs.insert(at, number);
            say({Happening::Kind::BodyContact, s.time, pair.a, pair.b, {}, std::max(0.0, p.approach)});
          }
          pair.touching = true;
        }
      }
    }
    if (!touching) pair.stick = {};
    s.contact_energy += stored - pair.energy;
    s.stick_energy += stick_stored - pair.stick_energy;
    pair.energy = stored;
    pair.stick_energy = stick_stored;
    pair.touching = touching;
  }
}

}  // namespace topple::mbs
