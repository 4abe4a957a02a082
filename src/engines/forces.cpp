#include "engines/forces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engines/articulation.h"
#include "engines/joint_frames.h"

namespace topple::engines {

namespace {

using mbs::Characteristic;

bool is_nothing(const Characteristic& c) { return c.kind == Characteristic::Kind::Linear && c.rate == 0; }

/// Integral of a table from its first point.
double integrate_table(const Characteristic& c, double x) {
  double sum = 0;
  if (x < c.x.front()) return (x - c.x.front()) * c.f.front();
  for (size_t i = 0; i + 1 < c.x.size(); ++i) {
    const double end = std::min(x, c.x[i + 1]), width = c.x[i + 1] - c.x[i];
    const double f_end = c.f[i] + (c.f[i + 1] - c.f[i]) * (end - c.x[i]) / width;
    sum += 0.5 * (c.f[i] + f_end) * (end - c.x[i]);
    if (x <= c.x[i + 1]) return sum;
  }
  return sum + (x - c.x.back()) * c.f.back();
}

/// A law whose zones never rupture.
mbs::ZoneLaw make_lasting(mbs::ZoneLaw law) {
  law.rupture_rotation = law.crush_length = law.rupture_elongation = law.slip_rupture = law.twist_rupture =
      mbs::kUnlimited;
  return law;
}

/// Of the vectors of one rotation the one nearest to another.
Vec3 find_nearest_rotation(const Vec3& r, const Vec3& near) {
  const double angle = norm(r);
  if (!(angle > 0)) return r;
  const double along = dot(r, near) / angle;
  return (angle + 2 * std::numbers::pi * std::round((along - angle) / (2 * std::numbers::pi))) / angle * r;
}

bool is_same(const Motion& a, const Motion& b) { return a.X_WB == b.X_WB && a.v_WB == b.v_WB && a.w_WB == b.w_WB; }

}  // namespace

double calc_characteristic(const Characteristic& c, double x) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return c.rate * x;
    case Characteristic::Kind::Polynomial: {
      double f = 0;
      for (size_t i = c.coefficients.size(); i-- > 0;) f = f * x + c.coefficients[i];
      return f;
    }
    case Characteristic::Kind::Table: {
      if (x <= c.x.front()) return c.f.front();
      if (x >= c.x.back()) return c.f.back();
      const size_t i = static_cast<size_t>(std::upper_bound(c.x.begin(), c.x.end(), x) - c.x.begin()) - 1;
      return c.f[i] + (c.f[i + 1] - c.f[i]) * (x - c.x[i]) / (c.x[i + 1] - c.x[i]);
    }
  }
  return 0;
}

double calc_potential(const Characteristic& c, double x) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return 0.5 * c.rate * x * x;
    case Characteristic::Kind::Polynomial: {
      double e = 0;
      for (size_t i = c.coefficients.size(); i-- > 0;) e = e * x + c.coefficients[i] / static_cast<double>(i + 1);
      return e * x;
    }
    case Characteristic::Kind::Table:
      return integrate_table(c, x) - integrate_table(c, 0);
  }
  return 0;
}

Forces::Forces(const mbs::Model& model, Say say) : model_(model), say_(std::move(say)) {
  for (const mbs::ZoneLaw& law : model.laws) {
    laws_.push_back(mbs::compile_law(law));
    lasting_laws_.push_back(mbs::compile_law(make_lasting(law)));
  }
  // eq. 10 of docs/theory/zones.md
  const auto viscous = [](double ratio) { return 4 * ratio / (1 - 2 * ratio); };
  for (const mbs::ZoneElement& e : model.elements) {
    Zone z;
    for (int i = 0; i < 3; ++i) {
      z.parameters.stiffness[i] = e.translational_stiffness[i];
      z.parameters.stiffness[3 + i] = e.rotational_stiffness[i];
    }
    for (int i = 0; i < 2; ++i) z.parameters.cracking[i] = e.cracking[i];
    z.parameters.viscous = viscous(e.damping_ratio);
    z.parameters.crush_through = e.crush_through;
    z.parameters.stations = static_cast<int>(e.stations.size());
    for (size_t i = 0; i < e.stations.size(); ++i) {
      z.parameters.x[i] = e.stations[i].x;
      z.parameters.law[i] = e.stations[i].law.index;
    }
    zone_.push_back(z);
  }
  for (const mbs::RotationalElement& r : model.rotational_elements) {
    Zone z;
    for (double& k : z.parameters.stiffness) k = 0;
    z.parameters.stiffness[5] = r.stiffness;
    z.parameters.cracking[1] = r.cracking;
    z.parameters.external_axial = true;
    z.parameters.viscous = viscous(r.damping_ratio);
    if (r.law.is_valid()) {
      z.parameters.stations = 1;
      z.parameters.law[0] = r.law.index;
    }
    rotational_.push_back(z);
  }
  spring_.resize(model.springs.size());
  torsion_.resize(model.rotational_springs.size());
  bushing_.resize(model.bushings.size());
  rope_.resize(model.cables.size());
  load_.resize(model.loads.size());
  for (const mbs::Event& event : model.events)
    for (const mbs::Action& a : event.actions)
      if (a.kind == mbs::Action::Kind::ApplyLoad) load_[static_cast<size_t>(a.index)].has_begun = false;
  for (const auto& s : model.springs) depends_on_velocity_ |= !is_nothing(s.damper);
  for (const auto& s : model.rotational_springs) depends_on_velocity_ |= !is_nothing(s.damper);
  for (const auto& b : model.bushings)
    for (const auto& d : b.damper) depends_on_velocity_ |= !is_nothing(d);
  has_power_ = depends_on_velocity_ || !model.loads.empty();
}

void Forces::prepare(mbs::ZoneParameters& p, double h) const {
  p.relaxation = 1 - std::exp(-h * model_.damping_frequency);
}

Pose Forces::pose_of(const Motion& m, mbs::BodyId id) const {
  return id == mbs::kGround ? Pose{} : m.X_WB[static_cast<size_t>(id.index)];
}

Vec3 Forces::velocity_at(const Motion& m, mbs::BodyId id, const Vec3& p_W) const {
  if (id == mbs::kGround) return {};
  const size_t b = static_cast<size_t>(id.index);
  return m.v_WB[b] + cross(m.w_WB[b], p_W - m.X_WB[b].p);
}

Forces::Six Forces::calc_six(const Motion& m, mbs::BodyId a, const Pose& X_AF, mbs::BodyId b, const Pose& X_BM,
                             const Vec3& near) const {
  const Pose X_WF = pose_of(m, a) * X_AF, X_WM = pose_of(m, b) * X_BM;
  Six s;
  s.R_WF = to_matrix(X_WF.q);
  s.p_M = X_WM.p;
  const Vec3 u = transpose_times(s.R_WF, X_WM.p - X_WF.p);
  s.r = find_nearest_rotation(log_rotation(conjugate(X_WF.q) * X_WM.q), near);
  for (int i = 0; i < 3; ++i) {
    s.deformation.c[i] = u[i];
    s.deformation.c[3 + i] = s.r[i];
  }
  return s;
}

mbs::Six Forces::calc_rates(const Motion& m, mbs::BodyId a, mbs::BodyId b, const Six& s) const {
  const auto spin = [&](mbs::BodyId id) { return id == mbs::kGround ? Vec3{} : m.w_WB[static_cast<size_t>(id.index)]; };
  const Vec3 w = transpose_times(s.R_WF, spin(b) - spin(a));
  const Vec3 u = transpose_times(s.R_WF, velocity_at(m, b, s.p_M) - velocity_at(m, a, s.p_M));
  const Vec3 r = w - 0.5 * cross(s.r, w) + mbs::calc_kappa(dot(s.r, s.r)) * cross(s.r, cross(s.r, w));
  mbs::Six rate;
  for (int i = 0; i < 3; ++i) {
    rate.c[i] = u[i];
    rate.c[3 + i] = r[i];
  }
  return rate;
}

double Forces::angle_of(const Motion& m, mbs::JointId id, double previous) const {
  const mbs::Joint& j = model_.joints[static_cast<size_t>(id.index)];
  JointFrames f;
  f.X_WF = pose_of(m, j.parent) * j.X_PF;
  f.X_WM = pose_of(m, j.child) * j.X_CM;
  return calc_joint_angle(f, previous);
}

Vec3 Forces::axis_of(const Motion& m, mbs::JointId id) const {
  const mbs::Joint& j = model_.joints[static_cast<size_t>(id.index)];
  return to_matrix((pose_of(m, j.parent) * j.X_PF).q).column(2);
}

double Forces::angle_rate_of(const Motion& m, mbs::JointId id) const {
  const mbs::Joint& j = model_.joints[static_cast<size_t>(id.index)];
  const auto spin = [&](mbs::BodyId b) { return b == mbs::kGround ? Vec3{} : m.w_WB[static_cast<size_t>(b.index)]; };
  return dot(axis_of(m, id), spin(j.child) - spin(j.parent));
}

double Forces::factor_of(size_t i, double time) const {
  const mbs::Load& l = model_.loads[i];
  if (l.time.empty()) return 1;
  const double t = time - load_[i].begin;
  if (t <= l.time.front()) return l.factor.front();
  if (t >= l.time.back()) return l.factor.back();
  const size_t k = static_cast<size_t>(std::upper_bound(l.time.begin(), l.time.end(), t) - l.time.begin()) - 1;
  return l.factor[k] + (l.factor[k + 1] - l.factor[k]) * (t - l.time[k]) / (l.time[k + 1] - l.time[k]);
}

void Forces::push(const Motion& m, mbs::BodyId id, const Vec3& p_W, const Vec3& force, std::vector<Wrench>& on) const {
  if (is_ground(model_, id.index)) {
    on_ground_ += force;
    return;
  }
  Wrench& w = on[static_cast<size_t>(id.index)];
  w.force += force;
  w.torque += cross(p_W - m.X_WB[static_cast<size_t>(id.index)].p, force);
}

void Forces::twist(mbs::BodyId id, const Vec3& torque, std::vector<Wrench>& on) const {
  if (!is_ground(model_, id.index)) on[static_cast<size_t>(id.index)].torque += torque;
}

void Forces::push_six(const Motion& m, mbs::BodyId a, mbs::BodyId b, const Six& s, const double f[6],
                      std::vector<Wrench>& on) const {
  const Vec3 torque = s.R_WF * mbs::calc_conjugate_torque(s.r, {f[3], f[4], f[5]});
  const Vec3 force = s.R_WF * Vec3{f[0], f[1], f[2]};
  push(m, a, s.p_M, force, on);
  push(m, b, s.p_M, -force, on);
  twist(a, torque, on);
  twist(b, -torque, on);
}

mbs::ElementGeometry Forces::measure_zone(const Zone& z, const Motion& m, mbs::BodyId a, const Pose& X_AF,
                                          mbs::BodyId b, const Pose& X_BM) const {
  return mbs::measure_element(pose_of(m, a) * X_AF, pose_of(m, b) * X_BM, z.parameters.span());
}

void Forces::push_zone_forces(const Motion& m, mbs::BodyId a, mbs::BodyId b, const mbs::ElementGeometry& g,
                              const mbs::Six& resultant, std::vector<Wrench>& on) const {
  const mbs::ElementForces pushed = mbs::calc_element_forces(g, resultant);
  push(m, a, g.p_a, pushed.force, on);
  push(m, b, g.p_b, -pushed.force, on);
  twist(a, pushed.torque_a, on);
  twist(b, -pushed.torque_b, on);
}

void Forces::start(const Motion& motion) {
  accepted_ = 0;
  // a cable's length without force is that of the model, not of the equilibrium
  for (size_t i = 0; i < rope_.size(); ++i) {
    const mbs::Cable& c = model_.cables[i];
    const auto at_model = [&](mbs::BodyId b, const Vec3& p) {
      return b == mbs::kGround ? p : model_.bodies[static_cast<size_t>(b.index)].X_WB * p;
    };
    rope_[i].rest_length = norm(at_model(c.b, c.p_B) - at_model(c.a, c.p_A)) - c.pretension / c.stiffness;
  }
  for (size_t i = 0; i < torsion_.size(); ++i)
    torsion_[i].angle = angle_of(motion, model_.rotational_springs[i].joint, 0);
  for (size_t i = 0; i < rotational_.size(); ++i)
    rotational_[i].angle = angle_of(motion, model_.rotational_elements[i].joint, 0);
  advance(0, motion, {});
}

void Forces::calc(double time, const Motion& motion, std::vector<Wrench>& on) const {
  if (is_cached_ && time == cached_time_ && is_same(motion, cached_motion_)) {
    on = cached_;
    return;
  }
  const Vec3 ground_before = on_ground_;
  evaluate(time, motion, on);
  on_ground_ = ground_before;
}

void Forces::renew(double time, const Motion& motion) {
  on_ground_ = {};
  evaluate(time, motion, cached_);
  is_cached_ = true;
  cached_time_ = time;
  cached_motion_ = motion;
}

void Forces::evaluate(double time, const Motion& motion, std::vector<Wrench>& on) const {
  on.assign(model_.bodies.size(), {});
  // a history that has begun goes on from its damper's state even if no time has passed
  const double h = std::max(time - accepted_, std::numeric_limits<double>::min());
  const auto try_zone = [&](const Zone& z, const mbs::Six& d) {
    mbs::ZoneParameters p = z.parameters;
    prepare(p, time - accepted_);
    mbs::ZoneState trial = z.state;
    mbs::advance_zone(p, lasting_laws_, d, time, h, trial);
    return trial.resultant;
  };
  const auto push_zone = [&](const Zone& z, mbs::BodyId a, const Pose& X_AF, mbs::BodyId b, const Pose& X_BM) {
    const mbs::ElementGeometry g = measure_zone(z, motion, a, X_AF, b, X_BM);
    push_zone_forces(motion, a, b, g, try_zone(z, g.deformation), on);
  };
  for (size_t i = 0; i < zone_.size(); ++i) {
    const mbs::ZoneElement& e = model_.elements[i];
    if (zone_[i].state.live) push_zone(zone_[i], e.a, e.X_AF, e.b, e.X_BM);
  }
  for (size_t i = 0; i < rotational_.size(); ++i) {
    if (!rotational_[i].state.live) continue;
    const mbs::RotationalElement& r = model_.rotational_elements[i];
    const mbs::Joint& j = model_.joints[static_cast<size_t>(r.joint.index)];
    if (rotational_[i].is_loose) {
      push_zone(rotational_[i], j.parent, j.X_PF, j.child, j.X_CM);
      continue;
    }
    mbs::Six d;
    d.c[0] = rotational_[i].axial_force;
    d.c[5] = angle_of(motion, r.joint, rotational_[i].angle);
    const Vec3 torque = try_zone(rotational_[i], d).c[5] * axis_of(motion, r.joint);
    twist(j.child, -torque, on);
    twist(j.parent, torque, on);
  }
  push_others(time, motion, on);
}

void Forces::push_others(double time, const Motion& motion, std::vector<Wrench>& on) const {
  for (size_t i = 0; i < rope_.size(); ++i) {
    if (!rope_[i].live) continue;
    const mbs::Cable& c = model_.cables[i];
    const Vec3 p_A = pose_of(motion, c.a) * c.p_A, p_B = pose_of(motion, c.b) * c.p_B;
    const double length = norm(p_B - p_A), stretch = length - rope_[i].rest_length;
    if (!(stretch > 0)) continue;
    const Vec3 pull = (c.stiffness * stretch / length) * (p_B - p_A);
    push(motion, c.a, p_A, pull, on);
    push(motion, c.b, p_B, -pull, on);
  }
  for (size_t i = 0; i < spring_.size(); ++i) {
    if (!spring_[i].live) continue;
    const mbs::SpringDamper& s = model_.springs[i];
    const Vec3 p_A = pose_of(motion, s.a) * s.p_A, p_B = pose_of(motion, s.b) * s.p_B;
    const double length = norm(p_B - p_A);
    if (!(length > 0)) continue;  // no direction
    const Vec3 line = (1 / length) * (p_B - p_A);
    const double rate = dot(line, velocity_at(motion, s.b, p_B) - velocity_at(motion, s.a, p_A));
    const Vec3 pull =
        (calc_characteristic(s.spring, length - s.free_length) + calc_characteristic(s.damper, rate)) * line;
    push(motion, s.a, p_A, pull, on);
    push(motion, s.b, p_B, -pull, on);
  }
  for (size_t i = 0; i < torsion_.size(); ++i) {
    if (!torsion_[i].live) continue;
    const mbs::RotationalSpring& s = model_.rotational_springs[i];
    const mbs::Joint& j = model_.joints[static_cast<size_t>(s.joint.index)];
    const double angle = angle_of(motion, s.joint, torsion_[i].angle);
    const Vec3 torque = (calc_characteristic(s.spring, angle - s.free_angle) +
                         calc_characteristic(s.damper, angle_rate_of(motion, s.joint))) *
                        axis_of(motion, s.joint);
    twist(j.child, -torque, on);
    twist(j.parent, torque, on);
  }
  for (size_t i = 0; i < bushing_.size(); ++i) {
    if (!bushing_[i].live) continue;
    const mbs::Bushing& b = model_.bushings[i];
    const Six s = calc_six(motion, b.a, b.X_AF, b.b, b.X_BM, bushing_[i].turn);
    const mbs::Six rate = calc_rates(motion, b.a, b.b, s);
    double f[6];
    for (int k = 0; k < 6; ++k)
      f[k] = calc_characteristic(b.spring[k], s.deformation.c[k]) + calc_characteristic(b.damper[k], rate.c[k]);
    push_six(motion, b.a, b.b, s, f, on);
  }
  for (size_t i = 0; i < load_.size(); ++i) {
    if (!load_[i].has_begun || load_[i].is_over) continue;
    const mbs::Load& l = model_.loads[i];
    if (is_ground(model_, l.body.index)) continue;
    const double factor = factor_of(i, time);
    const Pose X = pose_of(motion, l.body);
    const Mat3 R = l.follows_body ? to_matrix(X.q) : Mat3::identity();
    push(motion, l.body, X * l.p_B, factor * (R * l.force), on);
    twist(l.body, factor * (R * l.torque), on);
  }
}

Power Forces::calc_power(double time, const Motion& motion) const {
  Power p;
  for (size_t i = 0; i < spring_.size(); ++i) {
    if (!spring_[i].live) continue;
    const mbs::SpringDamper& s = model_.springs[i];
    const Vec3 p_A = pose_of(motion, s.a) * s.p_A, p_B = pose_of(motion, s.b) * s.p_B;
    const double length = norm(p_B - p_A);
    if (!(length > 0)) continue;
    const double rate = dot(p_B - p_A, velocity_at(motion, s.b, p_B) - velocity_at(motion, s.a, p_A)) / length;
    p.damping += calc_characteristic(s.damper, rate) * rate;
  }
  for (size_t i = 0; i < torsion_.size(); ++i) {
    if (!torsion_[i].live) continue;
    const double rate = angle_rate_of(motion, model_.rotational_springs[i].joint);
    p.damping += calc_characteristic(model_.rotational_springs[i].damper, rate) * rate;
  }
  for (size_t i = 0; i < bushing_.size(); ++i) {
    if (!bushing_[i].live) continue;
    const mbs::Bushing& b = model_.bushings[i];
    const Six s = calc_six(motion, b.a, b.X_AF, b.b, b.X_BM, bushing_[i].turn);
    const mbs::Six rate = calc_rates(motion, b.a, b.b, s);
    for (int k = 0; k < 6; ++k) p.damping += calc_characteristic(b.damper[k], rate.c[k]) * rate.c[k];
  }
  for (size_t i = 0; i < load_.size(); ++i) {
    if (!load_[i].has_begun || load_[i].is_over) continue;
    const mbs::Load& l = model_.loads[i];
    if (is_ground(model_, l.body.index)) continue;
    const Pose X = pose_of(motion, l.body);
    const Mat3 R = l.follows_body ? to_matrix(X.q) : Mat3::identity();
    p.loads += factor_of(i, time) * (dot(R * l.force, velocity_at(motion, l.body, X * l.p_B)) +
                                     dot(R * l.torque, motion.w_WB[static_cast<size_t>(l.body.index)]));
  }
  return p;
}

bool Forces::advance(double time, const Motion& motion, const std::vector<Vec3>& joint_force) {
  using mbs::Happening;
  static const char* const words[] = {"", "tension", "crushing", "shear", "rotation", "torsion", "removed"};
  bool jumped = false;
  cached_.assign(model_.bodies.size(), {});
  on_ground_ = {};
  const double h = time - accepted_;
  const auto tell = [&](const Zone& z, bool was_yielded, size_t index) {
    if (z.state.yielded && !was_yielded)
      say_({Happening::Kind::ElementYielded, time, static_cast<int>(index), -1, {}, 0});
    if (z.state.live) return;
    jumped = true;
    say_({Happening::Kind::ElementBroken, time, static_cast<int>(index), -1, words[static_cast<int>(z.state.reason)],
          0});
  };
  const auto advance = [&](Zone& z, size_t index, const mbs::Six& d) {
    const bool was_yielded = z.state.yielded;
    prepare(z.parameters, h);
    mbs::advance_zone(z.parameters, laws_, d, time, h, z.state);
    tell(z, was_yielded, index);
  };
  const auto advance_six = [&](Zone& z, size_t index, mbs::BodyId a, const Pose& X_AF, mbs::BodyId b,
                               const Pose& X_BM) {
    const mbs::ElementGeometry g = measure_zone(z, motion, a, X_AF, b, X_BM);
    advance(z, index, g.deformation);
    if (z.state.live) push_zone_forces(motion, a, b, g, z.state.resultant, cached_);
  };
  for (size_t i = 0; i < zone_.size(); ++i) {
    const mbs::ZoneElement& e = model_.elements[i];
    if (zone_[i].state.live) advance_six(zone_[i], i, e.a, e.X_AF, e.b, e.X_BM);
  }
  for (size_t i = 0; i < rotational_.size(); ++i) {
    Zone& z = rotational_[i];
    const mbs::RotationalElement& r = model_.rotational_elements[i];
    if (!z.state.live) {
      if (!z.is_loose && !z.is_released) z.angle = angle_of(motion, r.joint, z.angle);
      continue;
    }
    const mbs::Joint& j = model_.joints[static_cast<size_t>(r.joint.index)];
    if (z.is_loose) {
      advance_six(z, zone_.size() + i, j.parent, j.X_PF, j.child, j.X_CM);
      continue;
    }
    if (!joint_force.empty()) z.axial_force = -joint_force[static_cast<size_t>(r.joint.index)].x;
    z.angle = angle_of(motion, r.joint, z.angle);
    const double elongated = z.state.axial;
    mbs::Six d;
    d.c[0] = z.axial_force;
    d.c[5] = z.angle;
    advance(z, zone_.size() + i, d);
    if (r.axial_element.is_valid() && h > 0) {
      Zone& along = zone_[static_cast<size_t>(r.axial_element.index)];
      mbs::elongate_zone(along.parameters, z.state.axial - elongated, along.state);
      if (z.state.live && z.state.station[0].reached > 0)
        along.state.hinge_bears =
            std::min(along.state.hinge_bears, mbs::calc_hinge_bearing(z.parameters, laws_, time, z.state));
    }
    if (!z.state.live) continue;
    const Vec3 torque = z.state.resultant.c[5] * axis_of(motion, r.joint);
    twist(j.child, -torque, cached_);
    twist(j.parent, torque, cached_);
  }
  jumped |= break_others(time, motion);
  push_others(time, motion, cached_);
  accepted_ = time;
  is_cached_ = true;
  cached_time_ = time;
  cached_motion_ = motion;
  return jumped;
}

bool Forces::break_others(double time, const Motion& motion) {
  using Kind = mbs::Happening::Kind;
  bool jumped = false;
  const auto fail = [&](Spring& s, Kind kind, size_t i, const char* reason) {
    plastic_ += s.stored;
    s.stored = 0;
    s.live = false;
    jumped = true;
    say_({kind, time, static_cast<int>(i), -1, reason, 0});
  };
  for (size_t i = 0; i < rope_.size(); ++i) {
    if (!rope_[i].live) continue;
    const mbs::Cable& c = model_.cables[i];
    const double stretch = norm(pose_of(motion, c.b) * c.p_B - pose_of(motion, c.a) * c.p_A) - rope_[i].rest_length;
    rope_[i].stored = stretch > 0 ? 0.5 * c.stiffness * stretch * stretch : 0;
    if (c.stiffness * stretch > c.strength) fail(rope_[i], Kind::CableBroken, i, "tension");
  }
  for (size_t i = 0; i < spring_.size(); ++i) {
    if (!spring_[i].live) continue;
    const mbs::SpringDamper& s = model_.springs[i];
    const double stretch = norm(pose_of(motion, s.b) * s.p_B - pose_of(motion, s.a) * s.p_A) - s.free_length;
    const double force = calc_characteristic(s.spring, stretch);
    spring_[i].stored = calc_potential(s.spring, stretch);
    if (force > s.tension_strength)
      fail(spring_[i], Kind::SpringBroken, i, "tension");
    else if (-force > s.compression_strength)
      fail(spring_[i], Kind::SpringBroken, i, "compression");
  }
  for (size_t i = 0; i < torsion_.size(); ++i) {
    if (!torsion_[i].live) continue;
    const mbs::RotationalSpring& s = model_.rotational_springs[i];
    torsion_[i].angle = angle_of(motion, s.joint, torsion_[i].angle);
    const double angle = torsion_[i].angle - s.free_angle;
    torsion_[i].stored = calc_potential(s.spring, angle);
    if (std::abs(calc_characteristic(s.spring, angle)) > s.strength)
      fail(torsion_[i], Kind::RotationalSpringBroken, i, "torsion");
  }
  for (size_t i = 0; i < bushing_.size(); ++i) {
    if (!bushing_[i].live) continue;
    static const char* const words[] = {"tension", "shear", "shear", "torsion", "rotation", "rotation"};
    const mbs::Bushing& b = model_.bushings[i];
    const Six s = calc_six(motion, b.a, b.X_AF, b.b, b.X_BM, bushing_[i].turn);
    bushing_[i].stored = 0;
    bushing_[i].turn = s.r;
    int weak = -1;
    bool pulled = true;
    for (int k = 0; k < 6; ++k) {
      bushing_[i].stored += calc_potential(b.spring[k], s.deformation.c[k]);
      const double force = calc_characteristic(b.spring[k], s.deformation.c[k]);
      if (weak >= 0 || !(std::abs(force) > b.strength[k])) continue;
      weak = k;
      pulled = force > 0;
    }
    if (weak >= 0) fail(bushing_[i], Kind::BushingBroken, i, weak == 0 && !pulled ? "compression" : words[weak]);
  }
  return jumped;
}

// --- events

Forces::Zone& Forces::zone_of(const mbs::Action& a) {
  return a.rotational >= 0 ? rotational_[static_cast<size_t>(a.rotational)]
                           : zone_[static_cast<size_t>(a.element.index)];
}

void Forces::remove_element(const mbs::Action& a) {
  mbs::ZoneState& z = zone_of(a).state;
  is_cached_ = false;
  if (!z.live) return;
  removed_ += z.energy + z.damper_energy;
  z.energy = z.damper_energy = 0;
  mbs::break_zone(z, mbs::BreakReason::Removed);
}

void Forces::switch_law(const mbs::Action& a, double time) {
  Zone& z = zone_of(a);
  is_cached_ = false;
  mbs::begin_switch(z.parameters, laws_, {a.law.index, time, a.ramp, a.stiffness_share}, z.state);
}

bool Forces::has_broken_hinge(size_t j) const {
  for (size_t i = 0; i < rotational_.size(); ++i)
    if (model_.rotational_elements[i].joint.index == static_cast<int>(j)) return !rotational_[i].state.live;
  return false;
}

bool Forces::loosen_joint(size_t j, const Vec3& f, const Vec3& m, double time) {
  for (size_t i = 0; i < rotational_.size(); ++i) {
    const mbs::RotationalElement& r = model_.rotational_elements[i];
    Zone& z = rotational_[i];
    if (r.joint.index != static_cast<int>(j) || !z.state.live) continue;
    is_cached_ = false;
    z.is_loose = true;
    z.parameters.external_axial = false;
    for (int c = 0; c < 3; ++c) z.parameters.stiffness[c] = r.loose_translational[c];
    z.parameters.stiffness[3] = r.loose_torsion;
    z.parameters.stiffness[4] = r.loose_bending;
    mbs::free_zone(z.parameters, {{-f.x, -f.y, -f.z, -m.x, -m.y, 0}}, z.state);
    end_torsions(j, time);
    return true;
  }
  return false;
}

const mbs::Six* Forces::find_loose(size_t j) const {
  for (size_t i = 0; i < rotational_.size(); ++i)
    if (model_.rotational_elements[i].joint.index == static_cast<int>(j))
      return rotational_[i].is_loose && rotational_[i].state.live ? &rotational_[i].state.resultant : nullptr;
  return nullptr;
}

void Forces::release_joint(size_t j, double time) {
  is_cached_ = false;
  for (size_t i = 0; i < rotational_.size(); ++i) {
    if (model_.rotational_elements[i].joint.index != static_cast<int>(j)) continue;
    Zone& z = rotational_[i];
    if (!z.is_loose) z.is_released = true;
    if (z.state.live) mbs::break_zone(z.state, mbs::BreakReason::Removed);
  }
  end_torsions(j, time);
}

void Forces::end_torsions(size_t j, double time) {
  for (size_t i = 0; i < torsion_.size(); ++i) {
    if (model_.rotational_springs[i].joint.index != static_cast<int>(j) || !torsion_[i].live) continue;
    plastic_ += torsion_[i].stored;
    torsion_[i].stored = 0;
    torsion_[i].live = false;
    say_({mbs::Happening::Kind::RotationalSpringBroken, time, static_cast<int>(i), -1, "released", 0});
  }
}

namespace {

template <class T>
void take_away(T& s, double& removed) {
  if (!s.live) return;
  removed += s.stored;
  s.stored = 0;
  s.live = false;
}

}  // namespace

void Forces::release_cable(size_t i) { is_cached_ = false, take_away(rope_[i], removed_); }
void Forces::remove_spring(size_t i) { is_cached_ = false, take_away(spring_[i], removed_); }
void Forces::remove_rotational_spring(size_t i) { is_cached_ = false, take_away(torsion_[i], removed_); }
void Forces::remove_bushing(size_t i) { is_cached_ = false, take_away(bushing_[i], removed_); }
void Forces::remove_load(size_t i) {
  is_cached_ = false;
  load_[i].is_over = true;
}
void Forces::apply_load(size_t i, double time) {
  is_cached_ = false;
  // one that was removed begins anew; one that acts goes on
  if (!load_[i].has_begun || load_[i].is_over) load_[i] = {true, false, time};
}

double Forces::next_corner(double time) const {
  double next = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < load_.size(); ++i) {
    if (!load_[i].has_begun || load_[i].is_over) continue;
    for (const double t : model_.loads[i].time)
      if (load_[i].begin + t > time + 1e-12 * (1 + time)) next = std::min(next, load_[i].begin + t);
  }
  return next;
}

double Forces::calc_last_load_change() const {
  double last = 0;
  for (size_t i = 0; i < load_.size(); ++i)
    if (load_[i].has_begun && !load_[i].is_over && !model_.loads[i].time.empty())
      last = std::max(last, load_[i].begin + model_.loads[i].time.back());
  return last;
}

// --- what is seen

ElementEnergy Forces::calc_energy() const {
  ElementEnergy e;
  e.plastic = plastic_;
  e.removed = removed_;
  for (const auto* list : {&zone_, &rotational_})
    for (const Zone& z : *list) {
      e.elastic += z.state.energy + z.state.damper_energy;
      e.plastic += z.state.plastic;
      e.damping += z.state.damping;
    }
  for (const Spring& s : spring_) e.elastic += s.stored;
  for (const Held& s : bushing_) e.elastic += s.stored;
  for (const Torsion& s : torsion_) e.elastic += s.stored;
  for (const Rope& s : rope_) e.elastic += s.stored;
  return e;
}

double Forces::crushed_length(size_t element) const {
  const Zone& z = zone_[element];
  return mbs::is_crushed_by_shortening(z.parameters, laws_, z.state) ? z.state.shortened : 0;
}

void Forces::fill_zone(size_t at, double time, const Zone& z, mbs::View& v) const {
  using mbs::ElementState;
  const mbs::ZoneState& s = z.state;
  v.element_state[at] = !s.live ? (s.reason == mbs::BreakReason::Removed ? ElementState::Removed : ElementState::Broken)
                        : mbs::is_softening(z.parameters, laws_, time, s) ? ElementState::Softening
                        : s.yielded                                       ? ElementState::Yielded
                                                                          : ElementState::Elastic;
  v.utilisation[at] = mbs::calc_utilisation(z.parameters, laws_, time, s);
  v.rotation[at] = std::max(s.station[0].reached, s.station[1].reached);
  v.shortening[at] = s.shortened;
}

void Forces::fill(double time, const Motion& motion, mbs::View& v) const {
  const size_t E = zone_.size(), R = rotational_.size();
  v.element_state.resize(E + R);
  v.utilisation.resize(E + R);
  v.rotation.resize(E + R);
  v.shortening.resize(E + R);
  v.element_force.resize(E);
  v.element_moment.resize(E);
  v.element_translation.resize(E);
  v.element_rotation.resize(E);
  const auto three = [](const double* c) { return Vec3{c[0], c[1], c[2]}; };
  for (size_t i = 0; i < E; ++i) {
    const mbs::ZoneElement& e = model_.elements[i];
    fill_zone(i, time, zone_[i], v);
    const mbs::ElementGeometry g = measure_zone(zone_[i], motion, e.a, e.X_AF, e.b, e.X_BM);
    v.element_force[i] = -three(zone_[i].state.resultant.c);
    v.element_moment[i] = -three(zone_[i].state.resultant.c + 3);
    v.element_translation[i] = three(g.deformation.c);
    v.element_rotation[i] = three(g.deformation.c + 3);
  }
  v.hinge_rotation.resize(R);
  v.hinge_moment.resize(R);
  v.hinge_normal.resize(R);
  for (size_t i = 0; i < R; ++i) {
    const Zone& z = rotational_[i];
    fill_zone(E + i, time, z, v);
    v.hinge_rotation[i] = z.is_released                ? z.angle
                          : z.is_loose && z.state.live ? z.state.deformation[5]
                                                       : angle_of(motion, model_.rotational_elements[i].joint, z.angle);
    v.hinge_moment[i] = -z.state.resultant.c[5];
    v.hinge_normal[i] = !z.state.live ? 0 : z.is_loose ? z.state.resultant.c[0] : z.axial_force;
  }
  v.cable_force.resize(rope_.size());
  v.cable_length.resize(rope_.size());
  for (size_t i = 0; i < rope_.size(); ++i) {
    const mbs::Cable& c = model_.cables[i];
    const double length = norm(pose_of(motion, c.b) * c.p_B - pose_of(motion, c.a) * c.p_A);
    const double stretch = length - rope_[i].rest_length;
    v.cable_length[i] = length;
    v.cable_force[i] = rope_[i].live && stretch > 0 ? c.stiffness * stretch : 0;
  }
  v.spring_length.resize(spring_.size());
  v.spring_force.resize(spring_.size());
  for (size_t i = 0; i < spring_.size(); ++i) {
    const mbs::SpringDamper& s = model_.springs[i];
    const Vec3 p_A = pose_of(motion, s.a) * s.p_A, p_B = pose_of(motion, s.b) * s.p_B;
    const double length = norm(p_B - p_A);
    const double rate =
        length > 0 ? dot(p_B - p_A, velocity_at(motion, s.b, p_B) - velocity_at(motion, s.a, p_A)) / length : 0;
    v.spring_length[i] = length;
    v.spring_force[i] =
        spring_[i].live ? calc_characteristic(s.spring, length - s.free_length) + calc_characteristic(s.damper, rate)
                        : 0;
  }
  v.torsion_angle.resize(torsion_.size());
  v.torsion_torque.resize(torsion_.size());
  for (size_t i = 0; i < torsion_.size(); ++i) {
    const mbs::RotationalSpring& s = model_.rotational_springs[i];
    v.torsion_angle[i] = angle_of(motion, s.joint, torsion_[i].angle) - s.free_angle;
    v.torsion_torque[i] = torsion_[i].live ? calc_characteristic(s.spring, v.torsion_angle[i]) +
                                                 calc_characteristic(s.damper, angle_rate_of(motion, s.joint))
                                           : 0;
  }
  const size_t N = bushing_.size();
  v.bushing_translation.resize(N);
  v.bushing_rotation.resize(N);
  v.bushing_force.resize(N);
  v.bushing_moment.resize(N);
  for (size_t i = 0; i < N; ++i) {
    const mbs::Bushing& b = model_.bushings[i];
    const Six s = calc_six(motion, b.a, b.X_AF, b.b, b.X_BM, bushing_[i].turn);
    const mbs::Six rate = calc_rates(motion, b.a, b.b, s);
    double f[6] = {0, 0, 0, 0, 0, 0};
    for (int k = 0; k < 6 && bushing_[i].live; ++k)
      f[k] = -calc_characteristic(b.spring[k], s.deformation.c[k]) - calc_characteristic(b.damper[k], rate.c[k]);
    v.bushing_translation[i] = three(s.deformation.c);
    v.bushing_rotation[i] = three(s.deformation.c + 3);
    v.bushing_force[i] = three(f);
    v.bushing_moment[i] = three(f + 3);
  }
}

}  // namespace topple::engines
