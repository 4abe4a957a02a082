/// Dampers of springs and bushings, taken with the velocity at the time of the positions and implicitly enough that
/// they do not bound the step (docs/theory/multibody.md, eq. F3 and F4).

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mbs/forces.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

/// Root of r + q c(r) = s. r holds a first guess. False if the law falls so fast that there is none nearby.
bool find_rate(const CompiledCharacteristic& c, double q, double s, double& r) {
  if (c.kind == Characteristic::Kind::Linear) {
    const double d = 1 + q * c.rate;
    r = s / d;
    return d > 0;
  }
  const auto lack = [&](double x) { return x + q * calc_force(c, x) - s; };
  // for a law that rises the root lies between s and s - q c(s)
  const double first = q * calc_force(c, s);
  double low = s - std::max(0.0, first), high = s - std::min(0.0, first);
  if (low == high) {
    r = s;
    return true;
  }
  const auto round_off = [&](double x) { return 1e-15 * std::abs(s) + q * calc_round_off(c, x); };
  if (lack(low) > round_off(low) || lack(high) < -round_off(high)) return false;
  if (!(r >= low && r <= high)) r = 0.5 * (low + high);
  for (int round = 0; round < 200; ++round) {
    const double g = lack(r);
    if (std::abs(g) <= 0.5 * round_off(r)) return true;
    (g < 0 ? low : high) = r;
    const double slope = 1 + q * calc_slope(c, r);
    double next = slope > 0 ? r - g / slope : low - 1;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-15 * std::max(std::abs(r), std::abs(s)) || next == r) {
      r = next;
      return true;
    }
    r = next;
  }
  return false;
}

}  // namespace

void System::find_damper_bounds() {
  std::vector<DamperRow>& rows = forces.damper_rows;
  std::vector<DampedBody>& bodies = forces.damped;
  for (DampedBody& d : bodies) {
    d.sides.clear();
    d.inverse_inertia = calc_world_inverse_inertia(static_cast<size_t>(d.body));
  }
  const auto add = [&](int place, size_t row, const Vec3& turn) {
    if (place < 0) return 0.0;
    DampedBody& d = bodies[static_cast<size_t>(place)];
    const Vec3 spin = d.inverse_inertia * turn;
    d.sides.push_back({static_cast<int>(row), turn, spin});
    const Vec3& line = rows[row].row.line;
    return state.body[static_cast<size_t>(d.body)].inverse_mass * dot(line, line) + dot(turn, spin);
  };
  for (size_t i = 0; i < rows.size(); ++i) {
    DamperRow& d = rows[i];
    d.own = add(d.place_a, i, d.row.turn_a) + add(d.place_b, i, d.row.turn_b);
    d.root = std::sqrt(d.own);
    d.coupled = 0;
  }
  // neighbours couple rows: the sums of their magnitudes, each scaled by both rows' own, bound the matrix from above
  for (const DampedBody& body : bodies) {
    const double inverse_mass = state.body[static_cast<size_t>(body.body)].inverse_mass;
    for (size_t m = 0; m < body.sides.size(); ++m) {
      DamperRow& i = rows[static_cast<size_t>(body.sides[m].row)];
      if (!(i.root > 0)) continue;
      const Vec3 line = inverse_mass * i.row.line, spin = body.sides[m].spin;
      const double inverse_root = 1 / i.root;
      double sum = 0;
      for (size_t n = 0; n < m; ++n) {
        DamperRow& k = rows[static_cast<size_t>(body.sides[n].row)];
        const double coupling = std::abs(dot(line, k.row.line) + dot(body.sides[n].turn, spin));
        k.coupled += coupling * inverse_root;
        sum += k.root > 0 ? coupling / k.root : 0;
      }
      i.coupled += sum;
    }
  }
  for (DamperRow& d : rows) d.bound = d.own + d.root * d.coupled;
}

void System::evaluate_dampers() {
  std::vector<DamperRow>& rows = forces.damper_rows;
  if (rows.empty()) return;
  find_damper_bounds();
  const double half = 0.5 * step;
  // half a kick of what acts on each body: at the start of a run with what it is without dampers
  const bool is_first = state.step_index == 1;
  std::vector<std::pair<Vec3, Vec3>> other;
  const auto kick_of = [&](size_t b) -> std::pair<Vec3, Vec3> {
    return {half * (force[b] + body_reaction[b]), half * (torque[b] + body_reaction_turn[b])};
  };
  if (is_first) {
    if (forces.damps_jointed) calc_reactions();
    for (size_t b = 0; b < B; ++b) other.push_back(kick_of(b));
  }
  // velocities at the time of the positions, the last pulls of the dampers standing for the present ones
  for (const DamperRow& d : rows) pull(d.a, d.b, d.row, d.state->damper);
  if (forces.damps_jointed) calc_reactions();
  if (is_first) {
    // what the first half kick takes, which no way of a step shows (docs/theory/multibody.md, eq. F5)
    double braked = 0, weights = 0;
    for (size_t b = 0; b < B; ++b) {
      if (fixed[b]) continue;
      const auto [push, turn] = kick_of(b);
      const double inverse_mass = state.body[b].inverse_mass;
      const Vec3 weight = inverse_mass > 0 ? (half / inverse_mass) * model.gravity : Vec3{};
      const auto stored = [&](const Vec3& p, const Vec3& l) {
        return 0.5 * (inverse_mass * dot(p, p) + dot(l, calc_world_inverse_inertia(b) * l));
      };
      braked += stored(push + weight, turn) - stored(other[b].first + weight, other[b].second);
    }
    for (const DamperRow& d : rows) weights += d.bound * d.state->damper * d.state->damper;
    if (weights > 0)
      for (const DamperRow& d : rows) *d.damping += braked * d.bound * d.state->damper * d.state->damper / weights;
  }
  for (DampedBody& d : forces.damped) {
    const size_t b = static_cast<size_t>(d.body);
    d.velocity =
        state.v[b] + (half * state.body[b].inverse_mass) * (force[b] + body_reaction[b]) + half * model.gravity;
    d.spin = d.inverse_inertia * (state.L[b] + half * (torque[b] + body_reaction_turn[b]));
  }
  for (DamperRow& d : rows) {
    double rate = 0;
    if (d.place_b >= 0) {
      const DampedBody& b = forces.damped[static_cast<size_t>(d.place_b)];
      rate += dot(d.row.line, b.velocity) + dot(d.row.turn_b, b.spin);
    }
    if (d.place_a >= 0) {
      const DampedBody& a = forces.damped[static_cast<size_t>(d.place_a)];
      rate -= dot(d.row.line, a.velocity) + dot(d.row.turn_a, a.spin);
    }
    ComponentState& c = *d.state;
    const double q = half * d.bound;
    d.last = c.damper;
    if (std::isfinite(rate) && !find_rate(*d.law, q, rate + q * d.last, c.rate) && trouble.empty()) {
      char words[160];
      std::snprintf(
          words, sizeof words,
          "a damper's law falls so fast near %.3g m/s or rad/s that a step of %.3g s does not determine its force",
          rate, step);
      trouble = words;
    }
    c.damper = calc_force(*d.law, c.rate);
    *d.damping += 0.5 * (d.last + c.damper) * (c.deformation - c.before);
  }
  for (const DamperRow& d : rows) pull(d.a, d.b, d.row, d.state->damper - d.last);
}

void System::look_at_start() {
  const auto springs = state.spring, torsions = state.torsion;
  const auto bushings = state.bushing;
  const Vec3 ground = ground_reaction;
  std::vector<std::pair<Vec3, Vec3>> before;
  for (size_t b = 0; b < B; ++b) before.emplace_back(force[b], torque[b]);
  const auto correct = [&](int a, int b, const ForceRow& row, const CompiledCharacteristic& law, ComponentState& c) {
    if (law.is_zero) return;
    const double now = calc_force(law, calc_row_rate(a, b, row));
    pull(a, b, row, now - c.damper);
    c.damper = now;
  };
  ForceRow row, rows[6];
  for (size_t i = 0; i < forces.springs.size(); ++i) {
    const CompiledSpring& k = forces.springs[i];
    if (!state.spring[i].live) continue;
    (void)measure_spring(k, row);
    correct(k.a, k.b, row, k.damper, state.spring[i].component);
  }
  for (size_t i = 0; i < forces.torsions.size(); ++i) {
    const CompiledTorsion& k = forces.torsions[i];
    if (!state.torsion[i].live) continue;
    (void)measure_torsion(k, row);
    const CompiledJoint& j = joints[static_cast<size_t>(k.joint)];
    correct(j.parent, j.child, row, k.damper, state.torsion[i].component);
  }
  for (size_t i = 0; i < forces.bushings.size(); ++i) {
    const CompiledBushing& k = forces.bushings[i];
    if (!state.bushing[i].live || !k.is_damped) continue;
    find_bushing_rows(k, measure_bushing(i), rows);
    for (int c = 0; c < 6; ++c) correct(k.a, k.b, rows[c], k.damper[c], state.bushing[i].component[c]);
  }
  if (model.is_planar) drop_forces_across();
  look();
  state.spring = springs;
  state.torsion = torsions;
  state.bushing = bushings;
  ground_reaction = ground;
  for (size_t b = 0; b < B; ++b) {
    force[b] = before[b].first;
    torque[b] = before[b].second;
  }
}

void System::note_fast_dampers() {
  if (forces.damped.empty()) return;
  const auto springs = state.spring, torsions = state.torsion;
  const auto bushings = state.bushing;
  evaluate_springs(true);
  find_damper_bounds();
  constexpr double tolerable = 100;  // steps
  double most = tolerable;
  const DamperRow* fastest = nullptr;
  for (const DamperRow& d : forces.damper_rows) {
    // of a polynomial the slope at rest: what it grows to is not known beforehand; a row alone is implicit
    const double lag = step * find_steepest(*d.law, 0, 0) * (d.bound - d.own);
    if (lag > most) most = lag, fastest = &d;
  }
  if (fastest) {
    char words[160];
    std::snprintf(
        words, sizeof words,
        " is faster than the step of %.3g s can follow beside its neighbours: its pull may lag by some %.0f steps",
        step, most);
    summary.notes.push_back("the damper of \"" + *fastest->name + "\"" + words);
  }
  state.spring = springs;
  state.torsion = torsions;
  state.bushing = bushings;
  forces.damper_rows.clear();
  for (size_t b = 0; b < B; ++b) force[b] = torque[b] = Vec3{};
  ground_reaction = {};
}

}  // namespace topple::mbs
