/// Forces that end between two kicks: what their bodies have had of them too little or too much by then, and what the
/// elements store at that instant (docs/theory/multibody.md, eq. F7).

#include <algorithm>
#include <cmath>

#include "mbs/forces.h"
#include "mbs/joint_rows.h"
#include "mbs/system.h"

namespace topple::mbs {

double find_passing(double before, double now, double limit) {
  const double way = now - before, share = (now - limit) / way;
  return way != 0 && share >= 0 && share <= 1 ? share : 0;
}

System::Ending System::find_ending(double time) const {
  if (state.first_kick) return {};
  // what was told later than that ends now
  const double ago = state.time - time, longest = 2.001 * state.last_kick;
  if (ago > longest) return find_ending(state.time);
  return {ago / state.last_kick, 0.5 * state.last_kick - ago};
}

System::Ending System::find_ending(double before, double now, double limit) const {
  return find_ending(state.time - find_passing(before, now, limit) * state.last_kick);
}

void System::impel(int body, const Vec3& impulse, const Vec3& turn, double rest) {
  if (body < 0 || fixed[static_cast<size_t>(body)]) return;
  if (dot(impulse, impulse) + dot(turn, turn) > 0) state.has_rest = true;
  const size_t b = static_cast<size_t>(body);
  const bool is_planar = model.is_planar;
  impelled.push_back({b, impulse, turn, rest});
  state.v[b] += state.body[b].inverse_mass * (is_planar ? Vec3{impulse.x, 0, impulse.z} : impulse);
  state.L[b] += is_planar ? Vec3{0, turn.y, 0} : turn;
  state.w[b] = calc_world_inverse_inertia(b) * state.L[b];
}

double System::end_row(int a, int b, const ForceRow& row, const CompiledCharacteristic& spring,
                       const CompiledCharacteristic& damper, ComponentState& c, double x, const Ending& ending,
                       double& damping) {
  const double way = x - c.deformation, end = x - ending.ago * way;
  double pull = calc_force(spring, x - 0.5 * (0.5 + ending.ago) * way), braked = 0;
  if (!damper.is_zero && !state.first_kick) {
    const double rate = calc_row_rate(a, b, row),
                 mobility = calc_inverse_mass(a, row.line, row.turn_a) + calc_inverse_mass(b, row.line, row.turn_b);
    braked = calc_force(damper, rate);
    // it cannot turn its own motion round
    if (ending.rest > 0 && rate != 0) braked /= 1 + ending.rest * mobility * braked / rate;
    damping += 0.5 * (c.damper + braked) * (end - c.deformation);
  }
  pull = ending.rest * (pull + braked);
  impel(a, pull * row.line, pull * row.turn_a, ending.rest);
  impel(b, -pull * row.line, -pull * row.turn_b, ending.rest);
  c.before = c.deformation;
  c.deformation = x;
  c.spring = c.damper = c.rate = 0;
  return calc_integral(spring, end);
}

double System::end_along(SpringState& s, int a, int b, const ForceRow& row, const CompiledCharacteristic& spring,
                         const CompiledCharacteristic& damper, double x, const Ending& ending) {
  s.energy = 0;
  s.live = false;
  mark_links_due();
  return end_row(a, b, row, spring, damper, s.component, x, ending, s.damping);
}

double System::end_spring(size_t i, const Ending& ending) {
  const CompiledSpring& k = forces.springs[i];
  ForceRow row;
  const double x = measure_spring(k, row) - k.free_length;
  return end_along(state.spring[i], k.a, k.b, row, k.spring, k.damper, x, ending);
}

double System::end_torsion(size_t i, const Ending& ending) {
  const CompiledTorsion& k = forces.torsions[i];
  const CompiledJoint& j = joints[static_cast<size_t>(k.joint)];
  ForceRow row;
  const double x = measure_torsion(k, row) - k.free_angle;
  return end_along(state.torsion[i], j.parent, j.child, row, k.spring, k.damper, x, ending);
}

double System::end_bushing(size_t i, const Ending& ending) {
  BushingState& s = state.bushing[i];
  const CompiledBushing& k = forces.bushings[i];
  const FrameDeformation d = measure_bushing(i);
  const double x[6] = {d.u.x, d.u.y, d.u.z, d.r.x, d.r.y, d.r.z};
  ForceRow rows[6];
  find_bushing_rows(k, d, rows);
  double stored = 0;
  for (int c = 0; c < 6; ++c)
    stored += end_row(k.a, k.b, rows[c], k.spring[c], k.damper[c], s.component[c], x[c], ending, s.damping);
  s.energy = 0;
  s.live = false;
  mark_links_due();
  return stored;
}

double System::end_cable(size_t i, const Vec3& p_A, const Vec3& p_B, const Ending& ending) {
  CableState& c = state.cable[i];
  const Cable& k = model.cables[i];
  const Vec3 line = p_B - p_A;
  const double length = norm(line), stretch = length - c.rest_length, way = stretch - c.force / k.stiffness;
  const auto force_at = [&](double ago) { return k.stiffness * std::max(0.0, stretch - ago * way); };
  const double pull = ending.rest * force_at(0.5 * (0.5 + ending.ago)), last = force_at(ending.ago);
  c.force = c.energy = 0;
  c.live = false;
  if (length > 0) {
    const Vec3 on_a = (pull / length) * line;
    impel(k.a.index, on_a, cross(p_A - centre_of(k.a.index), on_a), ending.rest);
    impel(k.b.index, -on_a, -cross(p_B - centre_of(k.b.index), on_a), ending.rest);
  }
  return 0.5 * last * last / k.stiffness;
}

void System::end_element(size_t e, const Ending& ending) {
  const size_t slot = slot_of(e);
  if (state.first_kick || !state.element[e].live || slot == Lanes::kNoSlot) return;
  evaluate_element(e, step);
  const CompiledElement& c = elements[e];
  const auto three = [&](size_t f) {
    return Vec3{lanes->force_field(slot, f), lanes->force_field(slot, f + 1), lanes->force_field(slot, f + 2)};
  };
  end_pull(c.a, c.b, three(0), three(3), three(6), ending);
}

void System::end_rotational(size_t r, const Ending& ending) {
  ZoneState& z = state.rotational[r];
  if (state.first_kick || !z.live) return;
  evaluate_rotational(r, step);
  const CompiledJoint& j = joints[static_cast<size_t>(rotationals[r].joint)];
  const Vec3 on_parent = z.resultant.c[5] * (rotation_of(j.parent) * j.R_PF.column(2));
  end_pull(j.parent, j.child, {}, on_parent, on_parent, ending);
}

void System::remove_rotational(size_t r, const Ending& ending) {
  ZoneState& z = state.rotational[r];
  if (!z.live) return;
  end_rotational(r, ending);
  if (z.live) take_away(z);
  mark_links_due();
}

void System::take_away(ZoneState& z) {
  state.removed += z.energy + z.damper_energy;
  z.energy = z.damper_energy = 0;
  break_zone(z, BreakReason::Removed);
}

void System::end_joint(size_t i, const Ending& ending) {
  const JointState& js = state.joint[i];
  if (!js.live) return;
  const CompiledJoint& j = joints[i];
  const JointFrames f = calc_joint_frames(state, j);
  // on one line, that of the child's point
  const Vec3 lever_parent = f.lever_parent + f.gap;
  end_pull(j.parent, j.child, -js.force, -cross(lever_parent, js.force) - js.moment,
           -cross(f.lever_child, js.force) - js.moment, ending);
}

void System::end_pull(int a, int b, const Vec3& on_a, const Vec3& torque_a, const Vec3& torque_b,
                      const Ending& ending) {
  const auto power_on = [&](int body, const Vec3& f, const Vec3& t) {
    if (body < 0 || fixed[static_cast<size_t>(body)]) return 0.0;
    return dot(f, state.v[static_cast<size_t>(body)]) + dot(t, state.w[static_cast<size_t>(body)]);
  };
  // what it has done since it ended
  state.removed += ending.ago * state.last_kick * (power_on(a, on_a, torque_a) - power_on(b, on_a, torque_b));
  impel(a, ending.rest * on_a, ending.rest * torque_a, ending.rest);
  impel(b, -ending.rest * on_a, -ending.rest * torque_b, ending.rest);
}

}  // namespace topple::mbs
