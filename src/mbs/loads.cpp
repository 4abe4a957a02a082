/// Loads: forces and torques on bodies, constant or following a table, from the start or from an event on. The bodies
/// get the impulse of each step exactly (docs/theory/multibody.md, eq. F6).

#include <algorithm>
#include <cmath>

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
  if (l.begin != kUnlimited) return;
  l.begin = l.until = time;
}

void System::remove_load(size_t i, double time) {
  LoadState& l = state.load[i];
  if (l.begin == kUnlimited) l.begin = l.until = time;  // an event that would apply it comes too late
  l.end = std::min(l.end, time);
}

void System::evaluate_loads(bool at_rest) {
  const double half = 0.5 * step;
  for (size_t i = 0; i < forces.loads.size(); ++i) {
    const CompiledLoad& k = forces.loads[i];
    LoadState& l = state.load[i];
    const bool moves = k.body >= 0 && !fixed[static_cast<size_t>(k.body)];
    const size_t b = static_cast<size_t>(k.body);
    const Vec3 point = calc_point(k.body, k.p_B);
    double factor = 0;
    if (at_rest) {
      factor = l.begin > 0 ? 0 : k.is_constant ? 1 : calc_force(k.factor, 0);
    } else if (l.begin != kUnlimited && l.until != l.end) {
      // the impulse up to half a step from now that the body has not had yet; less than nothing for a load that an
      // event of this step ended before the last step's impulse did
      const double to = std::min(state.time + half, l.end);
      double share = (to - l.until) / (state.first_kick ? half : step);
      if (std::abs(share - 1) < 1e-9) share = 1;  // times are known to round-off
      if (share != 0) factor = share * (k.is_constant ? 1 : calc_mean(k.factor, l.until - l.begin, to - l.begin));
      l.until = to;
    }
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
