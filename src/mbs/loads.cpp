/// Loads: forces and torques on bodies, constant or following a table, from the start or from an event on. The bodies
/// get the impulse of each step exactly (docs/theory/multibody.md, eq. F6).

#include <algorithm>
#include <cmath>
#include <utility>

#include "mbs/forces.h"
#include "mbs/system.h"

namespace topple::mbs {

void System::compile_loads() {
  for (const Load& from : model.loads) {
    CompiledLoad c;
    c.body = from.body.index;
    c.p_B = from.p_B;
    c.force = from.force;
    c.torque = from.torque;
    c.follows_body = from.follows_body;
    c.is_constant = from.time.empty();
    if (!c.is_constant) c.factor = compile_characteristic({Characteristic::Kind::Table, 0, {}, from.time, from.factor});
    forces.loads.push_back(std::move(c));
  }
  state.load.assign(forces.loads.size(), {});
  for (LoadState& l : state.load) l.begin = 0;
  for (const Event& event : model.events)
    for (const Action& a : event.actions)
      if (a.kind == Action::Kind::ApplyLoad) state.load[static_cast<size_t>(a.index)].begin = kUnlimited;
}

void System::apply_load(size_t i, double time) {
  LoadState& l = state.load[i];
  const bool is_over = l.begin != kUnlimited && l.end <= time;
  if (l.begin != kUnlimited && !is_over) return;
  if (is_over) {
    const CompiledLoad& k = forces.loads[i];
    l.owed += calc_owed_impulse(k, l) + calc_load_impulse(k, l, l.until, l.end);
    l.end = kUnlimited, l.kick = 0;
  }
  l.begin = l.from = l.until = time;
}

void System::remove_load(size_t i, double time) {
  LoadState& l = state.load[i];
  if (l.begin == kUnlimited) return;  // it has not begun
  l.end = std::min(l.end, time);
}

double System::calc_load_impulse(const CompiledLoad& k, const LoadState& l, double from, double to) const {
  if (to == from) return 0.0;
  return (to - from) * (k.is_constant ? 1 : calc_mean(k.factor, from - l.begin, to - l.begin));
}

double System::calc_owed_impulse(const CompiledLoad& k, LoadState& l) const {
  const double kick = 0.5 * (l.last_kick + state.last_kick);  // how long the last one was
  if (!(state.step_index > 0 && l.kick > 0 && std::abs(kick - l.kick) > 1e-9 * l.kick)) return 0;
  if (l.until != l.end) l.until = std::min(state.time - 0.5 * state.last_kick, l.end);
  return calc_load_impulse(k, l, l.from, l.until) - l.factor * kick;
}

double System::find_load_factor(const CompiledLoad& k, LoadState& l) {
  if (l.begin == kUnlimited) return 0;
  const double owed = calc_owed_impulse(k, l) + std::exchange(l.owed, 0.0);
  // the impulse up to half a step from now that the body has not had yet; less than nothing for a load that an event of
  // this step ended before the last step's impulse did
  l.from = l.until;
  l.until = std::min(state.time + 0.5 * step, l.end);
  l.kick = kick_time();
  l.last_kick = state.last_kick;
  const double share = (l.until - l.from) / l.kick;
  if (owed == 0 && std::abs(share - 1) < 1e-9) {
    // times are known to round-off
    l.factor = k.is_constant ? 1 : calc_mean(k.factor, l.from - l.begin, l.until - l.begin);
  } else {
    l.factor = (owed + calc_load_impulse(k, l, l.from, l.until)) / l.kick;
    if (std::abs(l.factor - calc_load_factor(k, l)) > 1e-9) state.has_rest = true;
  }
  return l.factor;
}

double System::calc_load_factor(const CompiledLoad& k, const LoadState& l) const {
  if (l.begin == kUnlimited || state.time < l.begin || state.time >= l.end) return 0;
  return k.is_constant ? 1 : calc_force(k.factor, state.time - l.begin);
}

bool System::take_loads_as_they_are() {
  bool is_other = false;
  for (size_t i = 0; i < forces.loads.size(); ++i) {
    const CompiledLoad& k = forces.loads[i];
    const LoadState& l = state.load[i];
    const double missing = calc_load_factor(k, l) - l.factor;
    if (std::abs(missing) <= 1e-9) continue;
    const Mat3 R = k.follows_body ? rotation_of(k.body) : Mat3::identity();
    const Vec3 f = missing * (R * k.force), t = missing * (R * k.torque);
    if (k.body >= 0 && !fixed[static_cast<size_t>(k.body)])
      load_body(k.body, f, cross(calc_point(k.body, k.p_B) - centre_of(k.body), f) + t);
    else
      ground_reaction -= f;
    is_other = true;
  }
  if (is_other && model.is_planar) drop_forces_across();
  return is_other;
}

void System::evaluate_loads(bool at_rest) {
  for (size_t i = 0; i < forces.loads.size(); ++i) {
    const CompiledLoad& k = forces.loads[i];
    LoadState& l = state.load[i];
    const bool moves = k.body >= 0 && !fixed[static_cast<size_t>(k.body)];
    const size_t b = static_cast<size_t>(k.body);
    const Vec3 point = calc_point(k.body, k.p_B);
    const double at_start = l.begin > 0 ? 0 : k.is_constant ? 1 : calc_force(k.factor, 0);
    const double factor = at_rest ? at_start : find_load_factor(k, l);
    const Mat3 R = k.follows_body ? rotation_of(k.body) : Mat3::identity();
    const Vec3 f = factor * (R * k.force), t = factor * (R * k.torque);
    if (moves && !at_rest) {
      const Quat q = state.q[b];
      if (state.step_index > 0)
        l.work += 0.5 * dot(l.force + f, point - l.point) + 0.5 * dot(l.torque + t, log_rotation(q * conjugate(l.q)));
      l.q = q;
    }
    l.point = point;
    l.force = f;
    l.torque = t;
    if (factor == 0) continue;
    if (moves) {
      load_body(k.body, f, cross(point - centre_of(k.body), f) + t);
    } else {
      ground_reaction -= f;
    }
  }
}

double System::calc_last_load_change() const {
  double last = 0;
  for (size_t i = 0; i < forces.loads.size(); ++i)
    if (!forces.loads[i].is_constant && state.load[i].begin != kUnlimited)
      last = std::max(last, std::min(state.load[i].end, state.load[i].begin + model.loads[i].time.back()));
  return last;
}

}  // namespace topple::mbs
