#include "mbs/course.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace topple::mbs {

namespace {

const char* words_of(Summary::Ending e) {
  switch (e) {
    case Summary::Ending::TimeLimit:
      return "stopped by the time limit";
    case Summary::Ending::AtRest:
      return "came to rest";
    case Summary::Ending::Cancelled:
      return "cancelled";
    case Summary::Ending::NoEquilibrium:
      return "no dead-load equilibrium";
    case Summary::Ending::Diverged:
      return "diverged";
  }
  return "";
}

double find_largest_factor(const Load& l) {
  double most = l.factor.empty() ? 1 : 0;
  for (const double f : l.factor) most = std::max(most, std::abs(f));
  return most;
}

/// Of coordinates in W and in bodies [m].
double find_farthest(const Model& m) {
  double most = 0;
  const auto see = [&](const Vec3& p) { most = std::max(most, norm(p)); };
  for (const Body& b : m.bodies) see(b.X_WB.p);
  for (const Joint& j : m.joints) see(j.X_PF.p), see(j.X_CM.p);
  for (const ZoneElement& e : m.elements) see(e.X_AF.p), see(e.X_BM.p);
  for (const Bushing& b : m.bushings) see(b.X_AF.p), see(b.X_BM.p);
  for (const SpringDamper& s : m.springs) see(s.p_A), see(s.p_B);
  for (const Cable& c : m.cables) see(c.p_A), see(c.p_B);
  return most;
}

}  // namespace

double calc_energy_error(double residual, const EnergyScale& s) {
  constexpr double way = 1e-6;  // of everything, the least that an error is measured by [m]
  const double reference = std::max({s.released, s.brought, way * s.force, s.step_ways});
  return reference > 0 && residual > s.round_off ? residual / reference : 0;
}

double calc_largest_force(const Load& l) { return find_largest_factor(l) * (norm(l.force) + norm(l.torque)); }

double calc_round_off(const Model& m, double step, long steps) {
  if (!(step > 0)) return 0;
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double farthest = find_farthest(m);
  double sum = 0;
  for (const Body& b : m.bodies) {
    if (b.fixed) continue;
    // of a stable step the springs store no more than this
    sum += b.mass * farthest * farthest + b.inertia(0, 0) + b.inertia(1, 1) + b.inertia(2, 2);
  }
  const double rate = epsilon / step;
  return static_cast<double>(steps) * rate * rate * sum;
}

std::string describe_lost_energy(double error) {
  constexpr double most = 1;
  if (!(error > most)) return {};
  char words[160];
  std::snprintf(words, sizeof words,
                "the balance of energy lacks %.3g times what was released or there at the start; the step may be too "
                "long",
                error);
  return words;
}

Course::Course(System& s) : Course(s, {.softened = std::vector<bool>(s.elements.size(), false)}) {}

Course::Course(System& s, const CourseState& state) : s_(s), sampler_(s.options.samplings, state.sampled), now_(state) {
  interval_ = std::max(s.options.frame_interval, s.summary.step);
  for (const Event& e : s.model.events) last_event_ = std::max(last_event_, e.time);
  begin_ = std::chrono::steady_clock::now();
}

bool Course::begin() {
  Summary& out = s_.summary;
  begin_ = std::chrono::steady_clock::now();
  if (s_.options.equilibrium && !s_.find_equilibrium(out.message)) {
    out.ending = Summary::Ending::NoEquilibrium;
    return false;
  }
  s_.start();
  begin_ = std::chrono::steady_clock::now();
  show();
  ++now_.frame;
  const double slack = 0.5 * s_.step;
  if (sampler_.is_due(s_.state.time, slack)) sampler_.take(s_.calc_view(), slack);
  out.ending = Summary::Ending::TimeLimit;
  return s_.state.time < s_.options.duration - 1e-9 * s_.step;
}

CourseState Course::state() const {
  CourseState now = now_;
  now.sampled = sampler_.next_instants();
  now.seconds = calc_seconds();
  return now;
}

double Course::calc_seconds() const {
  return now_.seconds + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void Course::show() {
  if (now_.shown == s_.state.time) return;
  now_.shown = s_.state.time;
  const View& v = s_.calc_view();
  s_.tell_yields();
  for (size_t i = 0; i < now_.softened.size(); ++i)
    if (!now_.softened[i] && v.element_state[i] == ElementState::Softening) {
      now_.softened[i] = true;
      s_.say({Happening::Kind::ElementSoftening, s_.state.time, static_cast<int>(i), -1, {}, 0});
    }
  if (!std::isfinite(v.energy.residual) && s_.trouble.empty()) s_.trouble = "its energy is no longer finite";
  judge(v.energy);
  s_.state.released = v.energy.released;
  if (s_.options.on_frame) s_.options.on_frame(v);
  if (s_.options.pass_speed > 0) watch(v);
}

void Course::judge(const Energy& e) {
  constexpr double least = 1e-3;  // of what was released: a tenth of what a plan's run may lack
  now_.last_residual = std::abs(e.residual);
  double& largest = s_.state.largest_residual;
  if (now_.readings > 0 || !(now_.last_residual > largest)) return;
  // what contacts store may be what the rest of an impact pays
  const double held = std::max(0.0, e.contact), frequency = s_.calc_contact_frequency();
  const bool is_doubted = held > 0 && frequency > 0 && now_.last_residual > least * e.released;
  largest = std::max(largest, now_.last_residual - (is_doubted ? held : 0));
  if (!is_doubted) return;
  constexpr double half_swing = 3.14159265358979323846;
  now_.doubted = now_.last_residual;
  now_.readings = std::max(1, static_cast<int>(std::ceil(half_swing / (frequency * s_.step))));
}

void Course::read_again() {
  now_.doubted = std::min(now_.doubted, std::abs(s_.calc_view().energy.residual));
  if (--now_.readings == 0) s_.state.largest_residual = std::max(s_.state.largest_residual, now_.doubted);
}

void Course::watch(const View& v) {
  double mass = 0;
  for (size_t b = 0; b < s_.B; ++b)
    if (!s_.fixed[b]) mass += v.mass[b];
  const Options& o = s_.options;
  const bool is_slow = 2 * v.energy.kinetic < o.pass_speed * o.pass_speed * mass;
  const bool is_held = v.energy.plastic - now_.plastic_then <= o.pass_share * v.energy.released;
  if (!is_slow || !is_held) {
    now_.quiet_since = v.time;
    now_.plastic_then = v.energy.plastic;
  }
  now_.is_quiet = v.time - now_.quiet_since >= o.pass_time;
}

void Course::pass_quiet() {
  State& s = s_.state;
  if (!now_.is_quiet || s.next_event >= s_.event_order.size() || !s.waiting.empty() || !s.review_times.empty() ||
      !s_.model.loads.empty())
    return;
  const double next = s_.model.events[s_.event_order[s.next_event]].time;
  const double steps = std::floor((next - s.time) / s_.step) - 1;
  if (!(steps >= 1)) return;
  s.time_base += steps * s_.step;
  s.time = s.time_base + static_cast<double>(s.step_index - s.index_base) * s_.step;
  now_.is_quiet = false;
  now_.quiet_since = s.time;
  show();
}

bool Course::is_at_rest() {
  State& state = s_.state;
  if (s_.options.rest_speed <= 0 || state.time <= last_event_) return false;
  // a law that still goes over to another one is an event that lasts
  const auto is_ahead = [&](double t) { return t > state.time; };
  if (std::any_of(state.review_times.begin(), state.review_times.end(), is_ahead)) return false;
  const double limit2 = s_.options.rest_speed * s_.options.rest_speed;
  bool quiet = true;
  double twice_kinetic = 0, mass = 0;
  for (size_t b = 0; b < s_.B && quiet; ++b) {
    if (s_.fixed[b]) continue;
    const Vec3 v = state.v[b], w = state.w[b];
    quiet = dot(v, v) < 625 * limit2;
    twice_kinetic += state.body[b].mass * dot(v, v) + dot(w, state.L[b]);
    mass += state.body[b].mass;
  }
  quiet = quiet && twice_kinetic < limit2 * mass;
  state.quiet_steps = quiet ? state.quiet_steps + 1 : 0;
  return static_cast<double>(state.quiet_steps) >= std::max(1.0, std::floor(s_.options.rest_time / s_.step));
}

double Course::calc_weight() const {
  double mass = 0;
  for (size_t b = 0; b < s_.B; ++b)
    if (!s_.fixed[b]) mass += s_.state.body[b].mass;
  return mass * norm(s_.model.gravity);
}

double Course::calc_energy_error() const {
  const double brought = s_.options.equilibrium ? 0 : s_.state.total_at_start;
  double force = calc_weight();
  for (size_t i = 0; i < s_.model.loads.size(); ++i)
    if (s_.state.load[i].begin != kUnlimited) force += calc_largest_force(s_.model.loads[i]);
  return mbs::calc_energy_error(
      std::max(s_.state.largest_residual, now_.readings > 0 ? now_.doubted : 0.0),
      {s_.state.released, brought, force, calc_round_off(s_.model, s_.summary.shortest_step, s_.state.step_index),
       calc_step_ways()});
}

double Course::calc_step_ways() const {
  const double h = s_.step, g = norm(s_.model.gravity);
  std::vector<double> force(s_.B, 0), torque(s_.B, 0);
  for (size_t i = 0; i < s_.model.loads.size(); ++i) {
    const Load& l = s_.model.loads[i];
    if (s_.state.load[i].begin == kUnlimited || l.body.index < 0) continue;
    const double most = find_largest_factor(l);
    force[static_cast<size_t>(l.body.index)] += most * norm(l.force);
    torque[static_cast<size_t>(l.body.index)] += most * norm(l.torque);
  }
  double sum = 0;
  for (size_t b = 0; b < s_.B; ++b) {
    if (s_.fixed[b]) continue;
    const Mat3& I = s_.model.bodies[b].inertia;
    const double mass = s_.state.body[b].mass, f = force[b] + mass * g;
    sum += f * f / mass + torque[b] * torque[b] / std::min({I(0, 0), I(1, 1), I(2, 2)});
  }
  return 2 * h * h * sum;
}

double Course::calc_singular_play() const {
  if (s_.joint_notes.empty()) return 0;
  constexpr double lift = 1e-3;  // [m]
  double force = calc_weight();
  for (const Load& l : s_.model.loads) force += find_largest_factor(l) * norm(l.force);
  return lift * force;
}

bool Course::end() {
  constexpr double near = 1.5;  // steps behind the last frame
  if (s_.summary.ending == Summary::Ending::AtRest || s_.state.time - now_.shown > near * s_.step) show();
  // no step follows that could take it back
  if (now_.readings > 0)
    s_.state.largest_residual = std::max({s_.state.largest_residual, now_.doubted, now_.last_residual});
  now_.readings = 0;
  if (!s_.trouble.empty()) s_.summary.ending = Summary::Ending::Diverged;
  const std::string lost = describe_lost_energy(calc_energy_error());
  if (!lost.empty() && s_.state.largest_residual > calc_singular_play()) {
    s_.summary.ending = Summary::Ending::Diverged;
    s_.trouble = lost;
  }
  return false;
}

bool Course::follow() {
  Summary& out = s_.summary;
  const Options& options = s_.options;
  const double slack = 0.5 * s_.step;
  double time = s_.state.time;
  if (!s_.is_finite() || !s_.trouble.empty()) {
    out.ending = Summary::Ending::Diverged;
    return false;
  }
  if (sampler_.is_due(time, slack)) sampler_.take(s_.calc_view(), slack);
  if (now_.readings > 0) read_again();
  if (time >= static_cast<double>(now_.frame) * interval_ - slack) {
    show();
    pass_quiet();
    time = s_.state.time;
    while (time >= static_cast<double>(now_.frame) * interval_ - slack) ++now_.frame;
    if (options.progress.report) options.progress.report(time, options.duration);
  }
  if (!s_.model.loads.empty()) last_event_ = std::max(last_event_, s_.calc_last_load_change());
  if (is_at_rest()) {
    out.ending = Summary::Ending::AtRest;
    return end();
  }
  if (!(time < options.duration - 1e-9 * s_.step)) return end();
  // behind all that a step is followed by, so that it goes on from here with the next one
  if (options.progress.is_cancelled()) {
    out.ending = Summary::Ending::Cancelled;
    return false;
  }
  return true;
}

Summary Course::finish() {
  Summary& out = s_.summary;
  if (out.ending == Summary::Ending::NoEquilibrium) return out;
  const State& state = s_.state;
  out.wall_time = calc_seconds();
  out.time = state.time;
  out.steps = state.step_index;
  out.energy_error = calc_energy_error();
  out.joint_drift = state.largest_drift;
  if (s_.options.tells_lost_contact) s_.note_swing_of_contact();
  out.message = std::string(words_of(out.ending)) + " at " + std::to_string(out.time) + " s";
  if (!s_.trouble.empty()) {
    out.message += ": " + s_.trouble;
  } else if (out.ending == Summary::Ending::Diverged) {
    for (size_t b = 0; b < s_.B; ++b)
      if (!topple::is_finite(Vec3(state.p[b])) || !topple::is_finite(Vec3(state.v[b]))) {
        out.message += ": the pose of body \"" + s_.model.bodies[b].name + "\" is no longer finite";
        break;
      }
  }
  return out;
}

}  // namespace topple::mbs
