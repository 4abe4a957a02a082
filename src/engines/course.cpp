#include "engines/course.h"

#include <algorithm>
#include <cmath>

#include "engines/articulation.h"
#include "engines/requirements.h"
#include "mbs/course.h"
#include "mbs/quantity.h"

namespace topple::engines {

namespace {

constexpr double kShortened = 0.05;  // of a box, before an engine builds its system anew [m]

bool waits_for_joint(const mbs::Event& e) {
  using Kind = mbs::Quantity::Kind;
  return std::any_of(e.triggers.begin(), e.triggers.end(), [](const mbs::Trigger& t) {
    return t.quantity.kind == Kind::JointForce || t.quantity.kind == Kind::JointMoment;
  });
}

/// What a joint bears is handed on where it is loosened.
bool loosens(const mbs::Event& e) {
  return std::any_of(e.actions.begin(), e.actions.end(),
                     [](const mbs::Action& a) { return a.kind == mbs::Action::Kind::LoosenJoint; });
}

bool has_limit(const mbs::Joint& j) {
  return j.tension_limit < mbs::kUnlimited || j.shear_limit < mbs::kUnlimited || j.moment_limit < mbs::kUnlimited ||
         j.rotation_limit < mbs::kUnlimited;
}

bool has_reaction_limit(const mbs::Joint& j) {
  return j.tension_limit < mbs::kUnlimited || j.shear_limit < mbs::kUnlimited || j.moment_limit < mbs::kUnlimited;
}

/// How long what an event does goes on after it [s].
double find_longest_ramp(const mbs::Event& e) {
  double longest = 0;
  for (const mbs::Action& a : e.actions)
    if (a.kind == mbs::Action::Kind::SwitchLaw) longest = std::max(longest, a.ramp);
  return longest;
}

const char* words_of(mbs::Summary::Ending e) {
  using Ending = mbs::Summary::Ending;
  return e == Ending::AtRest ? "came to rest" : e == Ending::Cancelled ? "cancelled" : "stopped by the time limit";
}

}  // namespace

mbs::Options make_silent(mbs::Options options) {
  options.on_frame = {};
  options.on_happening = {};
  options.samplings.clear();
  options.progress.report = {};
  return options;
}

double choose_step(const mbs::Model& model, const mbs::Options& options) {
  return options.step > 0 ? options.step : mbs::Simulation(model, make_silent(options)).step();
}

Course::Course(const mbs::Model& model, const mbs::Options& options)
    : model_(model),
      options_(options),
      forces_(model, [this](const mbs::Happening& h) { say(h); }),
      sampler_(options.samplings) {
  const size_t J = model.joints.size();
  for (const mbs::Body& b : model.bodies) body_.push_back({b.mass, {}, b.inertia, b.shapes, 0});
  for (size_t b = 0; b < model.bodies.size(); ++b) find_crushed_boxes_of(b);
  joint_live_.assign(J, 1);
  angle_.assign(J, 0);
  distance_.assign(J, 0);
  for (size_t i = 0; i < model.events.size(); ++i) {
    (model.events[i].triggers.empty() ? timed_ : waiting_).push_back(i);
    const double ramp = model.events[i].triggers.empty() ? find_longest_ramp(model.events[i]) : 0;
    last_event_ = std::max(last_event_, model.events[i].time + ramp);
    needs_reactions_ |= waits_for_joint(model.events[i]) || loosens(model.events[i]);
  }
  std::stable_sort(timed_.begin(), timed_.end(),
                   [&](size_t a, size_t b) { return model.events[a].time < model.events[b].time; });
  for (const mbs::Joint& j : model.joints) needs_reactions_ |= has_reaction_limit(j);
  needs_reactions_ |= forces_.needs_joint_forces();
  softened_.assign(model.elements.size() + model.rotational_elements.size(), 0);
}

void Course::say(const mbs::Happening& h) const {
  if (options_.on_happening) options_.on_happening(h);
}

void Course::note(const std::string& text) {
  if (std::find(summary_.notes.begin(), summary_.notes.end(), text) == summary_.notes.end())
    summary_.notes.push_back(text);
}

bool Course::find_start() {
  const size_t B = model_.bodies.size();
  motion_ = {};
  motion_.v_WB.assign(B, {});
  motion_.w_WB.assign(B, {});
  if (options_.equilibrium) {
    mbs::Simulation native(model_, make_silent(options_));
    if (!native.find_equilibrium(summary_.message)) {
      summary_.ending = mbs::Summary::Ending::NoEquilibrium;
      summary_.overloads = native.summary().overloads;
      return false;
    }
    const mbs::Summary found = native.summary();
    summary_.equilibrium_iterations = found.equilibrium_iterations;
    summary_.equilibrium_residual = found.equilibrium_residual;
    motion_.X_WB = native.calc_view().X_WB;
    return true;
  }
  for (size_t b = 0; b < B; ++b) {
    const mbs::Body& body = model_.bodies[b];
    motion_.X_WB.push_back({body.X_WB.p, normalized(body.X_WB.q)});
    if (body.fixed) continue;
    motion_.v_WB[b] = body.v_WB;
    motion_.w_WB[b] = body.w_WB;
  }
  return true;
}

bool Course::start(double step, bool ends_on_instants) {
  step_ = step;
  ends_on_instants_ = ends_on_instants || step == 0;
  summary_.step = summary_.shortest_step = step;
  if (!find_start()) {
    is_over_ = true;
    return false;
  }
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    const JointFrames f = frames_of(model_.joints[j]);
    angle_[j] = calc_joint_angle(f, 0);
    distance_[j] = norm(f.X_WM.p - f.X_WF.p);
  }
  for (size_t b = 0; b < body_.size(); ++b) gravity_at_start_ += calc_gravity(b);
  if (!crushed_boxes_.empty() && (can_touch_ground(model_) || can_touch_bodies(model_)))
    note(
        "members that are crushed (\"crush_through\") have rigid ends where they meet something; the native engine "
        "crushes them");
  fire_events();
  must_rebuild_ = false;  // nothing is built yet
  forces_.start(motion_);
  total_at_start_ = 0;
  const mbs::Energy e = calc_energy();
  total_at_start_ = e.residual, stored_at_start_ = e.elastic;
  begin_ = std::chrono::steady_clock::now();
  return true;
}

double Course::next_stop() const {
  double stop = options_.duration;
  stop = std::min(
      {stop, static_cast<double>(frame_) * calc_frame_interval(), sampler_.next(), forces_.next_corner(time_)});
  if (next_event_ < timed_.size()) stop = std::min(stop, std::max(time_, model_.events[timed_[next_event_]].time));
  return stop;
}

bool Course::is_frame_due() const {
  return time_ >= static_cast<double>(frame_) * calc_frame_interval() - calc_early();
}

Course::Verdict Course::accept(double time, const Motion& motion, const Work& work, const Touch& touch,
                               const std::function<Reactions()>& find_reactions) {
  if (is_over_) return Verdict::Stop;
  time_ = time;
  motion_ = motion;
  work_ = work;
  touch_ = touch;
  is_viewed_ = false;
  for (size_t b = 0; b < body_.size(); ++b)
    if (!is_finite(motion.X_WB[b].p) || !is_finite(motion.v_WB[b]) || !is_finite(motion.w_WB[b])) {
      fail("the motion of body \"" + model_.bodies[b].name + "\" is no longer finite");
      return Verdict::Stop;
    }
  const bool is_sampled = sampler_.is_due(time_, calc_early());
  if (needs_reactions_ || is_frame_due() || is_sampled) reactions_ = find_reactions();
  bool jumped = false;
  measure_joints();
  if (is_started_) {
    std::vector<Vec3> in_F;
    if (forces_.needs_joint_forces() && !reactions_.force.empty())
      for (size_t j = 0; j < model_.joints.size(); ++j)
        in_F.push_back(transpose_times(to_matrix(frames_of(model_.joints[j]).X_WF.q), reactions_.force[j]));
    // what is released or removed leaves with the history and energy of this state
    jumped |= forces_.advance(time, motion_, in_F);
    const bool is_released = check_joints();
    if (fire_events() || is_released) {
      forces_.renew(time, motion_);
      is_viewed_ = false;
      jumped = true;
    }
    shorten_boxes();
  }
  is_started_ = true;
  if (is_sampled) sampler_.take(calc_view(), calc_early());
  if (is_frame_due()) {
    show();
    while (is_frame_due()) ++frame_;
    if (options_.progress.report) options_.progress.report(time_, options_.duration);
  }
  const double early = step_ > 0 ? 1e-9 * step_ : 1e-12 * (1 + time_);
  if (options_.progress.is_cancelled()) {
    summary_.ending = mbs::Summary::Ending::Cancelled;
    is_over_ = true;
  } else if (is_at_rest()) {
    summary_.ending = mbs::Summary::Ending::AtRest;
    is_over_ = true;
    show();
  } else if (time_ >= options_.duration - early) {
    summary_.ending = mbs::Summary::Ending::TimeLimit;
    is_over_ = true;
  }
  if (is_over_) return Verdict::Stop;
  if (must_rebuild_) {
    must_rebuild_ = false;
    return Verdict::Rebuild;
  }
  return jumped ? Verdict::ForcesJumped : Verdict::GoOn;
}

void Course::fail(const std::string& message) {
  is_over_ = true;
  summary_.ending = mbs::Summary::Ending::Diverged;
  summary_.message = "diverged at " + std::to_string(time_) + " s: " + message;
}

mbs::Summary Course::finish(long steps) {
  if (summary_.ending != mbs::Summary::Ending::NoEquilibrium) {
    summary_.wall_time = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    summary_.time = time_;
    summary_.steps = steps;
    mbs::EnergyScale scale;
    scale.released = released_;
    scale.brought = options_.equilibrium ? 0 : total_at_start_;
    for (size_t b = 0; b < body_.size(); ++b)
      if (!model_.bodies[b].fixed) scale.force += body_[b].mass * norm(model_.gravity);
    for (size_t i = 0; i < model_.loads.size(); ++i)
      if (forces_.has_begun(i)) scale.force += mbs::calc_largest_force(model_.loads[i]);
    scale.round_off = mbs::calc_round_off(model_, time_ / static_cast<double>(std::max(steps, 1L)), steps);
    summary_.energy_error = mbs::calc_energy_error(largest_residual_, scale);
    const bool is_run =
        summary_.ending == mbs::Summary::Ending::TimeLimit || summary_.ending == mbs::Summary::Ending::AtRest;
    if (const std::string lost = mbs::describe_lost_energy(summary_.energy_error); is_run && !lost.empty()) fail(lost);
    if (summary_.message.empty())
      summary_.message = std::string(words_of(summary_.ending)) + " at " + std::to_string(time_) + " s";
  }
  return summary_;
}

// --- joints

JointFrames Course::frames_of(const mbs::Joint& j) const {
  JointFrames f;
  const auto look = [&](mbs::BodyId id, const Pose& X_BF, Pose& X, Vec3& v, Vec3& w) {
    if (id == mbs::kGround) {
      X = X_BF;
      return;
    }
    const size_t b = static_cast<size_t>(id.index);
    X = motion_.X_WB[b] * X_BF;
    w = motion_.w_WB[b];
    v = motion_.v_WB[b] + cross(w, X.p - motion_.X_WB[b].p);
  };
  look(j.parent, j.X_PF, f.X_WF, f.v_F, f.w_F);
  look(j.child, j.X_CM, f.X_WM, f.v_M, f.w_M);
  return f;
}

void Course::measure_joints() {
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    if (!joint_live_[j]) continue;
    const JointFrames f = frames_of(model_.joints[j]);
    angle_[j] = calc_joint_angle(f, angle_[j]);
    const JointGap gap = calc_gap(model_.joints[j].kind, f, distance_[j]);
    summary_.joint_drift = std::max({summary_.joint_drift, gap.length, gap.angle});
  }
}

bool Course::check_joints() {
  bool released = false;
  for (size_t i = 0; i < model_.joints.size(); ++i) {
    const mbs::Joint& j = model_.joints[i];
    if (!joint_live_[i] || !has_limit(j)) continue;
    const char* reason = nullptr;
    if (!reactions_.force.empty()) {
      const JointFrames f = frames_of(j);
      const Vec3 between = f.X_WM.p - f.X_WF.p, force = reactions_.force[i];
      const Vec3 x =
          j.kind == mbs::Joint::Kind::Distance ? (1 / norm(between)) * between : to_matrix(f.X_WF.q).column(0);
      const double along = dot(x, force);
      if (-along > j.tension_limit)
        reason = "tension";
      else if (norm(force - along * x) > j.shear_limit)
        reason = "shear";
      else if (norm(reactions_.moment[i]) > j.moment_limit)
        reason = "moment";
    }
    const bool turns = j.kind == mbs::Joint::Kind::Revolute || j.kind == mbs::Joint::Kind::Cylindrical;
    // whose rotational element has broken turns freely
    if (!reason && turns && std::abs(angle_[i]) > j.rotation_limit && !forces_.has_broken_hinge(i)) reason = "rotation";
    if (!reason) continue;
    release(i, reason);
    released = true;
  }
  return released;
}

void Course::loosen(size_t j) {
  if (!joint_live_[j]) return;
  Vec3 force, moment;
  if (reactions_.force.size() == model_.joints.size()) {
    const Mat3 F = to_matrix(frames_of(model_.joints[j]).X_WF.q);
    force = transpose_times(F, reactions_.force[j]), moment = transpose_times(F, reactions_.moment[j]);
  }
  if (!forces_.loosen_joint(j, force, moment, time_)) return;
  joint_live_[j] = 0;
  must_rebuild_ = true;
}

void Course::release(size_t j, const char* reason) {
  if (!joint_live_[j] && !forces_.is_loose(j)) return;
  joint_live_[j] = 0;
  must_rebuild_ = true;
  forces_.release_joint(j, time_);
  say({mbs::Happening::Kind::JointReleased, time_, static_cast<int>(j), -1, reason, 0});
}

// --- events

bool Course::fire_events() {
  bool fired = false;
  std::vector<size_t> due;  // all are decided on before the first acts
  const auto fire = [&](size_t i) {
    for (const mbs::Action& a : model_.events[i].actions) act(model_.events[i], a);
    say({mbs::Happening::Kind::EventFired, time_, static_cast<int>(i), -1, model_.events[i].name, 0});
    last_event_ = std::max(last_event_, time_ + find_longest_ramp(model_.events[i]));
    fired = true;
  };
  const double late = step_ > 0 ? 1e-9 * step_ : 1e-12 * (1 + time_);
  for (; next_event_ < timed_.size() && model_.events[timed_[next_event_]].time <= time_ + late; ++next_event_)
    due.push_back(timed_[next_event_]);
  std::vector<size_t> still;
  for (const size_t i : waiting_) {
    const mbs::Event& e = model_.events[i];
    const bool holds = is_started_ && time_ + late >= e.time &&
                       std::any_of(e.triggers.begin(), e.triggers.end(), [&](const mbs::Trigger& t) {
                         // a joint that is gone has no angle and no displacement
                         const bool is_of_motion = t.quantity.kind == mbs::Quantity::Kind::JointAngle ||
                                                   t.quantity.kind == mbs::Quantity::Kind::JointDisplacement;
                         if (is_of_motion && joint_live_[static_cast<size_t>(t.quantity.index)] == 0) return false;
                         const double value = mbs::calc_component(t.quantity, t.component, calc_view());
                         return t.rising ? value >= t.limit : value <= t.limit;
                       });
    (holds ? due : still).push_back(i);
  }
  waiting_ = still;
  // in the order of their times, those of one time in that of the model
  const auto time_of = [&](size_t i) {
    const mbs::Event& e = model_.events[i];
    return e.triggers.empty() || e.time > time_ - step_ ? std::min(e.time, time_) : time_;
  };
  std::stable_sort(due.begin(), due.end(),
                   [&](size_t a, size_t b) { return time_of(a) != time_of(b) ? time_of(a) < time_of(b) : a < b; });
  for (const size_t i : due) fire(i);
  return fired;
}

void Course::act(const mbs::Event& event, const mbs::Action& a) {
  using Kind = mbs::Action::Kind;
  const size_t index = static_cast<size_t>(std::max(a.index, 0));
  switch (a.kind) {
    case Kind::RemoveElement:
      return forces_.remove_element(a);
    case Kind::SwitchLaw:
      return forces_.switch_law(a, event.triggers.empty() ? event.time : time_);
    case Kind::ReleaseJoint:
      return release(static_cast<size_t>(a.joint.index), "released");
    case Kind::ReplaceBody:
      return replace_body(static_cast<size_t>(a.body.index), a.replacement);
    case Kind::ReleaseCable:
      return forces_.release_cable(static_cast<size_t>(a.cable));
    case Kind::RemoveSpring:
      return forces_.remove_spring(index);
    case Kind::RemoveRotationalSpring:
      return forces_.remove_rotational_spring(index);
    case Kind::RemoveBushing:
      return forces_.remove_bushing(index);
    case Kind::RemoveLoad:
      return forces_.remove_load(index);
    case Kind::LoosenJoint:
      return loosen(static_cast<size_t>(a.joint.index));
    case Kind::ApplyLoad:
      return forces_.apply_load(index, event.triggers.empty() ? event.time : time_);
  }
}

void Course::replace_body(size_t b, const mbs::Body& replacement) {
  if (model_.bodies[b].fixed) return;
  const double before = calc_kinetic(b) + calc_gravity(b);
  body_[b].mass = replacement.mass;
  body_[b].inertia = replacement.inertia;
  body_[b].p_BBcm += replacement.X_WB.p;
  body_[b].shapes = replacement.shapes;
  for (mbs::Shape& s : body_[b].shapes) s.X_BS.p += body_[b].p_BBcm;
  ++body_[b].replaced;
  std::erase_if(crushed_boxes_, [&](const mbs::CrushedBox& box) { return box.body == static_cast<int>(b); });
  find_crushed_boxes_of(b);
  removed_ += before - calc_kinetic(b) - calc_gravity(b);
  must_rebuild_ = true;
}

void Course::find_crushed_boxes_of(size_t b) {
  std::vector<double> stations;
  for (size_t e = 0; e < model_.elements.size(); ++e) {
    const mbs::ZoneElement& element = model_.elements[e];
    if (!(element.crush_through > 0)) continue;
    stations.clear();
    for (const mbs::Station& s : element.stations) stations.push_back(s.x);
    for (const bool is_b : {false, true}) {
      if ((is_b ? element.b : element.a).index != static_cast<int>(b)) continue;
      const size_t first = crushed_boxes_.size();
      mbs::find_crushed_boxes(static_cast<int>(e), is_b ? element.X_BM : element.X_AF, is_b, stations, body_[b].shapes,
                              crushed_boxes_);
      for (size_t i = first; i < crushed_boxes_.size(); ++i) crushed_boxes_[i].body = static_cast<int>(b);
    }
  }
}

void Course::shorten_boxes() {
  for (mbs::CrushedBox& box : crushed_boxes_) {
    const double crushed = forces_.crushed_length(static_cast<size_t>(box.element));
    if (!(std::min(crushed - box.begin, box.most) > box.taken + kShortened)) continue;
    BodyNow& body = body_[static_cast<size_t>(box.body)];
    mbs::Shape& s = body.shapes[static_cast<size_t>(box.shape)];
    (void)mbs::shorten_box(crushed, box, s.X_BS.p, to_matrix(normalized(s.X_BS.q)), s.half);
    ++body.replaced;
    must_rebuild_ = true;
  }
}

// --- energy, rest and frames

Vec3 Course::calc_velocity_of_centre(size_t b) const {
  return motion_.v_WB[b] + cross(motion_.w_WB[b], to_matrix(motion_.X_WB[b].q) * body_[b].p_BBcm);
}

double Course::calc_kinetic(size_t b) const {
  const Vec3 v = calc_velocity_of_centre(b), w = transpose_times(to_matrix(motion_.X_WB[b].q), motion_.w_WB[b]);
  return 0.5 * body_[b].mass * dot(v, v) + 0.5 * dot(w, body_[b].inertia * w);
}

double Course::calc_gravity(size_t b) const {
  if (model_.bodies[b].fixed) return 0;
  return -body_[b].mass * dot(model_.gravity, motion_.X_WB[b] * body_[b].p_BBcm);
}

mbs::Energy Course::calc_energy() const {
  mbs::Energy e;
  for (size_t b = 0; b < body_.size(); ++b) {
    if (model_.bodies[b].fixed) continue;
    e.kinetic += calc_kinetic(b);
    e.gravity += calc_gravity(b);
  }
  e.gravity -= gravity_at_start_;
  const ElementEnergy in = forces_.calc_energy();
  e.elastic = in.elastic;
  e.plastic = in.plastic;
  e.damping = in.damping + work_.damping;
  e.loads = work_.loads;
  e.contact_loss = -work_.contact;
  e.removed = removed_ + in.removed;
  e.residual = e.kinetic + e.gravity + e.elastic + e.plastic + e.damping + e.contact_loss + e.removed - e.loads -
               total_at_start_;
  e.released = std::max(released_, -e.gravity - e.removed + e.loads + std::max(0.0, stored_at_start_ - e.elastic));
  return e;
}

bool Course::is_at_rest() {
  if (!(options_.rest_speed > 0)) return false;
  if (time_ <= std::max(last_event_, forces_.calc_last_load_change())) {
    quiet_since_ = -1;
    return false;
  }
  double twice_kinetic = 0, mass = 0, fastest2 = 0;
  for (size_t b = 0; b < body_.size(); ++b) {
    if (model_.bodies[b].fixed) continue;
    const Vec3 v = calc_velocity_of_centre(b);
    twice_kinetic += 2 * calc_kinetic(b);
    mass += body_[b].mass;
    fastest2 = std::max(fastest2, dot(v, v));
  }
  const double limit2 = options_.rest_speed * options_.rest_speed;
  if (!(twice_kinetic < limit2 * mass && fastest2 < 625 * limit2)) {
    quiet_since_ = -1;
    return false;
  }
  if (quiet_since_ < 0) quiet_since_ = time_;
  return time_ - quiet_since_ >= options_.rest_time;
}

void Course::show() {
  if (shown_ == time_) return;
  shown_ = time_;
  is_viewed_ = false;
  const mbs::View& v = calc_view();
  for (size_t i = 0; i < softened_.size(); ++i)
    if (!softened_[i] && v.element_state[i] == mbs::ElementState::Softening) {
      softened_[i] = 1;
      say({mbs::Happening::Kind::ElementSoftening, time_, static_cast<int>(i), -1, {}, 0});
    }
  largest_residual_ = std::max(largest_residual_, std::abs(v.energy.residual));
  released_ = v.energy.released;
  if (options_.on_frame) options_.on_frame(v);
}

const mbs::View& Course::calc_view() {
  if (is_viewed_) return view_;
  is_viewed_ = true;
  mbs::View& v = view_;
  const size_t B = body_.size(), J = model_.joints.size();
  v.time = time_;
  v.X_WB = motion_.X_WB;
  v.w_WB = motion_.w_WB;
  v.centre.resize(B);
  v.v_WB.resize(B);
  v.mass.resize(B);
  for (size_t b = 0; b < B; ++b) {
    v.centre[b] = motion_.X_WB[b] * body_[b].p_BBcm;
    v.v_WB[b] = calc_velocity_of_centre(b);
    v.mass[b] = body_[b].mass;
  }
  forces_.fill(time_, motion_, v);
  v.crushed = mbs::calc_crushed(crushed_boxes_, model_.elements.size(), [&](auto& box) {
    return model_.elements[static_cast<size_t>(box.element)].b.index == box.body;
  });
  v.joint_released.assign(J, false);
  v.joint_angle.assign(J, 0);
  v.joint_displacement.assign(J, 0);
  const bool knows_reactions = reactions_.force.size() == J;
  v.joint_force.assign(knows_reactions ? J : 0, {});
  v.joint_moment.assign(knows_reactions ? J : 0, {});
  v.ground_force = forces_.ground_force() - touch_.on_ground;
  for (size_t j = 0; j < J; ++j) {
    using Kind = mbs::Joint::Kind;
    const mbs::Joint& x = model_.joints[j];
    const mbs::Six* loose = joint_live_[j] ? nullptr : forces_.find_loose(j);
    v.joint_released[j] = !joint_live_[j] && loose == nullptr;
    if (loose != nullptr && knows_reactions) {
      v.joint_force[j] = -Vec3{loose->c[0], loose->c[1], loose->c[2]};
      v.joint_moment[j] = -Vec3{loose->c[3], loose->c[4], loose->c[5]};
    }
    if (!joint_live_[j]) continue;
    const JointFrames f = frames_of(x);
    if (x.kind == Kind::Revolute || x.kind == Kind::Cylindrical) v.joint_angle[j] = angle_[j];
    if (x.kind == Kind::Prismatic || x.kind == Kind::Cylindrical) v.joint_displacement[j] = calc_joint_displacement(f);
    if (!knows_reactions) continue;
    const Mat3 F = to_matrix(f.X_WF.q);
    v.joint_force[j] = transpose_times(F, reactions_.force[j]);
    v.joint_moment[j] = transpose_times(F, reactions_.moment[j]);
    if (is_ground(model_, x.parent.index)) v.ground_force += reactions_.force[j];
    if (is_ground(model_, x.child.index)) v.ground_force -= reactions_.force[j];
  }
  v.contact_force_ground = -touch_.on_ground;
  v.body_contacts = touch_.body_contacts;
  v.energy = calc_energy();
  return v;
}

}  // namespace topple::engines
