// Removal of elements, debris on the ground, and the balance of energy.
#include <algorithm>
#include <cmath>

#include "fem/explicit_inside.h"
#include "fem/segment_contact.h"

namespace topple::fem {

namespace {

/// Penalty rate over mass and step squared; shares of the mass that dashpots of friction stop in a step.
constexpr double kGroundRate = 0.2, kGroundGrip = 0.2;
/// Of its full radius: debris is crushed no further.
constexpr double kLeastRadius = 0.1;

void add_to(TouchSums& sums, const GroundTouch& t) {
  ++sums.count, sums.normal += dot(t.normal_force, t.before), sums.friction += dot(t.friction, t.before);
  sums.stored += t.stored;
}

}  // namespace

void ExplicitSystem::Inside::press_grounds(ExplicitState& state, bool debris) const {
  state.touches.clear();
  std::fill(state.ground_forces.begin(), state.ground_forces.end(), Vec3{});
  const auto press = [&](std::uint32_t row, bool particle, const Vec3& p, const Vec3& v, double mass, double radius,
                         double rate, std::vector<GroundTouch>& touches, std::vector<Vec3>& forces) {
    Vec3 sum;
    for (size_t i = 0; i < model.grounds.size(); ++i) {
      const ExplicitGround& g = model.grounds[i];
      const double depth = radius - dot(g.normal, p - g.point);
      if (!(depth > 0)) continue;
      const double damping = particle ? options.debris_damping : options.contact_damping;
      const double c = 2 * damping * std::sqrt(rate * mass), closing = -dot(g.normal, v);
      const double normal = std::max(0.0, rate * depth + c * closing);
      const Vec3 along = v + closing * g.normal;
      const double slide = norm(along);
      const double grip = std::min(g.friction * normal, kGroundGrip * mass / h * slide);
      GroundTouch touch;
      touch.row = row, touch.ground = static_cast<std::int32_t>(i);
      touch.normal_force = normal * g.normal;
      touch.friction = slide > 0 ? (-grip / slide) * along : Vec3{};
      touch.stored = 0.5 * rate * depth * depth;
      touch.before = v;
      touches.push_back(touch);
      const Vec3 force = touch.normal_force + touch.friction;
      forces[i] += -force;
      sum += force;
    }
    return sum;
  };
  for (const std::uint32_t row : state.grounded) {
    const double* r = state.rows.data() + 8 * static_cast<size_t>(row);
    const double mass = r[kernel::kNodeMass];
    if (!(mass > 0)) continue;
    const size_t before = state.touches.size();
    const Vec3 force = press(row, false, vector_at(r), vector_at(r + kernel::kSpeed), mass, 0,
                             kGroundRate * mass / (h * h), state.touches, state.ground_forces);
    push(state, row, force);
    if (state.touches.size() > before) {
      double& first = state.touchdowns[static_cast<size_t>(first_part_of_row[row])];
      if (first < 0) first = static_cast<double>(state.steps) * h;
    }
  }
  const auto add_debris_forces = [&] {
    for (size_t i = 0; i < state.ground_forces.size(); ++i) state.ground_forces[i] += state.debris_forces[i];
  };
  if (!debris) {
    state.ground_touching.normal = state.ground_touching.friction = 0;
    add_debris_forces();
    return;
  }
  std::vector<GroundShare>& shares = ground_shares;
  shares.resize(particle_shares(state));
  for_particles(state, [&](size_t share, size_t first, size_t last) {
    auto& [touches, forces, sums] = shares[share];
    touches.clear(), forces.assign(model.grounds.size(), {}), sums = {};
    for (size_t i = first; i < last; ++i) {
      const Particle& q = state.particles[i];
      ParticlePush& push = state.particle_pushes[i];
      push.force = q.mass * model.gravity, push.crushed = -1;
      const auto is_in = [&](const ExplicitGround& g) { return q.radius - dot(g.normal, q.p - g.point) > 0; };
      if (std::none_of(model.grounds.begin(), model.grounds.end(), is_in)) continue;
      const ParticleMake& make = state.particle_makes[i];
      const size_t before = touches.size();
      push.force +=
          press(static_cast<std::uint32_t>(i), true, q.p, q.v, q.mass, q.radius, make.stiffness, touches, forces);
      push.crushed = 0;
      for (size_t k = before; k < touches.size(); ++k) {
        const double depth = std::sqrt(2 * touches[k].stored / make.stiffness);
        push.crushed = std::max(push.crushed, make.calc_crushed(make.stiffness, depth));
        add_to(sums, touches[k]);
      }
    }
  });
  state.ground_touching = {};
  std::fill(state.debris_forces.begin(), state.debris_forces.end(), Vec3{});
  for (const GroundShare& share : shares) {
    state.ground_touching += share.sums;
    for (size_t i = 0; i < share.forces.size(); ++i) state.debris_forces[i] += share.forces[i];
    for (const GroundTouch& t : share.touches) {
      const auto part =
          static_cast<size_t>(model.elements[static_cast<size_t>(state.particle_makes[t.row].element)].part);
      double& first = state.touchdowns[part];
      if (first < 0 && state.debris_mass[part] > state.whole_mass[part]) first = static_cast<double>(state.steps) * h;
    }
  }
  state.ground_touching.normal *= debris_steps, state.ground_touching.friction *= debris_steps;
  add_debris_forces();
}

void ExplicitSystem::Inside::book_grounds(ExplicitState& state, bool debris) const {
  state.ground_work.stored = 0;
  for (const GroundTouch& t : state.touches) {
    const Vec3 now = vector_at(state.rows.data() + 8 * static_cast<size_t>(t.row) + kernel::kSpeed);
    const Vec3 path = (0.5 * h) * (t.before + now);
    state.ground_work.normal += dot(t.normal_force, path);
    state.ground_work.friction += dot(t.friction, path);
  }
  if (!debris) return;
  std::vector<ContactWork> work(ground_shares.size());
  team->run(work.size(), [&](size_t share) {
    const GroundShare& of = ground_shares[share];
    double normal = of.sums.normal, friction = of.sums.friction;  // at the speeds before, then at both
    for (const GroundTouch& t : of.touches) {
      const Vec3& now = state.particles[t.row].v;
      normal += dot(t.normal_force, now), friction += dot(t.friction, now);
    }
    work[share].normal = 0.5 * debris_step() * normal, work[share].friction = 0.5 * debris_step() * friction;
  });
  for (const ContactWork& w : work) state.ground_work.normal += w.normal, state.ground_work.friction += w.friction;
}

void ExplicitSystem::Inside::move_particles(ExplicitState& state) const {
  std::vector<unsigned char> knocked(particle_shares(state), 0);
  const double step = debris_step();
  for_particles(state, [&](size_t share, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      Particle& q = state.particles[i];
      ParticlePush& push = state.particle_pushes[i];
      q.v += (step / q.mass) * push.force;
      q.p += step * q.v;
      const double full = state.particle_makes[i].full_radius;
      if (push.crushed >= 0) {
        push.growth = 0;
        if (push.crushed > 0) q.radius = std::max(std::min(q.radius, kLeastRadius * full), q.radius - push.crushed);
      } else if (q.radius < full) {
        // into room around it as fast as what lies loose falls into it
        push.growth += step * norm(model.gravity);
        q.radius = std::min(full, q.radius + step * push.growth);
      }
    }
    knocked[share] = is_knocked(*this, state, first, last) ? 1 : 0;
  });
  for (const unsigned char is : knocked)
    if (is != 0) state.contact.knocked = true;
}

std::array<double, 3> ExplicitSystem::Inside::calc_elastic(const ExplicitState& state, int element) const {
  size_t lane = 0;
  const double* block = element_block(state, element, lane);
  const size_t W = chunks.W;
  const auto field = [&](int f) { return block[static_cast<size_t>(f) * W + lane]; };
  if (!(field(kernel::kMass) > 0)) return {0, 0, 0};
  const auto x = corners(state, element);
  const double volume = calc_hex_volume(x);
  const kernel::Law& law = laws[static_cast<size_t>(model.elements[static_cast<size_t>(element)].material)];
  double square = 0, trace = 0;
  for (int i = 0; i < 3; ++i) {
    square += field(kernel::kStress + i) * field(kernel::kStress + i) +
              2 * field(kernel::kStress + 3 + i) * field(kernel::kStress + 3 + i);
    trace += field(kernel::kStress + i);
  }
  const double mean = ((1 + law.nu) * square - law.nu * trace * trace) / law.E;
  double bending = 0;
  for (int k = 0; k < 6; k += 2) {
    const double a = field(kernel::kBending + k), b = field(kernel::kBending + k + 1);
    bending += a * a + b * b - 2 * law.nu * a * b;
  }
  Vec3 axes[3];
  for (size_t i = 0; i < 8; ++i) {
    const double sign[3] = {i % 4 == 1 || i % 4 == 2 ? 1.0 : -1.0, i % 4 >= 2 ? 1.0 : -1.0, i >= 4 ? 1.0 : -1.0};
    for (size_t k = 0; k < 3; ++k) axes[k] += sign[k] * x[i];
  }
  const double aa = dot(axes[0], axes[0]), bb = dot(axes[1], axes[1]), cc = dot(axes[2], axes[2]);
  const double xy = field(kernel::kTwist), xz = field(kernel::kTwist + 1), yz = field(kernel::kTwist + 2);
  const double twist = xy * xy / (aa * bb) + xz * xz / (aa * cc) + yz * yz / (bb * cc);
  double corner = 0;
  for (int i = 0; i < 3; ++i) corner += field(kernel::kCorner + i) * field(kernel::kCorner + i);
  corner /= 9 * law.E;
  const double varying = bending / (3 * law.E) + twist / (3 * law.mu) + corner;
  return {0.5 * volume * (mean + varying), 0.5 * volume * varying, 0.5 * volume * corner};
}

void ExplicitSystem::Inside::add_debris(ExplicitState& state, int element, const std::array<Vec3, 8>& v) const {
  const size_t e = static_cast<size_t>(element);
  const auto x = corners(state, element);
  const auto at = [](const std::array<Vec3, 8>& corner, double a, double b, double c) {
    Vec3 sum;
    for (size_t i = 0; i < 8; ++i) {
      const double sa = i % 4 == 1 || i % 4 == 2 ? a : -a, sb = i % 4 >= 2 ? b : -b, sc = i >= 4 ? c : -c;
      sum += (0.125 * (1 + sa) * (1 + sb) * (1 + sc)) * corner[i];
    }
    return sum;
  };
  // cells about as long as wide, at most 8
  double length[3];
  for (int k = 0; k < 3; ++k) length[k] = norm(at(x, k == 0, k == 1, k == 2) - at(x, -(k == 0), -(k == 1), -(k == 2)));
  const double least = std::min({length[0], length[1], length[2]});
  int cells[3] = {1, 1, 1};
  for (int k = 0; k < 3; ++k) cells[k] = std::clamp(static_cast<int>(std::lround(length[k] / least)), 1, 4);
  while (cells[0] * cells[1] * cells[2] > 8) --*std::max_element(cells, cells + 3);
  const int count = cells[0] * cells[1] * cells[2];
  const double volume = element_volume[e] / count, now = std::max(0.0, calc_hex_volume(x)) / count;
  const double side = std::min({length[0] / cells[0], length[1] / cells[1], length[2] / cells[2], std::cbrt(now)});
  Vec3 moved;
  for (size_t i = 0; i < 8; ++i) moved += 0.125 * (x[i] - start[rows_of_element[e][i]]);
  const kernel::Law& law = laws[static_cast<size_t>(model.elements[e].material)];
  for (int i = 0; i < cells[0]; ++i)
    for (int j = 0; j < cells[1]; ++j)
      for (int k = 0; k < cells[2]; ++k) {
        const double a = (2 * i + 1.0) / cells[0] - 1, b = (2 * j + 1.0) / cells[1] - 1,
                     c = (2 * k + 1.0) / cells[2] - 1;
        Particle q;
        ParticleMake make;
        q.p = at(x, a, b, c), q.v = at(v, a, b, c);
        make.start = q.p - moved;
        q.mass = element_mass[e] / count;
        make.full_radius = std::cbrt(3 * volume / (4 * M_PI));
        q.radius = std::min(0.475 * side, make.full_radius);
        // as stiff as a ball of the material between plates, as far as the step allows
        make.stiffness = std::min(kDebrisRate * q.mass / (h * h), law.E * q.radius);
        make.bears = law.points > 0 ? law.compression[0] * M_PI * make.full_radius * make.full_radius : 1e300;
        make.element = element;
        q.p += calc_lead(state) * q.v;
        state.particles.push_back(q), state.particle_pushes.emplace_back(), state.particle_makes.push_back(make);
      }
}

Vec3 ExplicitSystem::Inside::end_held(ExplicitState& state, std::uint32_t row) const {
  Vec3 impulse;
  const Vec3 v = vector_at(state.rows.data() + 8 * size_t{row} + kernel::kSpeed);
  for (HeldPush& held : state.held) {
    if (held.row != row) continue;
    // they have worked to the end of the step
    state.held_work.normal += 0.5 * h * dot(held.normal_force, v);
    state.held_work.friction += 0.5 * h * dot(held.friction, v);
    impulse += calc_lead(state) * (held.normal_force + held.friction);
    held.normal_force = held.friction = {};
  }
  return impulse;
}

void ExplicitSystem::Inside::remove_element(ExplicitState& state, int element, RemovalCause cause) const {
  const size_t e = static_cast<size_t>(element), W = chunks.W;
  size_t lane = 0;
  double* block = element_block(state, element, lane);
  if (!(block[kernel::kMass * W + lane] > 0)) return;
  Removal removal;
  removal.time = static_cast<double>(state.steps) * h, removal.element = element, removal.cause = cause;
  removal.mass = element_mass[e], removal.internal = calc_elastic(state, element)[0];
  state.removals.push_back(removal);
  state.removed_internal += removal.internal;
  const auto part = static_cast<size_t>(model.elements[e].part);
  state.whole_mass[part] -= element_mass[e];
  if (cause != RemovalCause::Charge && options.debris) state.debris_mass[part] += element_mass[e];

  const double share = element_mass[e] / 8;
  std::array<Vec3, 8> v;
  for (size_t i = 0; i < 8; ++i) {
    const double* r = state.rows.data() + 8 * static_cast<size_t>(rows_of_element[e][i]);
    v[i] = vector_at(r + kernel::kSpeed);
    state.removed_kinetic += 0.5 * share * dot(v[i], v[i]);
  }
  // what debris would still give to nodes that go
  Vec3 rest;
  for (const std::uint32_t row : rows_of_element[e])
    if (state.uses[row] == 1) rest += end_held(state, row);
  for (Vec3& speed : v) speed += (1 / element_mass[e]) * rest;
  if (cause != RemovalCause::Charge && options.debris) {
    const size_t first = state.particles.size();
    add_debris(state, element, v);
    for (size_t i = first; i < state.particles.size(); ++i)
      state.removed_kinetic -= 0.5 * state.particles[i].mass * dot(state.particles[i].v, state.particles[i].v);
  } else {
    for (const std::uint32_t row : rows_of_element[e])
      state.removed_gravity -= share * dot(model.gravity, vector_at(state.rows.data() + 8 * size_t{row}) - start[row]);
  }
  block[kernel::kMass * W + lane] = 0;
  for (int f = kernel::kStress; f < kernel::kStateFields; ++f)
    if (f != kernel::kStrain && f != kernel::kDamage) block[static_cast<size_t>(f) * W + lane] = 0;
  const std::uint32_t slot = chunks.slot_of_element[e];
  state.live[slot / W] = static_cast<unsigned char>(state.live[slot / W] & ~(1U << (slot % W)));
  for (const std::uint32_t row : rows_of_element[e]) {
    double* r = state.rows.data() + 8 * static_cast<size_t>(row);
    r[kernel::kNodeMass] -= share;
    if (--state.uses[row] == 0) {
      // what else hung at the node goes with it
      const int node = chunks.node_of_row[row];
      const double extra = model.extra_mass.empty() ? 0 : model.extra_mass[static_cast<size_t>(node)];
      const Vec3 speed = vector_at(r + kernel::kSpeed);
      state.removed_kinetic += 0.5 * extra * dot(speed, speed);
      state.removed_gravity -= extra * dot(model.gravity, vector_at(r) - start[row]);
      r[kernel::kNodeMass] = 0;
      for (int c = 0; c < 3; ++c) r[kernel::kSpeed + c] = 0;
      state.flags[row] |= kernel::kHoldX | kernel::kHoldY | kernel::kHoldZ;
    }
    r[kernel::kInverseMass] = r[kernel::kNodeMass] > 0 ? 1 / r[kernel::kNodeMass] : 0;
  }
  mark_changed(contact, state.contact, element);
}

ExplicitEnergy ExplicitSystem::Inside::calc_energy() {
  // one step ahead on a copy gives stresses and contact at the present places, and speeds on both sides
  ExplicitState& ahead = spare;
  ahead = s;
  const Timing kept = timing;
  advance_step(ahead, false);
  timing = kept;
  ExplicitEnergy energy;
  for (size_t row = 0; row < start.size(); ++row) {
    const double* r = s.rows.data() + 8 * row;
    const double mass = r[kernel::kNodeMass];
    if (!(mass > 0)) continue;
    energy.kinetic +=
        0.5 * mass * dot(vector_at(r + kernel::kSpeed), vector_at(ahead.rows.data() + 8 * row + kernel::kSpeed));
    energy.gravity -= mass * dot(model.gravity, vector_at(r) - start[row]);
  }
  for (const std::uint32_t row : loaded)
    energy.loads +=
        dot(vector_at(loads.data() + 4 * size_t{row}), vector_at(s.rows.data() + 8 * size_t{row}) - start[row]);
  const double lead = calc_lead(s);
  for (size_t i = 0; i < s.particles.size(); ++i) {
    const Particle& q = s.particles[i];
    energy.debris_kinetic += 0.5 * q.mass * dot(q.v, ahead.particles[i].v);
    energy.gravity -= q.mass * dot(model.gravity, q.p - lead * q.v - s.particle_makes[i].start);
  }
  for (size_t e = 0; e < element_mass.size(); ++e) {
    const auto stored = calc_elastic(ahead, static_cast<int>(e));
    energy.elastic += stored[0], energy.elastic_hourglass += stored[1], energy.corner_hourglass += stored[2];
  }
  energy.plastic = ahead.sums[0], energy.plastic_hourglass = ahead.sums[1], energy.plastic_corner = ahead.sums[2];
  energy.bulk_viscosity = ahead.sums[3];
  // contact: work of the steps so far, and of half of this one
  const auto book = [&](const ContactWork& so_far, double normal, double friction, double stored) {
    energy.contact_elastic += stored;
    energy.contact_damping += -(so_far.normal + 0.5 * h * normal) - stored;
    energy.friction += -(so_far.friction + 0.5 * h * friction);
  };
  TouchSums ground = ahead.ground_touching;
  for (const GroundTouch& t : ahead.touches) add_to(ground, t);
  book(s.ground_work, ground.normal, ground.friction, ground.stored);
  TouchSums sums = ahead.contact.touching;
  sums += ahead.contact.debris;
  ContactWork surface = s.surface_work;
  surface.normal += ahead.held_work.normal, surface.friction += ahead.held_work.friction;
  book(surface, sums.normal, sums.friction, sums.stored);
  double bar_work = s.bar_work, stored = 0;
  for (size_t b = 0; b < ahead.bars.size(); ++b) {
    const BarState& bar = ahead.bars[b];
    bar_work += 0.5 * h * dot(bar.pull, bar.before);
    stored += 0.5 * bar.force * bar.force / model.bars[b].stiffness;
  }
  energy.elastic += stored, energy.plastic -= bar_work + stored;
  energy.removed_internal = s.removed_internal, energy.removed_kinetic = s.removed_kinetic;
  energy.removed_gravity = s.removed_gravity;
  energy.start = start_energy;
  return energy;
}

}  // namespace topple::fem
