#include "mbs/forces.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

void move_to(ComponentState& c, double x, bool has_been_evaluated) {
  c.before = has_been_evaluated ? c.deformation : x;
  c.deformation = x;
}

/// The rotation vector of the same rotation nearest to the one before: it grows beyond a half turn, up to a full one.
Vec3 find_nearest_rotation(const Vec3& r, const Vec3& before) {
  const double angle = norm(r);
  if (angle < 1e-6) return r;
  constexpr double turn = 2 * 3.14159265358979323846;
  const Vec3 other = (1 - turn / angle) * r, d = r - before, e = other - before;
  return dot(e, e) < dot(d, d) ? other : r;
}

constexpr double kLargestRotation = 6;  // of a bushing, short of the full turn where its rotation vector ends [rad]

}  // namespace

void System::compile_forces() {
  State& s = state;
  bool is_damped = false;
  for (const SpringDamper& from : model.springs) {
    CompiledSpring c;
    c.a = from.a.index;
    c.b = from.b.index;
    c.p_A = from.p_A;
    c.p_B = from.p_B;
    c.free_length = from.free_length;
    c.spring = compile_characteristic(from.spring);
    c.damper = compile_characteristic(from.damper);
    c.tension_strength = from.tension_strength;
    c.compression_strength = from.compression_strength;
    is_damped = is_damped || !c.damper.is_zero;
    forces.springs.push_back(std::move(c));
  }
  for (const RotationalSpring& from : model.rotational_springs) {
    CompiledTorsion c;
    c.joint = from.joint.index;
    c.free_angle = from.free_angle;
    c.spring = compile_characteristic(from.spring);
    c.damper = compile_characteristic(from.damper);
    c.strength = from.strength;
    is_damped = is_damped || !c.damper.is_zero;
    forces.torsions.push_back(std::move(c));
  }
  for (const Bushing& from : model.bushings) {
    CompiledBushing c;
    c.a = from.a.index;
    c.b = from.b.index;
    c.p_AF = from.X_AF.p;
    c.p_BM = from.X_BM.p;
    c.q_AF = normalized(from.X_AF.q);
    c.q_BM = normalized(from.X_BM.q);
    for (int i = 0; i < 6; ++i) {
      c.spring[i] = compile_characteristic(from.spring[i]);
      c.damper[i] = compile_characteristic(from.damper[i]);
      c.strength[i] = from.strength[i];
      c.is_damped = c.is_damped || !c.damper[i].is_zero;
      c.turns = c.turns || (i >= 3 && !(c.spring[i].is_zero && c.damper[i].is_zero));
      c.is_bound = c.is_bound && c.spring[i].has_bound_slope;
    }
    is_damped = is_damped || c.is_damped;
    forces.bushings.push_back(std::move(c));
  }
  s.spring.resize(forces.springs.size());
  s.torsion.resize(forces.torsions.size());
  s.bushing.resize(forces.bushings.size());
  compile_loads();
  if (!is_damped) return;
  forces.damped_place.assign(B, -1);
  const auto add = [&](int body) {
    if (body < 0 || fixed[static_cast<size_t>(body)] || forces.damped_place[static_cast<size_t>(body)] >= 0) return;
    forces.damped_place[static_cast<size_t>(body)] = static_cast<int>(forces.damped.size());
    forces.damped.emplace_back();
    forces.damped.back().body = body;
  };
  for (const CompiledSpring& c : forces.springs)
    if (!c.damper.is_zero) add(c.a), add(c.b);
  for (const CompiledTorsion& c : forces.torsions)
    if (!c.damper.is_zero)
      add(joints[static_cast<size_t>(c.joint)].parent), add(joints[static_cast<size_t>(c.joint)].child);
  for (const CompiledBushing& c : forces.bushings)
    if (c.is_damped) add(c.a), add(c.b);
  for (const CompiledJoint& j : joints)
    for (const int b : {j.parent, j.child})
      if (b >= 0 && forces.damped_place[static_cast<size_t>(b)] >= 0) forces.damps_jointed = true;
}

Vec3 System::calc_point(int body, const Vec3& p) const {
  if (body < 0) return p;
  const size_t b = static_cast<size_t>(body);
  return state.p[b] + state.R[b] * (p - state.p_offset[b]);
}

double System::measure_spring(const CompiledSpring& c, ForceRow& row) const {
  const Vec3 p_A = calc_point(c.a, c.p_A), p_B = calc_point(c.b, c.p_B), d = p_B - p_A;
  const double length = norm(d);
  // points that coincide have no direction between them; a spring without free length carries nothing there
  row.line = length > 0 ? (1 / length) * d : Vec3{};
  row.turn_a = cross(p_A - centre_of(c.a), row.line);
  row.turn_b = cross(p_B - centre_of(c.b), row.line);
  return length;
}

double System::measure_torsion(const CompiledTorsion& c, ForceRow& row) const {
  const CompiledJoint& j = joints[static_cast<size_t>(c.joint)];
  const Vec3 axis = (rotation_of(j.parent) * j.R_PF).column(2);
  row = {{}, axis, axis};
  return state.joint[static_cast<size_t>(c.joint)].angle;
}

FrameDeformation System::measure_frames(int a, int b, const Vec3& p_AF, const Quat& q_AF, const Vec3& p_BM,
                                        const Quat& q_BM) const {
  FrameDeformation d;
  const Quat q_F = pose_of(a).q * q_AF, q_M = pose_of(b).q * q_BM;
  d.F = to_matrix(q_F);
  d.p_M = calc_point(b, p_BM);
  d.u = transpose_times(d.F, d.p_M - calc_point(a, p_AF));
  d.r = log_rotation(conjugate(q_F) * q_M);
  return d;
}

FrameDeformation System::measure_bushing(size_t i) const {
  const CompiledBushing& c = forces.bushings[i];
  const BushingState& s = state.bushing[i];
  FrameDeformation d = measure_frames(c.a, c.b, c.p_AF, c.q_AF, c.p_BM, c.q_BM);
  if (s.has_been_evaluated)
    d.r = find_nearest_rotation(d.r,
                                {s.component[3].deformation, s.component[4].deformation, s.component[5].deformation});
  return d;
}

void System::find_bushing_rows(const CompiledBushing& c, const FrameDeformation& d, ForceRow rows[6]) const {
  const Vec3 lever_a = d.p_M - centre_of(c.a), lever_b = d.p_M - centre_of(c.b);
  const double kappa = calc_kappa(dot(d.r, d.r));
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = d.F.column(i);
    rows[i] = {axis, cross(lever_a, axis), cross(lever_b, axis)};
    Vec3 e;
    e[i] = 1;
    const Vec3 re = cross(d.r, e), turn = d.F * (e + 0.5 * re + kappa * cross(d.r, re));
    rows[3 + i] = {{}, turn, turn};
  }
}

void System::load_body(int body, const Vec3& f, const Vec3& t) {
  if (body < 0 || fixed[static_cast<size_t>(body)]) {
    ground_reaction -= f;
    return;
  }
  force[static_cast<size_t>(body)] += f;
  torque[static_cast<size_t>(body)] += t;
}

void System::pull(int a, int b, const ForceRow& row, double f) {
  load_body(a, f * row.line, f * row.turn_a);
  load_body(b, -f * row.line, -f * row.turn_b);
}

double System::calc_inverse_mass(int body, const Vec3& line, const Vec3& turn) const {
  if (body < 0 || fixed[static_cast<size_t>(body)]) return 0;
  const size_t b = static_cast<size_t>(body);
  return state.body[b].inverse_mass * dot(line, line) + dot(turn, calc_world_inverse_inertia(b) * turn);
}

double System::calc_row_rate(int a, int b, const ForceRow& row) const {
  double rate = 0;
  const auto add = [&](int body, double sign, const Vec3& turn) {
    if (body < 0 || fixed[static_cast<size_t>(body)]) return;
    rate += sign * (dot(row.line, state.v[static_cast<size_t>(body)]) + dot(turn, state.w[static_cast<size_t>(body)]));
  };
  add(a, -1, row.turn_a);
  add(b, 1, row.turn_b);
  return rate;
}

void System::watch_stiffness(int a, int b, const ForceRow& row, double slope, const char* kind,
                             const std::string& name) {
  const double omega2 =
      slope * (calc_inverse_mass(a, row.line, row.turn_a) + calc_inverse_mass(b, row.line, row.turn_b));
  const double h2 = omega2 * step * step;
  if (options.step <= 0) {
    if (h2 > 4 * options.step_safety * options.step_safety) state.review_times.push_back(state.time);
    return;
  }
  if (!(h2 > 4) || !trouble.empty()) return;
  char words[200];
  std::snprintf(words, sizeof words,
                " has stiffened to %.4g N/m or N·m/rad: it needs a step below %.3g s, and the step is %.3g s", slope,
                2 / std::sqrt(omega2), step);
  trouble = std::string(kind) + " \"" + name + "\"" + words;
}

void System::add_damper(int a, int b, const ForceRow& row, const CompiledCharacteristic& law, ComponentState& c,
                        double& damping, const std::string& name) {
  if (law.is_zero) return;
  DamperRow d;
  d.row = row;
  const auto place = [&](int body) { return body < 0 ? -1 : forces.damped_place[static_cast<size_t>(body)]; };
  d.a = a;
  d.b = b;
  d.place_a = place(a);
  d.place_b = place(b);
  d.law = &law;
  d.state = &c;
  d.damping = &damping;
  d.name = &name;
  forces.damper_rows.push_back(d);
}

void System::evaluate_springs(bool at_rest) {
  forces.damper_rows.clear();
  for (size_t i = 0; i < forces.springs.size(); ++i) {
    SpringState& s = state.spring[i];
    if (!s.live) continue;
    const CompiledSpring& k = forces.springs[i];
    ForceRow row;
    const double x = measure_spring(k, row) - k.free_length, f = calc_force(k.spring, x);
    if (!at_rest && (f > k.tension_strength || -f > k.compression_strength)) {
      const double strength = f > 0 ? k.tension_strength : -k.compression_strength;
      s.plastic += end_spring(i, find_ending(s.component.spring, f, strength));
      say({Happening::Kind::SpringBroken, state.time, static_cast<int>(i), -1, f > 0 ? "tension" : "compression", 0});
      continue;
    }
    move_to(s.component, x, s.has_been_evaluated);
    if (s.has_been_evaluated && dot(s.along, row.line) < 0) {
      // it went through its anchor: what it pulled before pushes along the line of now
      s.component.before = -s.component.before - 2 * k.free_length;
      s.component.damper = -s.component.damper;
    }
    s.along = row.line;
    s.component.spring = f;
    s.energy = calc_integral(k.spring, x);
    s.has_been_evaluated = true;
    pull(k.a, k.b, row, f);
    if (!k.spring.has_bound_slope && !at_rest)
      watch_stiffness(k.a, k.b, row, calc_slope(k.spring, x), "spring", model.springs[i].name);
    add_damper(k.a, k.b, row, k.damper, s.component, s.damping, model.springs[i].name);
  }
  for (size_t i = 0; i < forces.torsions.size(); ++i) {
    SpringState& s = state.torsion[i];
    if (!s.live) continue;
    const CompiledTorsion& k = forces.torsions[i];
    const CompiledJoint& j = joints[static_cast<size_t>(k.joint)];
    JointState& js = state.joint[static_cast<size_t>(k.joint)];
    ForceRow row;
    js.angle = measure_torsion(k, row);
    const double x = js.angle - k.free_angle, f = calc_force(k.spring, x);
    const bool is_loose = !js.live;  // its joint has been released
    if (is_loose || (!at_rest && std::abs(f) > k.strength)) {
      s.plastic += end_torsion(
          i, is_loose ? find_ending(js.ended) : find_ending(s.component.spring, f, f > 0 ? k.strength : -k.strength));
      say({Happening::Kind::RotationalSpringBroken, state.time, static_cast<int>(i), -1,
           is_loose ? "released" : "torsion", 0});
      continue;
    }
    move_to(s.component, x, s.has_been_evaluated);
    s.component.spring = f;
    s.energy = calc_integral(k.spring, x);
    s.has_been_evaluated = true;
    pull(j.parent, j.child, row, f);
    if (!k.spring.has_bound_slope && !at_rest)
      watch_stiffness(j.parent, j.child, row, calc_slope(k.spring, x), "rotational spring",
                      model.rotational_springs[i].name);
    add_damper(j.parent, j.child, row, k.damper, s.component, s.damping, model.rotational_springs[i].name);
  }
  for (size_t i = 0; i < forces.bushings.size(); ++i)
    if (state.bushing[i].live) evaluate_bushing(i, at_rest);
}

void System::evaluate_bushing(size_t i, bool at_rest) {
  BushingState& s = state.bushing[i];
  const CompiledBushing& k = forces.bushings[i];
  const FrameDeformation d = measure_bushing(i);
  const double x[6] = {d.u.x, d.u.y, d.u.z, d.r.x, d.r.y, d.r.z};
  double f[6];
  const char* broken = nullptr;
  Ending ending;
  for (int c = 0; c < 6; ++c) {
    f[c] = calc_force(k.spring[c], x[c]);
    if (at_rest || !(std::abs(f[c]) > k.strength[c]) || broken) continue;
    ending = find_ending(s.component[c].spring, f[c], f[c] > 0 ? k.strength[c] : -k.strength[c]);
    broken = c == 0 ? (f[0] > 0 ? "tension" : "compression") : c < 3 ? "shear" : c == 3 ? "torsion" : "rotation";
  }
  if (broken) {
    s.plastic += end_bushing(i, ending);
    say({Happening::Kind::BushingBroken, state.time, static_cast<int>(i), -1, broken, 0});
    return;
  }
  if (k.turns && !at_rest && dot(d.r, d.r) > kLargestRotation * kLargestRotation && trouble.empty())
    trouble =
        "bushing \"" + model.bushings[i].name +
        "\" is turned by nearly a full turn, where its rotation vector ends: a rotational spring of a joint counts "
        "turns";
  s.energy = 0;
  for (int c = 0; c < 6; ++c) {
    move_to(s.component[c], x[c], s.has_been_evaluated);
    s.component[c].spring = f[c];
    s.energy += calc_integral(k.spring[c], x[c]);
  }
  s.has_been_evaluated = true;
  load_frames(k.a, k.b, d, f);
  if (!k.is_damped && (k.is_bound || at_rest)) return;
  ForceRow rows[6];
  find_bushing_rows(k, d, rows);
  for (int c = 0; c < 6; ++c) {
    if (!k.spring[c].has_bound_slope && !at_rest)
      watch_stiffness(k.a, k.b, rows[c], calc_slope(k.spring[c], x[c]), "bushing", model.bushings[i].name);
    add_damper(k.a, k.b, rows[c], k.damper[c], s.component[c], s.damping, model.bushings[i].name);
  }
}

void System::load_frames(int a, int b, const FrameDeformation& d, const double f[6]) {
  const Vec3 t = d.F * calc_conjugate_torque(d.r, {f[3], f[4], f[5]});
  const Vec3 n = d.F * Vec3{f[0], f[1], f[2]};
  load_body(a, n, cross(d.p_M - centre_of(a), n) + t);
  load_body(b, -n, -(cross(d.p_M - centre_of(b), n) + t));
}

std::vector<StiffRow> System::calc_spring_stiffness(bool fast, double force_scale) const {
  std::vector<StiffRow> out;
  const auto add = [&](int a, int b, const ForceRow& row, double k) {
    if (k != 0) out.push_back({a, b, row, k});
  };
  const auto stiffness_of = [&](const CompiledCharacteristic& c, double x, double strength, int a, int b,
                                const ForceRow& row) {
    const double tangent = std::max(0.0, calc_slope(c, x));
    if (c.is_zero) return 0.0;
    if (fast) {
      if (c.has_bound_slope) return std::max(tangent, find_steepest(c, x, x));
      // where the motion that its bodies have can stretch it to; four times the energy: with few steps to a swing the
      // scheme reaches further, and what else moves may help
      const double inverse = calc_inverse_mass(a, row.line, row.turn_a) + calc_inverse_mass(b, row.line, row.turn_b);
      const double rate = calc_row_rate(a, b, row);
      const Reach r = find_reach(c, x, inverse > 0 ? 2 * rate * rate / inverse : 0, strength);
      return std::max(tangent, find_steepest(c, r.from, r.to));
    }
    // where a law is flat its chord leads to where it carries something
    if (c.kind == Characteristic::Kind::Linear) return tangent;
    const double chord = find_chord(c, force_scale);
    return tangent > 1e-3 * chord ? tangent : chord;
  };
  // what will pull under the load and does not yet would leave its bodies to swing about it: with what the load gives
  const auto pull_of = [&](double pull, double stiff) { return !fast && pull == 0 && stiff > 0 ? force_scale : pull; };
  // what is tight also holds its points sideways
  const auto add_between = [&](int a, int b, const Vec3& p_A, const Vec3& p_B, double stiff, double across) {
    const Vec3 d = p_B - p_A;
    const double length = norm(d);
    const Vec3 line = length > 0 ? (1 / length) * d : Vec3{1, 0, 0};
    Vec3 side = std::abs(line.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    side = cross(line, side);
    side = (1 / norm(side)) * side;
    const auto along = [&](const Vec3& n) {
      return ForceRow{n, cross(p_A - centre_of(a), n), cross(p_B - centre_of(b), n)};
    };
    add(a, b, along(line), stiff);
    if (across > 0) {
      add(a, b, along(side), across);
      add(a, b, along(cross(line, side)), across);
    }
  };
  for (size_t i = 0; i < forces.springs.size(); ++i) {
    if (!state.spring[i].live) continue;
    const CompiledSpring& k = forces.springs[i];
    ForceRow row;
    const double length = measure_spring(k, row), x = length - k.free_length;
    const double stiff = stiffness_of(k.spring, x, std::max(k.tension_strength, k.compression_strength), k.a, k.b, row);
    // one of no length is the same in all directions
    const double across = length > 0           ? pull_of(calc_force(k.spring, x), stiff) / length
                          : k.free_length == 0 ? stiff
                                               : 0;
    add_between(k.a, k.b, calc_point(k.a, k.p_A), calc_point(k.b, k.p_B), stiff, across);
  }
  for (size_t i = 0; i < model.cables.size(); ++i) {
    if (!state.cable[i].live) continue;
    const Cable& k = model.cables[i];
    const Vec3 p_A = calc_point(k.a.index, k.p_A), p_B = calc_point(k.b.index, k.p_B);
    const double length = norm(p_B - p_A);
    const double across =
        length > 0 ? pull_of(k.stiffness * (length - state.cable[i].rest_length), k.stiffness) / length : 0;
    add_between(k.a.index, k.b.index, p_A, p_B, k.stiffness, across);
  }
  for (size_t i = 0; i < forces.torsions.size(); ++i) {
    if (!state.torsion[i].live) continue;
    const CompiledTorsion& k = forces.torsions[i];
    const CompiledJoint& j = joints[static_cast<size_t>(k.joint)];
    ForceRow row;
    const double x = measure_torsion(k, row) - k.free_angle;
    add(j.parent, j.child, row, stiffness_of(k.spring, x, k.strength, j.parent, j.child, row));
  }
  for (size_t i = 0; i < forces.bushings.size(); ++i) {
    if (!state.bushing[i].live) continue;
    const CompiledBushing& k = forces.bushings[i];
    const FrameDeformation d = measure_bushing(i);
    ForceRow rows[6];
    find_bushing_rows(k, d, rows);
    const double x[6] = {d.u.x, d.u.y, d.u.z, d.r.x, d.r.y, d.r.z};
    for (int c = 0; c < 6; ++c)
      add(k.a, k.b, rows[c], stiffness_of(k.spring[c], x[c], k.strength[c], k.a, k.b, rows[c]));
  }
  return out;
}

bool System::find_overload(std::string& message) const {
  char words[120];
  const auto complain = [&](const std::string& what, double f, double strength, const char* unit = "N") {
    std::snprintf(words, sizeof words, " would carry %.4g %s, more than its strength of %.4g %s", std::abs(f), unit,
                  strength, unit);
    message = "no dead-load equilibrium: " + what + words;
    return true;
  };
  for (size_t i = 0; i < forces.springs.size(); ++i) {
    const double f = state.spring[i].component.spring;
    const double strength = f > 0 ? forces.springs[i].tension_strength : forces.springs[i].compression_strength;
    if (state.spring[i].live && std::abs(f) > strength)
      return complain("spring \"" + model.springs[i].name + "\"", f, strength);
  }
  for (size_t i = 0; i < forces.torsions.size(); ++i)
    if (const double f = state.torsion[i].component.spring;
        state.torsion[i].live && std::abs(f) > forces.torsions[i].strength)
      return complain("rotational spring \"" + model.rotational_springs[i].name + "\"", f, forces.torsions[i].strength,
                      "N·m");
  for (size_t i = 0; i < forces.bushings.size(); ++i)
    for (int c = 0; c < 6; ++c)
      if (const double f = state.bushing[i].component[c].spring;
          state.bushing[i].live && std::abs(f) > forces.bushings[i].strength[c])
        return complain("bushing \"" + model.bushings[i].name + "\"", f, forces.bushings[i].strength[c],
                        c < 3 ? "N" : "N·m");
  for (size_t i = 0; i < model.cables.size(); ++i)
    if (state.cable[i].live && state.cable[i].force > model.cables[i].strength)
      return complain("cable \"" + model.cables[i].name + "\"", state.cable[i].force, model.cables[i].strength);
  for (size_t i = 0; i < joints.size(); ++i)
    if (const JointOverload over = state.joint[i].live ? find_joint_overload(i) : JointOverload{}; over.what != nullptr)
      return complain("joint \"" + model.joints[i].name + "\" (" + over.what + ")", over.load, over.limit,
                      over.what == std::string_view("moment") ? "N·m" : "N");
  return false;
}

void System::remove_spring(size_t i, double time) {
  if (state.spring[i].live) state.removed += end_spring(i, find_ending(time));
}

void System::remove_torsion(size_t i, double time) {
  if (state.torsion[i].live) state.removed += end_torsion(i, find_ending(time));
}

void System::remove_bushing(size_t i, double time) {
  if (state.bushing[i].live) state.removed += end_bushing(i, find_ending(time));
}

void System::add_energy_of_forces(Energy& e) const {
  for (const auto* list : {&state.spring, &state.torsion})
    for (const SpringState& s : *list) {
      e.elastic += s.energy;
      e.plastic += s.plastic;
      e.damping += s.damping;
    }
  for (const BushingState& s : state.bushing) {
    e.elastic += s.energy;
    e.plastic += s.plastic;
    e.damping += s.damping;
  }
  for (const LoadState& l : state.load) e.loads += l.work;
}

void System::view_forces(View& v) const {
  const size_t S = forces.springs.size(), T = forces.torsions.size(), K = forces.bushings.size();
  v.spring_length.resize(S);
  v.spring_force.resize(S);
  ForceRow row;
  for (size_t i = 0; i < S; ++i) {
    v.spring_length[i] = measure_spring(forces.springs[i], row);
    v.spring_force[i] = state.spring[i].component.spring + state.spring[i].component.damper;
  }
  v.torsion_angle.resize(T);
  v.torsion_torque.resize(T);
  for (size_t i = 0; i < T; ++i) {
    v.torsion_angle[i] = measure_torsion(forces.torsions[i], row) - forces.torsions[i].free_angle;
    v.torsion_torque[i] = state.torsion[i].component.spring + state.torsion[i].component.damper;
  }
  v.bushing_translation.resize(K);
  v.bushing_rotation.resize(K);
  v.bushing_force.resize(K);
  v.bushing_moment.resize(K);
  for (size_t i = 0; i < K; ++i) {
    const FrameDeformation d = measure_bushing(i);
    v.bushing_translation[i] = d.u;
    v.bushing_rotation[i] = d.r;
    const auto total = [&](int c) {
      return -state.bushing[i].component[c].spring - state.bushing[i].component[c].damper;
    };
    v.bushing_force[i] = {total(0), total(1), total(2)};
    v.bushing_moment[i] = {total(3), total(4), total(5)};
  }
}

}  // namespace topple::mbs
