/// Forces at touching points (docs/theory/contact.md): springs first, then dashpots, then friction. Each stage sees the
/// speeds that the ones before it leave, and within a stage no group sees another, so the order of groups does not
/// count.

#include "mbs/contact.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "mbs/contact_kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kStickStiffness = 1.2;  // of the mean normal stiffness of a corner

/// Component of a vector in a block of lanes.
Vec3 read3(const double* slot, int field, size_t W) {
  const double* at = slot + static_cast<size_t>(field) * W;
  return {at[0], at[W], at[2 * W]};
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
  contact.place.assign(B + 1, -1);
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
  for (const ContactForces& c : contact.on)
    if (c.body >= 0) contact.place[static_cast<size_t>(c.body)] = -1;
  contact.on.assign(1, {});
  contact.touched.assign(kernel::kTouchedFields, 0);
  contact.point.clear();
  contact.group.clear();
  add_travel(h);
  if (model.contact.ground) find_ground_points();
  if (model.contact.bodies) find_pair_points();
  resolve_contacts(h);
}

void System::add_contact_point(const Vec3& at, double depth, double stiffness) {
  ContactPoint& p = contact.point.emplace_back();
  p.at = at;
  p.depth = depth;
  p.stiffness = stiffness;
}

int System::touch(size_t b) {
  if (b == B || fixed[b]) return 0;
  int& place = contact.place[b];
  if (place < 0) {
    place = static_cast<int>(contact.on.size());
    contact.on.emplace_back().body = static_cast<int>(b);
    const size_t at = contact.touched.size();
    contact.touched.resize(at + kernel::kTouchedFields);
    double* c = contact.touched.data() + at;
    const State& s = state;
    const Vec3 v = s.v[b], w = s.w[b];
    const Mat3 I = calc_world_inverse_inertia(b);
    const double known[] = {
        v.x,     v.y,     v.z,     w.x,     w.y,     w.z,     0, 0, 0, 0, 0, 0, s.body[b].inverse_mass,
        I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2), 0};
    static_assert(std::size(known) == kernel::kTouchedFields);
    std::copy(std::begin(known), std::end(known), c);
  }
  contact.touched[static_cast<size_t>(place) * kernel::kTouchedFields + kernel::kGroups] += 1;
  return place;
}

void System::add_contact_group(size_t a, size_t b, const Vec3& n, size_t first, const ContactLaw& law, double stiffness,
                               StickRange& sticks) {
  const size_t count = contact.point.size() - first;
  for (ContactPoint& p : std::span(contact.point).subspan(first)) {
    double least = kUnlimited;
    for (int i = sticks.first; i < sticks.first + sticks.count; ++i) {
      const Stick& stick = state.sticks[static_cast<size_t>(i)];
      const Vec3 d = stick.at - p.at;
      if (const double distance2 = dot(d, d); distance2 < least) {
        least = distance2;
        p.slip = stick.slip;
        p.is_fresh = false;
      }
    }
  }
  sticks = {static_cast<int>(first), static_cast<int>(count)};
  ContactGroup& g = contact.group.emplace_back();
  g.a = touch(a), g.b = touch(b);
  g.first = sticks.first, g.count = sticks.count;
  g.n = n;
  const State& s = state;
  if (b != B) g.apart = s.p[a] - s.p[b];
  g.law = &law;
  g.stiffness = stiffness;
}

void System::fill_contact_blocks() {
  const size_t W = kernel::lanes(), groups = contact.group.size(), blocks = (groups + W - 1) / W;
  // by rising count, in order within a count
  std::vector<std::uint32_t>& next = contact.by_count;
  next.assign(BoxContact::kMostPoints + 2, 0);
  const auto key = [&](const ContactGroup& g) {
    return static_cast<size_t>(std::min(g.count, BoxContact::kMostPoints));
  };
  for (const ContactGroup& g : contact.group) ++next[key(g) + 1];
  for (size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  contact.rows.assign(blocks + 1, 0);
  for (ContactGroup& g : contact.group) {
    g.slot = next[key(g)]++;
    std::uint32_t& most = contact.rows[g.slot / W + 1];
    most = std::max(most, static_cast<std::uint32_t>(g.count));
  }
  for (size_t i = 0; i < blocks; ++i) contact.rows[i + 1] += contact.rows[i];
  contact.a.assign(blocks * W, 0);
  contact.b.assign(blocks * W, 0);
  contact.groups.resize(blocks * W * kernel::kGroupFields);
  contact.points.assign(contact.rows[blocks] * W * kernel::kPointFields, 0);
  for (size_t slot = groups; slot < blocks * W; ++slot)
    for (size_t f = 0; f < kernel::kGroupFields; ++f)
      contact.groups[(slot / W * kernel::kGroupFields + f) * W + slot % W] = 0;
  for (const ContactGroup& g : contact.group) {
    const size_t block = g.slot / W, place = g.slot % W;
    contact.a[g.slot] = static_cast<std::uint32_t>(g.a);
    contact.b[g.slot] = static_cast<std::uint32_t>(g.b);
    const ContactLaw& law = *g.law;
    const double known[] = {g.n.x,
                            g.n.y,
                            g.n.z,
                            g.apart.x,
                            g.apart.y,
                            g.apart.z,
                            law.mean,
                            law.band,
                            law.most,
                            law.zeta,
                            law.damping,
                            law.friction,
                            kStickStiffness * law.mean * g.stiffness};
    static_assert(std::size(known) == kernel::kStick + 1);
    double* to = contact.groups.data() + block * kernel::kGroupFields * W + place;
    for (const double x : known) *to = x, to += W;
    for (int i = 0; i < g.count; ++i) {
      const ContactPoint& p = contact.point[static_cast<size_t>(g.first + i)];
      const double fields[] = {
          p.at.x, p.at.y, p.at.z, p.depth, p.stiffness, p.slip.x, p.slip.y, p.slip.z, p.is_fresh ? 1.0 : 0.0};
      static_assert(std::size(fields) == kernel::kFresh + 1);
      double* at =
          contact.points.data() + (contact.rows[block] + static_cast<size_t>(i)) * kernel::kPointFields * W + place;
      for (const double x : fields) *at = x, at += W;
    }
  }
}

void System::resolve_contacts(double h) {
  State& s = state;
  s.contact_energy = s.stick_energy = 0;
  double loss = 0, loss_after = 0, friction = 0, friction_after = 0;
  if (!contact.group.empty()) {
    fill_contact_blocks();
    const size_t W = kernel::lanes();
    kernel::ContactJob job;
    job.blocks = contact.rows.size() - 1;
    job.rows = contact.rows.data();
    job.a = contact.a.data(), job.b = contact.b.data();
    job.bodies = contact.touched.data();
    job.groups = contact.groups.data();
    job.points = contact.points.data();
    job.h = h;
    const auto slot_of_group = [&](const ContactGroup& g) {
      return contact.groups.data() + g.slot / W * kernel::kGroupFields * W + g.slot % W;
    };
    // adds the wrenches of all groups to their bodies
    const auto push = [&](int field, Vec3 ContactForces::*push_of, Vec3 ContactForces::*turn_of) {
      for (const ContactGroup& g : contact.group) {
        const double* slot = slot_of_group(g);
        const Vec3 f = read3(slot, field, W), t = read3(slot, field + 3, W);
        ContactForces &a = contact.on[static_cast<size_t>(g.a)], &b = contact.on[static_cast<size_t>(g.b)];
        a.*push_of += f, a.*turn_of += t;
        b.*push_of -= f, b.*turn_of -= t + cross(g.apart, f);
      }
    };
    // what all forces known so far add to the speeds within the step
    const auto update_speeds = [&] {
      for (size_t i = 1; i < contact.on.size(); ++i) {
        const ContactForces& c = contact.on[i];
        const size_t b = static_cast<size_t>(c.body);
        double* x = contact.touched.data() + i * kernel::kTouchedFields;
        const Vec3 dv =
            h * (x[kernel::kTouchedMass] * (force[b] + joint_force[b] + (c.press + c.damp + c.rub)) + model.gravity);
        const Vec3 t = h * (torque[b] + joint_torque[b] + (c.press_turn + c.damp_turn + c.rub_turn));
        const double* I = x + kernel::kTouchedInertia;
        double* change = x + kernel::kChange;
        change[0] = dv.x, change[1] = dv.y, change[2] = dv.z;
        change[3] = I[0] * t.x + I[1] * t.y + I[2] * t.z;
        change[4] = I[1] * t.x + I[3] * t.y + I[4] * t.z;
        change[5] = I[2] * t.x + I[4] * t.y + I[5] * t.z;
      }
    };
    kernel::press_contacts(job);
    push(kernel::kPress, &ContactForces::press, &ContactForces::press_turn);
    update_speeds();
    kernel::damp_contacts(job);
    push(kernel::kDamp, &ContactForces::damp, &ContactForces::damp_turn);
    push(kernel::kRub, &ContactForces::rub, &ContactForces::rub_turn);
    update_speeds();
    kernel::rub_contacts(job);
    for (ContactForces& c : contact.on) c.rub = c.rub_turn = {};
    push(kernel::kRub, &ContactForces::rub, &ContactForces::rub_turn);
    update_speeds();

    for (const ContactGroup& g : contact.group) {
      const double* slot = slot_of_group(g);
      s.contact_energy += slot[kernel::kPressEnergy * W];
      s.stick_energy += slot[kernel::kStickEnergy * W];
    }
    // forces do their work over the half steps before and after
    for (size_t i = 1; i < contact.on.size(); ++i) {
      const ContactForces& c = contact.on[i];
      const size_t b = static_cast<size_t>(c.body);
      const double* x = contact.touched.data() + i * kernel::kTouchedFields;
      const Vec3 v = read3(x, kernel::kSpeed, 1), w = read3(x, kernel::kSpeed + 3, 1);
      const Vec3 v1 = v + read3(x, kernel::kChange, 1), w1 = w + read3(x, kernel::kChange + 3, 1);
      loss -= dot(c.damp, v) + dot(c.damp_turn, w);
      loss_after -= dot(c.damp, v1) + dot(c.damp_turn, w1);
      friction += dot(c.rub, v) + dot(c.rub_turn, w);
      friction_after += dot(c.rub, v1) + dot(c.rub_turn, w1);
      force[b] += c.press + c.damp + c.rub;
      torque[b] += c.press_turn + c.damp_turn + c.rub_turn;
    }
    const ContactForces& still = contact.on[0];
    ground_contact -= still.press + still.damp + still.rub;
  }
  s.contact_loss += 0.5 * h * (s.contact_loss_power + loss);
  s.friction_work += 0.5 * h * (s.friction_power + friction);
  s.contact_loss_power = loss_after;
  s.friction_power = friction_after;
  s.sticks.resize(contact.point.size());
  const size_t W = kernel::lanes();
  for (const ContactGroup& g : contact.group)
    for (int i = 0; i < g.count; ++i) {
      const size_t point = static_cast<size_t>(g.first + i), row = contact.rows[g.slot / W] + static_cast<size_t>(i);
      const double* at = contact.points.data() + row * kernel::kPointFields * W + g.slot % W;
      s.sticks[point] = {contact.point[point].at, read3(at, kernel::kSpringSlip, W)};
    }
}

}  // namespace topple::mbs
