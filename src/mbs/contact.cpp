/// Forces at touching points (docs/theory/contact.md): springs first, then dashpots, then friction. Each stage sees the
/// speeds that the ones before it leave, and within a stage no point sees another, so the order of points does not
/// count.

#include "mbs/contact.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kStickStiffness = 1.2;  // of the mean normal stiffness of a corner
constexpr double kSlideZeta = 100;       // friction below its limit is a dashpot of this share

/// How much of its explicit force a dashpot has that would slow its own motion at the rate ρ, and the time within the
/// step whose speed it sees: at small h ρ the middle, at large the end.
struct Damper {
  double at, share;
  explicit Damper(double g) : at((1 + g) / (2 + g)), share(1 / (1 + at * g)) {}
};

/// Sum of forces at the points of a group, and what it does.
struct Wrench {
  Vec3 force, torque_a, torque_b;  // on a; on b the opposite, torques about the mass centres

  void add(const ContactPoint& p, const Vec3& f) {
    force += f;
    torque_a += cross(p.ra, f);
    torque_b += cross(p.rb, f);
  }
  void add_normal(const ContactPoint& p, double f) {
    torque_a -= f * p.la;
    torque_b -= f * p.lb;
  }
  /// The force times the speed that it makes, the groups of a body sharing its mass.
  double calc_mobility(const ContactBody& a, const ContactBody& b) const {
    return a.groups * (a.inverse_mass * dot(force, force) + dot(torque_a, a.inverse_inertia * torque_a)) +
           b.groups * (b.inverse_mass * dot(force, force) + dot(torque_b, b.inverse_inertia * torque_b));
  }
  void push(ContactBody& a, ContactBody& b) const {
    a.force += force;
    a.torque += torque_a;
    b.force -= force;
    b.torque -= torque_b;
  }
};

/// Of a against b, half a step ago.
Vec3 point_speed(const ContactPoint& p, const ContactBody& a, const ContactBody& b) {
  return a.v + cross(a.w, p.ra) - b.v - cross(b.w, p.rb);
}

/// What the forces known so far add to it within the step.
Vec3 point_change(const ContactPoint& p, const ContactBody& a, const ContactBody& b) {
  return a.dv + cross(a.dw, p.ra) - b.dv - cross(b.dw, p.rb);
}

/// Shortens a vector to `most`; gives its length then.
double limit(Vec3& f, double most) {
  const double size = norm(f);
  if (size <= most) return size;
  f *= most / size;
  return most;
}

}  // namespace

void System::compile_contact() {
  const Contact& c = model.contact;
  contact_laws = {make_contact_law(c.restitution, c.friction), make_contact_law(c.body_restitution, c.body_friction)};
  ground_law.assign(B, 0);
  for (const Contact::Pair& p : c.pairs) {
    const int law = static_cast<int>(contact_laws.size());
    contact_laws.push_back(make_contact_law(p));
    if (p.b == kGround) {
      ground_law[static_cast<size_t>(p.a.index)] = law;
    } else if (p.a == kGround) {
      ground_law[static_cast<size_t>(p.b.index)] = law;
    } else {
      pair_rules.push_back({std::min(p.a.index, p.b.index), std::max(p.a.index, p.b.index), law});
    }
  }
  std::sort(pair_rules.begin(), pair_rules.end());
  contact.body.assign(B + 1, {});
}

double System::calc_contact_frequency() const {
  const Contact& c = model.contact;
  const double usual = c.contact_frequency * c.contact_frequency;
  double most = 0;
  if (c.ground) most = contact_laws[0].mean * usual;
  if (c.bodies) most = std::max(most, contact_laws[1].mean * usual);
  for (size_t i = 0; i < c.pairs.size(); ++i) {
    const Contact::Pair& p = c.pairs[i];
    if (!p.touches || !(p.b == kGround || p.a == kGround ? c.ground : c.bodies)) continue;
    double inverse_mass = 0;
    for (const BodyId id : {p.a, p.b})
      if (id != kGround) inverse_mass += state.body[static_cast<size_t>(id.index)].inverse_mass;
    most = std::max(most, contact_laws[2 + i].mean * (p.stiffness > 0 ? p.stiffness * inverse_mass : usual));
  }
  return std::sqrt(most);
}

int System::find_pair_law(int a, int b) const {
  if (pair_rules.empty()) return 1;
  const PairRule wanted{std::min(a, b), std::max(a, b), 0};
  const auto at = std::lower_bound(pair_rules.begin(), pair_rules.end(), wanted);
  return at != pair_rules.end() && at->a == wanted.a && at->b == wanted.b ? at->law : 1;
}

void System::evaluate_contact(double h) {
  for (const int b : contact.touched) contact.body[static_cast<size_t>(b)].groups = 0;
  contact.touched.clear();
  contact.point.clear();
  contact.group.clear();
  contact.body[B].force = {};
  contact.body[B].groups = 0;
  add_travel(h);
  if (model.contact.ground) find_ground_points();
  if (model.contact.bodies) find_pair_points();
  resolve_contacts(h);
}

void System::add_contact_point(const Vec3& ra, const Vec3& rb, double depth, double stiffness) {
  ContactPoint& p = contact.point.emplace_back();
  p.ra = ra, p.rb = rb;
  p.depth = depth;
  p.stiffness = stiffness;
}

void System::add_contact_group(size_t a, size_t b, const Vec3& n, size_t first, const ContactLaw& law, double stiffness,
                               StickRange& sticks) {
  for (const size_t i : {a, b}) {
    ContactBody& c = contact.body[i];
    if (c.groups++ > 0 || i == B) continue;
    c.force = c.torque = c.dv = c.dw = {};
    contact.touched.push_back(static_cast<int>(i));
    if (fixed[i]) continue;
    const State& s = state;
    c.v = s.v[i];
    c.w = s.w[i];
    c.inverse_mass = s.body[i].inverse_mass;
    c.inverse_inertia = calc_world_inverse_inertia(i);
  }
  const size_t count = contact.point.size() - first;
  for (ContactPoint& p : std::span(contact.point).subspan(first)) {
    double least = kUnlimited;
    for (int i = sticks.first; i < sticks.first + sticks.count; ++i) {
      const Stick& stick = state.sticks[static_cast<size_t>(i)];
      const Vec3 d = stick.at - p.ra;
      if (const double distance2 = dot(d, d); distance2 < least) {
        least = distance2;
        p.slip = stick.slip;
        p.is_fresh = false;
      }
    }
  }
  sticks = {static_cast<int>(first), static_cast<int>(count)};
  contact.group.push_back(
      {static_cast<int>(a), static_cast<int>(b), static_cast<int>(first), static_cast<int>(count), n, &law, stiffness});
}

void System::resolve_contacts(double h) {
  State& s = state;
  s.contact_energy = s.stick_energy = 0;
  const auto each_group = [&](auto&& f) {
    for (ContactGroup& g : contact.group)
      f(g, std::span(contact.point).subspan(static_cast<size_t>(g.first), static_cast<size_t>(g.count)),
        contact.body[static_cast<size_t>(g.a)], contact.body[static_cast<size_t>(g.b)]);
  };
  // what all forces known so far add to the speeds within the step
  const auto update_speeds = [&] {
    for (const int i : contact.touched) {
      const size_t b = static_cast<size_t>(i);
      if (fixed[b]) continue;
      ContactBody& c = contact.body[b];
      c.dv = h * (c.inverse_mass * (force[b] + joint_force[b] + c.force) + model.gravity);
      c.dw = h * (c.inverse_inertia * (torque[b] + joint_torque[b] + c.torque));
    }
  };

  // springs
  each_group([&](const ContactGroup& g, auto points, ContactBody& A, ContactBody& Bb) {
    const ContactLaw& law = *g.law;
    const Vec3 v = A.v - Bb.v;
    const double inverse_mass = A.inverse_mass + Bb.inverse_mass;
    double energy = 0;
    Wrench sum;
    for (ContactPoint& p : points) {
      p.la = cross(p.ra, g.n), p.lb = cross(p.rb, g.n);
      const double w = inverse_mass + dot(p.la, A.inverse_inertia * p.la) + dot(p.lb, Bb.inverse_inertia * p.lb);
      p.impedance = std::sqrt(p.stiffness / w);
      p.speed = dot(g.n, v) + dot(p.la, A.w) - dot(p.lb, Bb.w);
      p.full = p.stiffness * p.depth;
      energy += p.full * p.depth;
      // of a step in which the surfaces meet or part, only a share is in touch
      const double way = h * std::abs(p.speed);
      if (way > p.depth) p.full *= 0.5 * (1 + p.depth / way);
      p.rate = 2 * law.zeta * p.impedance;
      if (law.damping >= 0) {
        // begins with a jump: for half a step, and the share of the one before
        p.rate = way > p.depth && p.speed > 0 ? (0.5 + p.depth / way) * law.damping : law.damping;
      }
      p.normal = law.mean * p.full;
      sum.add_normal(p, p.normal);
      sum.force -= p.normal * g.n;
    }
    sum.push(A, Bb);
    s.contact_energy += 0.5 * law.mean * energy;
  });
  update_speeds();

  // dashpots
  each_group([&](const ContactGroup& g, auto points, ContactBody& A, ContactBody& Bb) {
    const ContactLaw& law = *g.law;
    const Vec3 dv = A.dv - Bb.dv;
    Wrench all;
    double power = 0, force_sum = 0;
    for (ContactPoint& p : points) {
      p.change = dot(g.n, dv) + dot(p.la, A.dw) - dot(p.lb, Bb.dw);
      p.dashpot = p.rate * (p.speed + p.change);
      power += p.dashpot * (p.speed + p.change);
      all.add_normal(p, p.dashpot);
      force_sum += p.dashpot;
    }
    all.force = -force_sum * g.n;
    const Damper damper(power > 0 ? h * all.calc_mobility(A, Bb) / power : 0);
    Wrench sum;
    force_sum = 0;
    for (ContactPoint& p : points) {
      p.dashpot =
          std::clamp(damper.share * p.rate * (p.speed + damper.at * p.change), -law.band * p.full, law.most * p.full);
      p.normal += p.dashpot;
      force_sum += p.dashpot;
      sum.add_normal(p, p.dashpot);
    }
    sum.force = -force_sum * g.n;
    sum.push(A, Bb);
  });

  // friction springs, which share the load as the normal forces do
  each_group([&](const ContactGroup& g, auto points, ContactBody& A, ContactBody& Bb) {
    double total = 0, energy = 0;
    for (ContactPoint& p : points) {
      const Vec3 v = point_speed(p, A, Bb);
      p.slide = v - dot(g.n, v) * g.n;
      total += p.normal;
    }
    const double stiffness = kStickStiffness * g.law->mean * g.stiffness, most = g.law->friction * total / stiffness;
    const double rate = total > 0 ? stiffness / total : 0;
    Wrench sum;
    for (ContactPoint& p : points) {
      if (!p.is_fresh) p.slip += h * p.slide;
      p.slip -= dot(g.n, p.slip) * g.n;
      limit(p.slip, most);  // it follows where friction can hold no more
      p.held = (-rate * p.normal) * p.slip;
      energy += p.normal * dot(p.slip, p.slip);
      sum.add(p, p.held);
    }
    sum.push(A, Bb);
    s.stick_energy += 0.5 * rate * energy;
  });
  update_speeds();

  // what else friction takes to stop the sliding, within its limit
  each_group([&](const ContactGroup& g, auto points, ContactBody& A, ContactBody& Bb) {
    Wrench all;
    double power = 0, total = 0, impedance = 0;
    for (const ContactPoint& p : points) total += p.normal, impedance += p.impedance;
    if (!(total > 0)) {
      for (ContactPoint& p : points) p.friction = {};
      return;
    }
    // shared out as the normal forces are, so that all points pass their limits together
    const double rate = 2 * kSlideZeta * impedance / total;
    for (ContactPoint& p : points) {
      const Vec3 dv = point_change(p, A, Bb);
      p.friction = dv - dot(g.n, dv) * g.n;
      const Vec3 v = p.slide + p.friction, f = (-rate * p.normal) * v;
      power -= dot(f, v);
      all.add(p, f);
    }
    const Damper damper(power > 0 ? h * all.calc_mobility(A, Bb) / power : 0);
    Wrench sum;
    for (ContactPoint& p : points) {
      p.friction = p.held - (damper.share * rate * p.normal) * (p.slide + damper.at * p.friction);
      limit(p.friction, g.law->friction * p.normal);
      sum.add(p, p.friction - p.held);
    }
    sum.push(A, Bb);
  });
  update_speeds();

  // forces do their work over the half steps before and after
  double loss = 0, loss_after = 0, friction = 0, friction_after = 0;
  each_group([&](const ContactGroup& g, auto points, ContactBody& A, ContactBody& Bb) {
    for (ContactPoint& p : points) {
      const Vec3 change = point_change(p, A, Bb);
      loss += p.dashpot * p.speed;
      loss_after += p.dashpot * (p.speed + dot(g.n, change));
      friction += dot(p.friction, p.slide);
      friction_after += dot(p.friction, p.slide + change);
    }
  });
  s.contact_loss += 0.5 * h * (s.contact_loss_power + loss);
  s.friction_work += 0.5 * h * (s.friction_power + friction);
  s.contact_loss_power = loss_after;
  s.friction_power = friction_after;

  for (const int i : contact.touched) {
    const size_t b = static_cast<size_t>(i);
    const ContactBody& c = contact.body[b];
    if (fixed[b]) {
      ground_contact -= c.force;
    } else {
      force[b] += c.force;
      torque[b] += c.torque;
    }
  }
  ground_contact -= contact.body[B].force;
  s.sticks.resize(contact.point.size());
  for (size_t i = 0; i < contact.point.size(); ++i) s.sticks[i] = {contact.point[i].ra, contact.point[i].slip};
}

}  // namespace topple::mbs
