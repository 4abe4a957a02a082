#include "mbs/system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "mbs/joint_rows.h"
#include "mbs/model_check.h"

namespace topple::mbs {

namespace {

Mat3 world_tensor(const Mat3& R, const Mat3& in_body) { return R * in_body * transpose(R); }

/// In a plane a body is so hard to turn out of it that it stays, yet no row of a joint is without mass.
constexpr double kOutOfPlane = 1e6;

/// Of a body of a plane whose normal it sees as n: what it has about n, and hard to turn otherwise.
Mat3 make_planar_inertia(const Mat3& inertia, const Vec3& n) {
  constexpr double round_off = 1e-12;
  if (std::hypot(n.x, n.z) < round_off)
    return Mat3::diagonal({kOutOfPlane * inertia(0, 0), inertia(1, 1), kOutOfPlane * inertia(2, 2)});
  const Mat3 along = Mat3::from_columns(n.x * n, n.y * n, n.z * n), across = Mat3::identity() + (-1) * along;
  return dot(n, inertia * n) * along + kOutOfPlane * (across * inertia * across);
}

///   q_WB  its orientation at the start: in a plane the body sees the same normal ever after
BodyConstants constants_of(const Body& body, bool is_planar, const Quat& q_WB) {
  BodyConstants c;
  c.mass = body.mass;
  c.inertia = body.inertia;
  if (is_planar) c.inertia = make_planar_inertia(body.inertia, transpose_times(to_matrix(q_WB), {0, 1, 0}));
  if (!body.fixed) {
    c.inverse_mass = 1 / body.mass;
    c.gyration2 = 0.5 * c.inverse_mass * (body.inertia(0, 0) + body.inertia(1, 1) + body.inertia(2, 2));
    c.inverse_inertia = inverse(c.inertia);
  }
  return c;
}

/// Nothing along y has an effect in a plane.
Model with_gravity_in_plane(Model m) {
  if (m.is_planar) m.gravity.y = 0;
  return m;
}

/// Spring behind the damper over the elastic spring, so that the loss at the damping frequency is that of the ratio:
/// loss factor 2ζ = (r/2) / (1 + r/2).
double viscous_share(double damping_ratio) { return 4 * damping_ratio / (1 - 2 * damping_ratio); }

}  // namespace

System::System(const Model& m, const Options& o, size_t width, bool has_moment)
    : model(with_gravity_in_plane(m)), options(o), own_lanes(std::make_unique<Lanes>()), lanes(own_lanes.get()) {
  check_model(m);
  check_step(options.step, options.duration);
  lanes->W = width > 0 ? width : kernel::lanes();
  compile();
  if (!has_moment) choose_step();
}

void System::compile() {
  B = model.bodies.size();
  State& s = state;
  s = {};
  s.body.resize(B);
  lanes->allocate_bodies(B);
  const LaneLayout layout = lanes->body_layout(lane);
  for (auto [array, store] : {std::pair{&s.p, &lanes->p},
                              {&s.v, &lanes->v},
                              {&s.L, &lanes->L},
                              {&s.w, &lanes->w},
                              {&force, &lanes->force},
                              {&torque, &lanes->torque},
                              {&joint_force, &lanes->joint_force},
                              {&joint_torque, &lanes->joint_torque}}) {
    array->resize(B);
    array->attach(store->data(), layout);
  }
  s.q.resize(B);
  s.q.attach(lanes->q.data(), layout);
  s.R.resize(B);
  s.R.attach(lanes->R.data(), layout);
  s.ground_box.resize(B);
  s.ground_box.attach(lanes->ground_states.data(), layout);
  s.p_offset.assign(B, {});
  s.touched_ground.assign(B, 0);
  s.tied_to_ground.assign(B, 0);
  s.ground_clear.assign(B, 0);
  fixed.resize(B);
  compile_hulls();
  for (size_t b = 0; b < B; ++b) {
    const Body& body = model.bodies[b];
    s.body[b] = constants_of(body, model.is_planar, normalized(body.X_WB.q));
    append_shapes(body, s.body[b]);
    fixed[b] = body.fixed;
    s.p[b] = body.X_WB.p;
    s.q[b] = normalized(body.X_WB.q);
    s.R[b] = to_matrix(s.q[b]);
    if (!body.fixed) {
      s.v[b] = body.v_WB;
      s.w[b] = body.w_WB;
      s.L[b] = world_tensor(s.R[b], s.body[b].inertia) * body.w_WB;
    }
  }
  layout_shapes();
  jointed.assign(B, 0);
  for (const Joint& j : model.joints) {
    const auto moves = [&](BodyId id) { return id != kGround && !fixed[static_cast<size_t>(id.index)]; };
    for (const BodyId id : {j.parent, j.child})
      if (moves(id)) {
        unsigned char& how = jointed[static_cast<size_t>(id.index)];
        how = moves(j.parent) && moves(j.child) ? 2 : std::max<unsigned char>(how, 1);
      }
  }
  count_other_bodies();
  lanes->is_planar = keeps_planes();

  for (size_t i = 0; i < model.laws.size(); ++i) laws.push_back(model.laws.shared(i).compile());

  for (const ZoneElement& e : model.elements) {
    CompiledElement c;
    c.a = e.a.index;
    c.b = e.b.index;
    c.p_AF = e.X_AF.p;
    c.p_BM = e.X_BM.p;
    c.q_AF = normalized(e.X_AF.q);
    c.q_BM = normalized(e.X_BM.q);
    c.zone.plane = find_plane(c.a, c.b, {c.p_AF, c.q_AF}, {c.p_BM, c.q_BM});
    for (int i = 0; i < 3; ++i) {
      c.zone.stiffness[i] = e.translational_stiffness[i];
      c.zone.stiffness[3 + i] = e.rotational_stiffness[i];
    }
    for (int i = 0; i < 2; ++i) c.zone.cracking[i] = e.cracking[i];
    c.zone.viscous = viscous_share(e.damping_ratio);
    c.zone.crush_through = e.crush_through;
    c.zone.stations = static_cast<int>(e.stations.size());
    for (int i = 0; i < c.zone.stations; ++i) {
      c.zone.x[i] = e.stations[static_cast<size_t>(i)].x;
      c.zone.law[i] = e.stations[static_cast<size_t>(i)].law.index;
    }
    elements.push_back(c);
  }
  E = elements.size();

  for (const Joint& j : model.joints) {
    CompiledJoint c;
    c.kind = j.kind;
    c.parent = j.parent.index;
    c.child = j.child.index;
    c.p_PF = j.X_PF.p;
    c.p_CM = j.X_CM.p;
    c.R_PF = to_matrix(normalized(j.X_PF.q));
    c.R_CM = to_matrix(normalized(j.X_CM.q));
    if (j.kind == Joint::Kind::Distance) c.length = norm(pose_of(c.child) * c.p_CM - pose_of(c.parent) * c.p_PF);
    const RowCount count = row_count(j.kind);
    c.lines = count.lines;
    c.rows = count.lines + count.rotations;
    c.tension_limit = j.tension_limit;
    c.shear_limit = j.shear_limit;
    c.moment_limit = j.moment_limit;
    c.rotation_limit = j.rotation_limit;
    joints.push_back(c);
  }
  s.joint.resize(joints.size());
  update_angles();

  for (const RotationalElement& r : model.rotational_elements) {
    CompiledRotational c;
    c.joint = r.joint.index;
    CompiledJoint& j = joints[static_cast<size_t>(c.joint)];
    j.rotational = static_cast<int>(rotationals.size());
    for (int i = 0; i < 6; ++i) c.zone.stiffness[i] = 0;
    c.zone.stiffness[5] = r.stiffness;
    c.zone.external_axial = true;
    c.zone.cracking[1] = r.cracking;
    c.zone.viscous = viscous_share(r.damping_ratio);
    c.axial_element = r.axial_element.index;
    if (r.axial_element.is_valid())
      c.zone.relief = model.elements[static_cast<size_t>(c.axial_element)].translational_stiffness.x;
    if (r.law.is_valid()) {
      c.zone.stations = 1;
      c.zone.law[0] = r.law.index;
    }
    const Joint& frames = model.joints[static_cast<size_t>(c.joint)];
    CompiledElement loose;
    loose.a = j.parent, loose.b = j.child;
    loose.p_AF = j.p_PF, loose.p_BM = j.p_CM;
    loose.q_AF = normalized(frames.X_PF.q), loose.q_BM = normalized(frames.X_CM.q);
    if (find_plane(loose.a, loose.b, {loose.p_AF, loose.q_AF}, {loose.p_BM, loose.q_BM}) == kernel::Plane::AboutZ)
      c.zone.plane = kernel::Plane::AboutZ;
    loose.zone = c.zone;
    loose.zone.external_axial = false;
    loose.zone.relief = 0;
    for (int i = 0; i < 3; ++i) loose.zone.stiffness[i] = r.loose_translational[i];
    loose.zone.stiffness[3] = r.loose_torsion;
    loose.zone.stiffness[4] = r.loose_bending;
    rotationals.push_back(c);
    elements.push_back(loose);
  }
  s.rotational.resize(rotationals.size());
  s.element.resize(elements.size());
  for (ZoneState& z : std::span(s.element).subspan(E)) z.live = false;

  s.cable.resize(model.cables.size());
  for (size_t i = 0; i < model.cables.size(); ++i) {
    const Cable& c = model.cables[i];
    const double length = norm(pose_of(c.b.index) * c.p_B - pose_of(c.a.index) * c.p_A);
    s.cable[i].rest_length = length - c.pretension / c.stiffness;
    s.cable[i].live = true;
  }

  compile_forces();

  event_order.resize(model.events.size());
  for (size_t i = 0; i < event_order.size(); ++i) event_order[i] = i;
  std::stable_sort(event_order.begin(), event_order.end(),
                   [&](size_t a, size_t b) { return model.events[a].time < model.events[b].time; });

  for (const Event& event : model.events)
    for (const Action& a : event.actions)
      if (a.kind == Action::Kind::ReplaceBody) replaceable.push_back(static_cast<size_t>(a.body.index));
  std::sort(replaceable.begin(), replaceable.end());
  replaceable.erase(std::unique(replaceable.begin(), replaceable.end()), replaceable.end());
  s.force_parts.resize(B);

  incidence.assign(B, {});
  for (size_t e = 0; e < elements.size(); ++e) {
    if (elements[e].a >= 0) incidence[static_cast<size_t>(elements[e].a)].push_back(static_cast<int>(2 * e));
    if (elements[e].b >= 0) incidence[static_cast<size_t>(elements[e].b)].push_back(static_cast<int>(2 * e + 1));
  }
  for (size_t b = 0; b < B; ++b) find_crushed_boxes_of(b, model.bodies[b]);
  number_crushed_boxes();
  lay_out_elements();
  compile_contact();
  p_before.resize(B);
  q_before.resize(B);
  R_before.resize(B);
  world_inverse_inertia.resize(B);
  body_reaction.assign(B, {});
  body_reaction_turn.assign(B, {});
  in_cluster.assign(B, 0);
  for (size_t b = 0; b < B; ++b) pack_body(b);
  s.gravity_at_start = calc_energy().gravity;
}

void System::compile_hulls() {
  std::vector<const Body*> bodies;
  for (const Body& b : model.bodies) bodies.push_back(&b);
  for (const Event& event : model.events)
    for (const Action& a : event.actions)
      if (a.kind == Action::Kind::ReplaceBody) bodies.push_back(&a.replacement);
  bool any = false;
  for (const Body* body : bodies)
    for (const Shape& s : body->shapes) any = any || s.kind == Shape::Kind::Hull;
  if (!any) return;
  // boxes that may meet polyhedra are some
  for (const Body* body : bodies)
    for (const Shape& s : body->shapes) {
      if ((s.kind != Shape::Kind::Hull && s.kind != Shape::Kind::Box) || find_hull(s) >= 0) continue;
      hulls.push_back(s.kind == Shape::Kind::Hull ? make_hull(s.vertices) : make_box_hull(s.half));
      hull_shapes.push_back(s);
    }
}

int System::find_hull(const Shape& s) const {
  for (size_t i = 0; i < hull_shapes.size(); ++i) {
    const Shape& known = hull_shapes[i];
    if (known.kind != s.kind) continue;
    if (s.kind == Shape::Kind::Hull ? known.vertices == s.vertices : known.half == s.half) return static_cast<int>(i);
  }
  return -1;
}

void System::append_shapes(const Body& body, BodyConstants& c) {
  c.first_shape = static_cast<int>(state.shapes.size());
  c.shapes = static_cast<int>(body.shapes.size());
  c.radius = 0;
  for (const Shape& s : body.shapes) {
    CompiledShape compiled;
    compiled.kind = s.kind;
    compiled.p_BS = s.X_BS.p;
    compiled.R_BS = to_matrix(s.X_BS.q);
    compiled.is_straight = compiled.R_BS.m[0][0] == 1 && compiled.R_BS.m[1][1] == 1 && compiled.R_BS.m[2][2] == 1;
    compiled.half = s.half;
    compiled.radius = s.kind == Shape::Kind::Sphere ? s.radius : 0;
    compiled.hull = find_hull(s);
    compiled.reach = s.kind == Shape::Kind::Box      ? norm(s.half)
                     : s.kind == Shape::Kind::Sphere ? s.radius
                     : s.kind == Shape::Kind::Hull   ? hulls[static_cast<size_t>(compiled.hull)].reach
                                                     : kUnlimited;
    c.radius = std::max(c.radius, norm(s.X_BS.p) + compiled.reach);
    state.shapes.push_back(compiled);
  }
  c.contact_stretch = calc_contact_stretch(c);
}

int System::count_corners(const CompiledShape& shape) const {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return 8;
    case Shape::Kind::Sphere:
      return 1;
    case Shape::Kind::Hull:
      return static_cast<int>(hulls[static_cast<size_t>(shape.hull)].vertices.size());
    case Shape::Kind::Plane:
      break;
  }
  return 0;
}

void System::layout_shapes() {
  int corner = 0;
  for (CompiledShape& shape : state.shapes) {
    shape.first_corner = corner;
    corner += count_corners(shape);
  }
  state.ground_points.resize(static_cast<size_t>(corner));
}

void System::pack_body(size_t b) {
  Lanes& l = *lanes;
  const LaneLayout layout = l.body_layout(lane);
  const BodyConstants& c = state.body[b];
  const auto put = [&](int f, double x) {
    l.body_constants[layout.at(b, static_cast<size_t>(f), kernel::kBodyFields)] = x;
  };
  const Mat3& I = c.inverse_inertia;
  const double inverse_inertia[6] = {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
  put(kernel::kInverseMass, c.inverse_mass);
  for (int i = 0; i < 6; ++i) put(kernel::kInverseInertia + i, inverse_inertia[i]);
  put(kernel::kDrifts, fixed[b] || in_cluster[b] ? 0 : 1);
  put(kernel::kFree, fixed[b] ? 0 : 1);
  // the box around its shapes
  Vec3 least{kUnlimited, kUnlimited, kUnlimited}, most = -least;
  for (int i = c.first_shape; i < c.first_shape + c.shapes; ++i) {
    const CompiledShape& shape = state.shapes[static_cast<size_t>(i)];
    for (int k = 0; k < 3; ++k) {
      double reach = shape.reach;
      if (shape.kind == Shape::Kind::Box) {
        reach = 0;
        for (int j = 0; j < 3; ++j) reach += std::abs(shape.R_BS(k, j)) * shape.half[j];
      }
      least[k] = std::min(least[k], shape.p_BS[k] - reach), most[k] = std::max(most[k], shape.p_BS[k] + reach);
    }
  }
  if (c.shapes == 0) least = most = {};
  const Vec3 centre = 0.5 * (least + most), half = 0.5 * (most - least);
  const double box[6] = {centre.x, centre.y, centre.z, half.x, half.y, half.z};
  // a plane, which only fixed bodies have, has no such box
  for (size_t f = 0; f < 6; ++f) l.bounds[layout.at(b, f, 6)] = std::isfinite(box[f]) ? box[f] : 0;
  l.reach[layout.at(b, 0, 1)] = fixed[b] ? 0 : c.radius;
  pack_ground_box(b);
}

Mat3 System::calc_world_inverse_inertia(size_t b) const {
  return world_tensor(state.R[b], state.body[b].inverse_inertia);
}

void System::evaluate_rotationals(double h) {
  for (size_t i = 0; i < rotationals.size(); ++i) {
    ZoneState& z = state.rotational[i];
    if (!z.live) continue;
    evaluate_rotational(i, h);
    if (!z.live) continue;
    const CompiledJoint& j = joints[static_cast<size_t>(rotationals[i].joint)];
    const Vec3 t = z.resultant.c[5] * (rotation_of(j.parent) * j.R_PF.column(2));
    if (j.child >= 0) torque[static_cast<size_t>(j.child)] -= t;
    if (j.parent >= 0) torque[static_cast<size_t>(j.parent)] += t;
  }
}

void System::evaluate_rotational(size_t i, double h) {
  ZoneState& z = state.rotational[i];
  const CompiledRotational& c = rotationals[i];
  const CompiledJoint& j = joints[static_cast<size_t>(c.joint)];
  const JointState& js = state.joint[static_cast<size_t>(c.joint)];
  const Mat3 R = rotation_of(j.parent);
  Six d;
  d.c[0] = -dot(R * j.R_PF.column(0), js.force);
  d.c[5] = js.angle;
  const ZoneParameters& zone = c.zone;
  const double elongated = z.axial, turned = z.station[0].reached;
  if (ignores_limits) {
    ZoneParameters elastic = zone;
    elastic.stations = 0;
    advance_zone(elastic, laws, d, state.time, h, z);
  } else {
    advance_zone(zone, laws, d, state.time, h, z);
  }
  tell_yield(E + i, z);
  if (c.axial_element >= 0 && h > 0) {
    const auto along = static_cast<size_t>(c.axial_element);
    if (z.axial != elongated) elongate_element(along, z.axial - elongated);
    const bool is_known = z.station[0].reached == turned && state.element[along].hinge_bears < kUnlimited;
    if (z.live && turned > 0 && !is_known) limit_element(along, calc_hinge_bearing(zone, laws, state.time, z));
  }
  if (!z.live) break_element(E + i, z.reason);
}

double System::calc_hinge_rotation(size_t i) const {
  if (was_loosened(i)) return measure_zone(elements[E + i]).deformation.c[5];
  const JointState& j = state.joint[static_cast<size_t>(rotationals[i].joint)];
  return j.live ? j.angle : state.rotational[i].deformation[5];
}

double System::calc_cable_length(size_t i) const {
  const Cable& k = model.cables[i];
  return norm(calc_point(k.b.index, k.p_B) - calc_point(k.a.index, k.p_A));
}

void System::evaluate_cables(bool at_rest) {
  for (size_t i = 0; i < model.cables.size(); ++i) {
    CableState& c = state.cable[i];
    if (!c.live) continue;
    const Cable& k = model.cables[i];
    const Vec3 p_A = calc_point(k.a.index, k.p_A), p_B = calc_point(k.b.index, k.p_B), d = p_B - p_A;
    const double length = norm(d), stretch = length - c.rest_length;
    const double before = c.force;
    c.force = stretch > 0 ? k.stiffness * stretch : 0;
    c.energy = stretch > 0 ? 0.5 * c.force * stretch : 0;
    if (!at_rest && c.force > k.strength) {
      const Ending ending = find_ending(before, c.force, k.strength);
      c.force = before;
      c.plastic += end_cable(i, p_A, p_B, ending);
      say({Happening::Kind::CableBroken, state.time, static_cast<int>(i), -1, "tension", 0});
      continue;
    }
    if (c.force == 0) continue;
    const Vec3 f = (c.force / length) * d;  // on a
    const auto load = [&](BodyId id, const Vec3& p, const Vec3& on) {
      if (id == kGround || fixed[static_cast<size_t>(id.index)]) {
        ground_reaction -= on;
        return;
      }
      const size_t b = static_cast<size_t>(id.index);
      force[b] += on;
      torque[b] += cross(p - state.p[b], on);
    };
    load(k.a, p_A, f);
    load(k.b, p_B, -f);
  }
}

void System::fire_events() {
  std::vector<DueEvent>& due = due_events;
  due.clear();
  while (state.next_event < event_order.size()) {
    const size_t index = event_order[state.next_event];
    if (model.events[index].time > state.time + 1e-9 * step) break;
    ++state.next_event;
    const Event& event = model.events[index];
    if (event.triggers.empty()) {
      due.push_back({static_cast<int>(index), event.time});
    } else {
      state.waiting.push_back(static_cast<int>(index));
      state.trigger_values.resize(state.trigger_values.size() + event.triggers.size(), kUnlimited);
    }
  }
  if (!state.waiting.empty()) find_triggered(due);
  state.has_rest = false;
  impelled.clear();
  recentred.clear();
  for (const DueEvent& one : due) {
    act(one);
    state.review_times.push_back(state.time);
    say({Happening::Kind::EventFired, state.time, one.index, -1, model.events[static_cast<size_t>(one.index)].name, 0});
    state.quiet_steps = 0;
  }
  add_slots(begun_elements);
  begun_elements.clear();
}

void System::act(const DueEvent& due) {
  const double time = due.time;
  for (const Action& a : model.events[static_cast<size_t>(due.index)].actions) {
    switch (a.kind) {
      case Action::Kind::RemoveElement: {
        const size_t r = static_cast<size_t>(a.rotational);
        if (a.rotational >= 0 && !was_loosened(r)) {
          remove_rotational(r, find_ending(time));
          break;
        }
        const size_t e = a.rotational >= 0 ? E + r : static_cast<size_t>(a.element.index);
        ZoneState& z = state.element[e];
        if (!z.live) break;
        unpack_element(e);
        end_element(e, find_ending(time));
        if (z.live) take_away(z);
        pack_element(e);
        mark_links_due();
        break;
      }
      case Action::Kind::SwitchLaw: {
        const LawSwitch to{a.law.index, time, a.ramp, a.stiffness_share};
        const size_t r = static_cast<size_t>(a.rotational);
        if (a.rotational >= 0 && !was_loosened(r)) {
          begin_switch(rotationals[r].zone, laws, to, state.rotational[r]);
        } else {
          const size_t e = a.rotational >= 0 ? E + r : static_cast<size_t>(a.element.index);
          unpack_element(e);
          begin_switch(elements[e].zone, laws, to, state.element[e]);
          pack_element(e);
        }
        state.review_times.push_back(time + a.ramp);
        break;
      }
      case Action::Kind::ReleaseJoint:
        release_joint(static_cast<size_t>(a.joint.index), time);
        break;
      case Action::Kind::LoosenJoint:
        loosen_joint(static_cast<size_t>(a.joint.index));
        break;
      case Action::Kind::ReplaceBody:
        replace_body(static_cast<size_t>(a.body.index), a.replacement, find_ending(time));
        break;
      case Action::Kind::ReleaseCable: {
        const size_t i = static_cast<size_t>(a.cable);
        const Cable& k = model.cables[i];
        if (state.cable[i].live)
          state.removed += end_cable(i, calc_point(k.a.index, k.p_A), calc_point(k.b.index, k.p_B), find_ending(time));
        break;
      }
      case Action::Kind::RemoveSpring:
        remove_spring(static_cast<size_t>(a.index), time);
        break;
      case Action::Kind::RemoveRotationalSpring:
        remove_torsion(static_cast<size_t>(a.index), time);
        break;
      case Action::Kind::RemoveBushing:
        remove_bushing(static_cast<size_t>(a.index), time);
        break;
      case Action::Kind::RemoveLoad:
        remove_load(static_cast<size_t>(a.index), time);
        break;
      case Action::Kind::ApplyLoad:
        apply_load(static_cast<size_t>(a.index), time);
        break;
    }
  }
}

void System::replace_body(size_t b, const Body& replacement, const Ending& ending) {
  State& s = state;
  if (fixed[b]) return;
  // until it was replaced it had the forces of the step before but those that had ended; contact begins anew
  ForceParts known = s.force_parts[b];
  Vec3 f = force[b] + joint_force[b], t = torque[b] + joint_torque[b];
  for (const auto& [body, by] : recentred)
    if (body == b) {
      t -= cross(by, f);
      known.contact_torque -= cross(by, known.contact), known.damping_torque -= cross(by, known.damping);
    }
  Vec3 rest = ending.rest * (f - known.contact), turn = ending.rest * (t - known.contact_torque);
  if (model.is_planar) rest.y = turn.x = turn.z = 0;
  for (Impelled& one : impelled)
    if (one.body == b && one.rest != 0) {
      const double share = ending.rest / one.rest;
      rest -= share * one.impulse, turn -= share * one.turn;
    }
  const Vec3 weighed = ending.rest * model.gravity;
  const double since = ending.ago * s.last_kick;
  const Mat3 R = since > 0 ? to_matrix(exp_rotation(-since * s.w[b])) * Mat3(s.R[b]) : Mat3(s.R[b]);
  const auto energy = [&](const Vec3& v, const Vec3& w) {
    return 0.5 * s.body[b].mass * (dot(v, v) - 2 * dot(model.gravity, s.p[b] - since * v)) +
           0.5 * dot(w, world_tensor(R, s.body[b].inertia) * w);
  };
  const Vec3 v = s.v[b] + s.body[b].inverse_mass * rest + weighed;
  const Vec3 w = world_tensor(R, s.body[b].inverse_inertia) * (s.L[b] + turn);
  const double before = energy(v, w) + take_pressed(b, step);
  clusters_due = true;  // levers and masses have changed
  forget_crushed_boxes_of(b);
  s.body[b] = constants_of(replacement, model.is_planar, normalized(model.bodies[b].X_WB.q));
  // from the old centre to the new one
  const Vec3 moved = R * replacement.X_WB.p, v_new = v + cross(w, moved);
  s.p[b] += s.R[b] * replacement.X_WB.p;
  s.p_offset[b] += replacement.X_WB.p;
  // the same forces go on; dampers brake the new body no more than to rest
  const auto kept = [](double change, double speed) { return change > 0 ? speed / (speed + change) : 1; };
  const Mat3 new_inverse = world_tensor(R, s.body[b].inverse_inertia);
  Vec3 braked = ending.rest * known.damping, braked_turn = ending.rest * known.damping_torque;
  if (model.is_planar) braked.y = braked_turn.x = braked_turn.z = 0;
  rest -= (1 - kept(s.body[b].inverse_mass * norm(braked), norm(v_new))) * braked;
  turn -= (1 - kept(norm(new_inverse * braked_turn), norm(w))) * braked_turn;
  s.v[b] = v_new - s.body[b].inverse_mass * rest - weighed;
  s.L[b] = world_tensor(R, s.body[b].inertia) * w - (turn - cross(moved, rest));
  s.w[b] = calc_world_inverse_inertia(b) * s.L[b];
  for (Impelled& one : impelled)
    if (one.body == b) one.turn -= cross(moved, one.impulse);
  recentred.emplace_back(b, moved);
  const double after = energy(v_new, w);
  pack_body(b);
  for (const int entry : incidence[b]) {
    unpack_element(static_cast<size_t>(entry / 2));
    pack_element(static_cast<size_t>(entry / 2));
  }
  // the old shapes stay in the list, unused
  append_shapes(replacement, s.body[b]);
  layout_shapes();
  find_crushed_boxes_of(b, replacement);
  number_crushed_boxes();
  s.removed += before - after;
  s.search_due = true;
  drop_pairs_of(b);
  s.touching.steps = 0;  // its points are others now
  s.ground_clear[b] = 0;
  GroundBox box = s.ground_box[b];
  box.forget();
  s.ground_box[b] = box;
  pack_ground_box(b);
  count_other_bodies();
}

void System::evaluate_forces() {
  begin_forces();
  evaluate_elements_fully(0);
  push_bodies(0);
  if (model.contact.ground && !model.contact.bodies) {
    set_lane_values(0, 0);
    lanes->press_ground();
    for (const std::uint32_t slot : lanes->landed) note_landing(slot);
  }
  finish_forces(0);
}

void System::begin_forces() {
  ground_reaction = {};
  ground_contact = {};
  keep_forces();
  fire_events();
}

void System::push_bodies(double h) {
  evaluate_rotationals(h);
  evaluate_cables(false);
  evaluate_springs(false);
  evaluate_loads(false);
  for (const size_t b : replaceable) state.force_parts[b] = {-Vec3(force[b]), -Vec3(torque[b]), {}, {}};
}

void System::finish_forces(double h) {
  if (!state.crushed_boxes.empty()) shorten_boxes();
  if (model.contact.ground || model.contact.bodies) evaluate_contact(h);
  for (const size_t b : replaceable) {
    ForceParts& known = state.force_parts[b];
    known.contact += force[b], known.contact_torque += torque[b];
    known.damping = -Vec3(force[b]), known.damping_torque = -Vec3(torque[b]);
  }
  evaluate_dampers();
  for (const size_t b : replaceable)
    state.force_parts[b].damping += force[b], state.force_parts[b].damping_torque += torque[b];
  if (model.is_planar) drop_forces_across();
}

void System::drop_forces_across() {
  const LaneLayout layout = lanes->body_layout(lane);
  for (size_t b = 0; b < B; ++b) {
    lanes->force[layout.at(b, 1, 3)] = 0;
    lanes->torque[layout.at(b, 0, 3)] = lanes->torque[layout.at(b, 2, 3)] = 0;
  }
}

namespace {

/// As kernel::mid_spin, of any turn.
Vec3 calc_mid_spin(const Mat3& W, const Vec3& L, double half_h) {
  const Vec3 w0 = W * L;
  Vec3 change = half_h * (W * cross(w0, L)), w = w0 - change;
  for (int round = 0; round < kernel::kMostSpinRounds; ++round) {
    const double w2 = dot(w, w), turn2 = half_h * half_h * w2;
    if (!(turn2 * turn2 * dot(change, change) > kernel::kSpinTolerance * kernel::kSpinTolerance * w2)) break;
    const Mat3 R = to_matrix(exp_rotation(half_h * w));
    const Vec3 next = R * (W * transpose_times(R, L));
    change = next - w;
    w = next;
  }
  return w;
}

}  // namespace

void System::drift(size_t b, double h, const Vec3& p0, const Quat& q0, const Mat3& R0) {
  State& s = state;
  const Mat3& inverse_inertia = s.body[b].inverse_inertia;
  const Vec3& L = s.L[b];
  s.p[b] = p0 + h * s.v[b];
  const Vec3 w = R0 * calc_mid_spin(inverse_inertia, transpose_times(R0, L), 0.5 * h);
  const Quat q = exp_rotation(h * w) * q0;
  // one step of Newton's method for the length, which round-off alone has changed
  const double unit = 1.5 - 0.5 * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  s.q[b] = {unit * q.w, unit * q.x, unit * q.y, unit * q.z};
  s.R[b] = to_matrix(s.q[b]);
  s.w[b] = s.R[b] * (inverse_inertia * transpose_times(s.R[b], L));
}

void System::prepare_step() {
  review_step();
  if (clusters_due) rebuild_clusters();
  if (joint_sums_due) {
    // bodies that joints have let go
    joint_force.fill({});
    joint_torque.fill({});
    joint_sums_due = false;
  }
  set_lane_values(kick_time(), step);
}

void System::set_lane_values(double kick, double h) {
  // one run fills all lanes, a sample of a batch its own
  const size_t first = lanes->is_batch ? lane : 0, last = lanes->is_batch ? lane + 1 : lanes->W;
  for (size_t i = first; i < last; ++i) {
    lanes->kick[i] = kick;
    lanes->h[i] = h;
    lanes->gx[i] = model.gravity.x, lanes->gy[i] = model.gravity.y, lanes->gz[i] = model.gravity.z;
    const Contact& c = model.contact;
    lanes->search_x[i] = state.search_velocity.x, lanes->search_y[i] = state.search_velocity.y,
    lanes->search_z[i] = state.search_velocity.z;
    lanes->nx[i] = c.normal.x, lanes->ny[i] = c.normal.y, lanes->nz[i] = c.normal.z, lanes->offset[i] = c.offset;
  }
}

void System::finish_motion() {
  State& s = state;
  solve_joints(step);
  s.first_kick = false;
  ++s.step_index;
  s.last_kick = step;
  s.time = s.time_base + static_cast<double>(s.step_index - s.index_base) * step;
  check_joints();
}

bool System::is_finite() const {
  // one broken number anywhere reaches this sum within a step or two
  double sum = 0;
  if (lanes->is_batch) {
    sum = lanes->sum[lane];
  } else {
    for (const double x : lanes->sum) sum += x;
  }
  return std::isfinite(sum);
}

void advance_together(Lanes& lanes, std::span<System* const> systems) {
  const auto each = [&](auto&& what) {
    for (System* s : systems)
      if (s != nullptr) what(*s);
  };
  // lanes without a sample stand still
  if (lanes.is_batch)
    for (AlignedVector<double>* x : {&lanes.kick, &lanes.h, &lanes.gx, &lanes.gy, &lanes.gz})
      std::fill(x->begin(), x->end(), 0);
  each([](System& s) { s.prepare_step(); });
  lanes.advance_bodies();
  for (const std::uint32_t slot : lanes.spins) {
    System* s = systems[lanes.is_batch ? slot % lanes.W : 0];
    if (s == nullptr) continue;
    const size_t b = lanes.is_batch ? slot / lanes.W : slot;
    s->drift(b, s->step, s->state.p[b], s->state.q[b], s->state.R[b]);
  }
  lanes.close_pairs();
  each([](System& s) {
    s.finish_motion();
    s.begin_forces();
  });
  lanes.outside.clear();
  lanes.cracked.clear();
  const auto any = [&](auto&& is) {
    return std::any_of(systems.begin(), systems.end(), [&](const System* s) { return s != nullptr && is(*s); });
  };
  if (any([](const System& s) { return s.model.contact.ground && s.has_other_contacts() && s.is_look_due(); }))
    lanes.find_lows();
  if (any([](const System& s) { return s.model.contact.bodies; })) lanes.find_ways();
  if (!lanes.is_batch) {
    systems.front()->evaluate_elements();
  } else {
    struct Batch {
      const Lanes& lanes;
      std::span<System* const> systems;
    } batch{lanes, systems};
    const kernel::FlowWriter writer{[](void* owner, size_t slot, double force) {
                                      const Batch& all = *static_cast<const Batch*>(owner);
                                      if (System* s = all.systems[slot % all.lanes.W]) s->write_cells(slot, force);
                                    },
                                    [](void* owner, size_t slot, const double* deformation, size_t stride) {
                                      const Batch& all = *static_cast<const Batch*>(owner);
                                      System* s = all.systems[slot % all.lanes.W];
                                      return s && s->grow_cracks(slot, deformation, stride);
                                    },
                                    [](void* owner, size_t slot, const double* deformation, size_t stride, double* to) {
                                      const Batch& all = *static_cast<const Batch*>(owner);
                                      System* s = all.systems[slot % all.lanes.W];
                                      return s ? s->crack_spring(slot, deformation, stride, to)
                                               : kernel::SpringCracks::Hold;
                                    },
                                    &batch};
    lanes.evaluate_elements(0, lanes.element_blocks, writer, lanes.outside, lanes.cracked);
    for (const std::uint32_t slot : lanes.cracked) systems[slot % lanes.W]->keep_spring(slot);
    for (const std::uint32_t slot : lanes.outside)
      if (System* s = systems[slot % lanes.W]) s->evaluate_outside(slot);
    lanes.share_again();
    lanes.sum_forces();
  }
  each([](System& s) { s.push_bodies(s.step); });
  if (any([](const System& s) { return s.model.contact.ground && !s.model.contact.bodies; })) {
    lanes.press_ground();
    for (const std::uint32_t slot : lanes.landed)
      if (System* s = systems[lanes.is_batch ? slot % lanes.W : 0]) s->note_landing(slot);
  }
  each([](System& s) { s.finish_forces(s.step); });
}

bool System::advance_step() {
  System* const self = this;
  advance_together(*lanes, {&self, 1});
  return is_finite() && trouble.empty();
}

Vec3 System::calc_velocity(size_t b) const { return calc_velocity(b, joint_force[b]); }

Vec3 System::calc_velocity(size_t b, const Vec3& from_joints) const {
  if (fixed[b] || state.first_kick) return state.v[b];
  const Vec3 a = state.body[b].inverse_mass * (force[b] + from_joints) + model.gravity;
  return state.v[b] + (0.5 * step) * a;
}

Vec3 System::calc_angular_velocity(size_t b) const { return calc_angular_velocity(b, joint_torque[b]); }

Vec3 System::calc_angular_velocity(size_t b, const Vec3& from_joints) const {
  if (fixed[b]) return {};
  if (state.first_kick) return state.w[b];
  const Vec3 L = state.L[b] + (0.5 * step) * (torque[b] + from_joints);
  return state.R[b] * (state.body[b].inverse_inertia * transpose_times(state.R[b], L));
}

Energy System::calc_energy() const {
  Energy e;
  for (size_t b = 0; b < B; ++b) {
    if (fixed[b]) continue;
    const BodyConstants& c = state.body[b];
    // both half steps' velocities give the kinetic energy between them
    const Vec3 v = calc_velocity(b, body_reaction[b]), w = calc_angular_velocity(b, body_reaction_turn[b]);
    e.kinetic += 0.5 * c.mass * dot(v, v) + 0.5 * dot(w, state.R[b] * (c.inertia * transpose_times(state.R[b], w)));
    e.gravity -= c.mass * dot(model.gravity, state.p[b]);
  }
  e.gravity -= state.gravity_at_start;
  for (const auto* list : {&state.element, &state.rotational})
    for (const ZoneState& z : *list) {
      e.elastic += z.energy + z.damper_energy;
      e.plastic += z.plastic;
      e.damping += z.damping;
    }
  for (const CableState& c : state.cable) {
    e.elastic += c.energy;
    e.plastic += c.plastic;
  }
  add_energy_of_forces(e);
  double pressed = state.contact_energy, stuck = state.stick_energy, rubbed = state.friction_work;
  e.contact_loss = state.contact_loss;
  for (size_t b = 0; b < B && model.contact.ground; ++b) {
    const GroundBox box = state.ground_box[b];
    pressed += box.pressed, stuck += box.stuck, rubbed += box.friction, e.contact_loss += box.loss;
  }
  e.contact = pressed + stuck;
  e.friction = -rubbed - stuck;
  e.removed = state.removed;
  e.residual = e.kinetic + e.gravity + e.elastic + e.contact + e.plastic + e.damping + e.friction + e.contact_loss +
               e.removed - e.loads - state.total_at_start;
  const double freed = std::max(0.0, state.stored_at_start - e.elastic - e.contact);
  e.released = std::max(state.released, -e.gravity - e.removed + e.loads + freed);
  return e;
}

const View& System::calc_view() {
  if (state.first_kick && !forces.damped.empty())
    look_at_start();
  else
    look();
  return view;
}

void System::look() {
  unpack_elements();
  calc_reactions();
  if (state.has_rest || !forces.loads.empty()) {
    // the step's share of a table, and what it needs besides, are no force of now
    const Vec3 ground = ground_reaction;
    std::vector<std::pair<Vec3, Vec3>> of_step;
    for (size_t b = 0; b < B; ++b) of_step.emplace_back(force[b], torque[b]);
    if (take_loads_as_they_are()) {
      calc_reactions();
      see();
      const Vec3 ground_force = view.ground_force;
      const std::vector<Vec3> held = view.joint_force, turned = view.joint_moment;
      ground_reaction = ground;
      for (size_t b = 0; b < B; ++b) force[b] = of_step[b].first, torque[b] = of_step[b].second;
      calc_reactions();
      see();
      view.ground_force = ground_force, view.joint_force = held, view.joint_moment = turned;
      return;
    }
  }
  see();
}

void System::see() {
  View& v = view;
  const State& s = state;
  const size_t R = rotationals.size();
  v.time = s.time;
  v.X_WB.resize(B);
  v.centre.resize(B);
  v.v_WB.resize(B);
  v.w_WB.resize(B);
  v.mass.resize(B);
  for (size_t b = 0; b < B; ++b) {
    v.X_WB[b] = {s.p[b] - s.R[b] * s.p_offset[b], s.q[b]};
    v.centre[b] = s.p[b];
    v.v_WB[b] = calc_velocity(b, body_reaction[b]);
    v.w_WB[b] = calc_angular_velocity(b, body_reaction_turn[b]);
    v.mass[b] = s.body[b].mass;
  }
  v.element_state.resize(E + R);
  v.utilisation.resize(E + R);
  v.rotation.resize(E + R);
  v.shortening.resize(E + R);
  v.element_force.resize(E);
  v.element_moment.resize(E);
  v.element_translation.resize(E);
  v.element_rotation.resize(E);
  v.crushed = calc_crushed(s.crushed_boxes, E,
                           [&](auto& box) { return elements[static_cast<size_t>(box.element)].b == box.body; });
  const auto fill = [&](size_t at, const ZoneParameters& p, const ZoneState& z) {
    v.element_state[at] = !z.live ? (z.reason == BreakReason::Removed ? ElementState::Removed : ElementState::Broken)
                          : is_softening(p, laws, s.time, z) ? ElementState::Softening
                          : has_yielded(z)                   ? ElementState::Yielded
                                                             : ElementState::Elastic;
    v.utilisation[at] = calc_utilisation(p, laws, s.time, z);
    v.rotation[at] = std::max(z.station[0].reached, z.station[1].reached);
    v.shortening[at] = z.shortened;
  };
  for (size_t i = 0; i < E; ++i) {
    const ZoneState& z = s.element[i];
    fill(i, elements[i].zone, z);
    v.element_force[i] = -Vec3{z.resultant.c[0], z.resultant.c[1], z.resultant.c[2]};
    v.element_moment[i] = -Vec3{z.resultant.c[3], z.resultant.c[4], z.resultant.c[5]};
    // of one that is broken the frames go on to part
    const Six parted = z.live ? Six{} : measure_zone(elements[i]).deformation;
    const double* d = z.live ? z.deformation : parted.c;
    v.element_translation[i] = {d[0], d[1], d[2]};
    v.element_rotation[i] = {d[3], d[4], d[5]};
  }
  v.hinge_rotation.resize(R);
  v.hinge_moment.resize(R);
  v.hinge_normal.resize(R);
  for (size_t i = 0; i < R; ++i) {
    const bool is_element = was_loosened(i);
    const ZoneState& z = is_element ? s.element[E + i] : s.rotational[i];
    fill(E + i, is_element ? elements[E + i].zone : rotationals[i].zone, z);
    v.hinge_rotation[i] = calc_hinge_rotation(i);
    v.hinge_moment[i] = -z.resultant.c[5];
    v.hinge_normal[i] = !z.live ? 0 : is_element ? z.resultant.c[0] : z.normal_force;
  }
  v.joint_force.resize(joints.size());
  v.joint_moment.resize(joints.size());
  v.joint_released.resize(joints.size());
  v.joint_angle.resize(joints.size());
  v.joint_displacement.resize(joints.size());
  Vec3 joints_on_ground;
  for (size_t j = 0; j < joints.size(); ++j) {
    const CompiledJoint& c = joints[j];
    const Mat3 F = rotation_of(c.parent) * c.R_PF;
    v.joint_force[j] = transpose_times(F, reaction_force[j]);
    v.joint_moment[j] = transpose_times(F, reaction_moment[j]);
    v.joint_released[j] = !s.joint[j].live;
    if (const size_t r = static_cast<size_t>(c.rotational); c.rotational >= 0 && is_loose(r)) {
      // of a on b is minus the resultant
      const double* f = s.element[E + r].resultant.c;
      v.joint_force[j] = -Vec3{f[0], f[1], f[2]};
      v.joint_moment[j] = -Vec3{f[3], f[4], f[5]};
      v.joint_released[j] = false;
    }
    v.joint_angle[j] = s.joint[j].live ? s.joint[j].angle : 0;
    const bool slides = s.joint[j].live && (c.kind == Joint::Kind::Prismatic || c.kind == Joint::Kind::Cylindrical);
    v.joint_displacement[j] = slides ? dot(F.column(2), calc_joint_frames(s, c).gap) : 0;
    if (c.parent < 0 || fixed[static_cast<size_t>(c.parent)]) joints_on_ground += reaction_force[j];
    if (c.child < 0 || fixed[static_cast<size_t>(c.child)]) joints_on_ground -= reaction_force[j];
  }
  v.cable_force.resize(s.cable.size());
  v.cable_length.resize(s.cable.size());
  for (size_t i = 0; i < s.cable.size(); ++i) {
    v.cable_force[i] = s.cable[i].force;
    v.cable_length[i] = calc_cable_length(i);
  }
  view_forces(v);
  v.contact_force_ground = ground_contact;
  for (size_t b = 0; b < B; ++b) v.contact_force_ground += GroundBox(s.ground_box[b]).push;
  v.ground_force = calc_element_reaction() + ground_reaction + v.contact_force_ground + joints_on_ground;
  v.body_contacts = body_contacts;
  v.energy = calc_energy();
}

}  // namespace topple::mbs
