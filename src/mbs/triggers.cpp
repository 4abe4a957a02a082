/// Events that wait for a limit. Places, lengths and angles are those of the present step; forces, moments and
/// velocities those of the evaluation before, as joints are judged by their last reaction. Of what is released or
/// loosened they see what System::look() shows, but no angle and no displacement of a joint that is gone.

#include <algorithm>
#include <cmath>
#include <limits>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double component_of(const Vec3& x, int component) { return component < 3 ? x[component] : norm(x); }
double component_of(double x, int component) { return component < 3 ? x : std::abs(x); }

bool is_force(Quantity::Kind kind) {
  using enum Quantity::Kind;
  switch (kind) {
    case JointForce:
    case JointMoment:
    case ElementForce:
    case ElementMoment:
    case HingeMoment:
    case BushingForce:
    case BushingMoment:
    case SpringForce:
    case TorsionTorque:
    case CableForce:
      return true;
    default:
      return false;
  }
}

bool is_reaction(Quantity::Kind kind) {
  return kind == Quantity::Kind::JointForce || kind == Quantity::Kind::JointMoment;
}

}  // namespace

double System::calc_component(const Quantity& q, int component) {
  const size_t i = static_cast<size_t>(q.index);
  const State& s = state;
  switch (q.kind) {
    case Quantity::Kind::Position:
      return component_of(Vec3(s.p[i]), component);
    case Quantity::Kind::Velocity:
      return component_of(calc_velocity(i), component);
    case Quantity::Kind::AngularVelocity:
      return component_of(calc_angular_velocity(i), component);
    case Quantity::Kind::Orientation:
      return component_of(log_rotation(s.q[i]), component);
    case Quantity::Kind::JointForce:
    case Quantity::Kind::JointMoment: {
      const bool is_force = q.kind == Quantity::Kind::JointForce;
      if (const int r = joints[i].rotational; r >= 0 && is_loose(static_cast<size_t>(r))) {
        const size_t e = E + static_cast<size_t>(r);
        unpack_element(e);
        const double* f = s.element[e].resultant.c + (is_force ? 0 : 3);
        return component_of(-Vec3{f[0], f[1], f[2]}, component);
      }
      const Mat3 F = rotation_of(joints[i].parent) * joints[i].R_PF;
      return component_of(transpose_times(F, is_force ? s.joint[i].force : s.joint[i].moment), component);
    }
    case Quantity::Kind::JointAngle:
      // a joint that is gone has none: no limit holds
      return s.joint[i].live ? component_of(s.joint[i].angle, component) : kNone;
    case Quantity::Kind::JointDisplacement: {
      if (!s.joint[i].live) return kNone;
      const CompiledJoint& j = joints[i];
      const Vec3 gap = calc_point(j.child, j.p_CM) - calc_point(j.parent, j.p_PF);
      return component_of(dot((rotation_of(j.parent) * j.R_PF).column(2), gap), component);
    }
    case Quantity::Kind::ElementTranslation:
    case Quantity::Kind::ElementRotation: {
      const CompiledElement& e = elements[i];
      const ElementGeometry g = measure_zone(e);
      const double* d = g.deformation.c + (q.kind == Quantity::Kind::ElementTranslation ? 0 : 3);
      return component_of(Vec3{d[0], d[1], d[2]}, component);
    }
    case Quantity::Kind::ElementForce:
    case Quantity::Kind::ElementMoment: {
      unpack_element(i);
      const double* f = s.element[i].resultant.c + (q.kind == Quantity::Kind::ElementForce ? 0 : 3);
      return component_of(-Vec3{f[0], f[1], f[2]}, component);
    }
    case Quantity::Kind::HingeRotation:
      return component_of(calc_hinge_rotation(i), component);
    case Quantity::Kind::HingeMoment:
      if (is_loose(i)) unpack_element(E + i);
      return component_of(-(was_loosened(i) ? s.element[E + i] : s.rotational[i]).resultant.c[5], component);
    case Quantity::Kind::BushingTranslation:
      return component_of(measure_bushing(i).u, component);
    case Quantity::Kind::BushingRotation:
      return component_of(measure_bushing(i).r, component);
    case Quantity::Kind::BushingForce:
    case Quantity::Kind::BushingMoment: {
      const ComponentState* c = s.bushing[i].component + (q.kind == Quantity::Kind::BushingForce ? 0 : 3);
      const auto force_of = [&](int k) { return -c[k].spring - c[k].damper; };
      return component_of(Vec3{force_of(0), force_of(1), force_of(2)}, component);
    }
    case Quantity::Kind::SpringLength: {
      ForceRow row;
      return component_of(measure_spring(forces.springs[i], row), component);
    }
    case Quantity::Kind::SpringForce:
      return component_of(s.spring[i].component.spring + s.spring[i].component.damper, component);
    case Quantity::Kind::TorsionAngle: {
      ForceRow row;
      return component_of(measure_torsion(forces.torsions[i], row) - forces.torsions[i].free_angle, component);
    }
    case Quantity::Kind::TorsionTorque:
      return component_of(s.torsion[i].component.spring + s.torsion[i].component.damper, component);
    case Quantity::Kind::CableLength:
      return component_of(calc_cable_length(i), component);
    case Quantity::Kind::CableForce:
      return component_of(s.cable[i].force, component);
  }
  return 0;
}

void System::find_triggered(std::vector<DueEvent>& due) {
  size_t kept = 0, kept_values = 0, value = 0;
  const size_t timed = due.size();
  for (const int index : state.waiting) {
    const Event& event = model.events[static_cast<size_t>(index)];
    double passed = kUnlimited;  // the first of those that hold
    const size_t first = kept_values;
    for (const Trigger& t : event.triggers) {
      const double before = state.trigger_values[value++];
      // of forces nothing is known before the first step, of reactions nothing in one that undoes a rest
      if ((state.first_kick && is_force(t.quantity.kind)) || (state.has_rest && is_reaction(t.quantity.kind))) {
        state.trigger_values[kept_values++] = before;
        continue;
      }
      const double x = calc_component(t.quantity, t.component);
      if (t.rising ? x >= t.limit : x <= t.limit) passed = std::min(passed, find_passing_time(event, t, before, x));
      state.trigger_values[kept_values++] = x;
    }
    if (passed < kUnlimited) {
      due.push_back({index, passed});
      kept_values = first;
    } else {
      state.waiting[kept++] = index;
    }
  }
  state.waiting.resize(kept);
  state.trigger_values.resize(kept_values);
  if (due.size() == timed) return;
  // what fires at the same time fires in the order of the model
  std::sort(due.begin(), due.end(), [](const DueEvent& a, const DueEvent& b) {
    return a.time != b.time ? a.time < b.time : a.index < b.index;
  });
}

double System::find_passing_time(const Event& event, const Trigger& t, double before, double now) const {
  // forces are those of the evaluation before
  const double known = is_force(t.quantity.kind) ? state.time - state.last_kick : state.time;
  if (state.first_kick) return state.time;
  // it waits since this step: what holds now is taken to have held then
  if (before == kUnlimited) return std::min(event.time, state.time);
  return std::max(event.time, known - find_passing(before, now, t.limit) * state.last_kick);
}

}  // namespace topple::mbs
