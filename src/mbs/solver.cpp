#include "mbs/solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "mbs/sampler.h"
#include "mbs/snapshot.h"
#include "mbs/system.h"

namespace topple::mbs {

void SystemDeleter::operator()(System* s) const { delete s; }

Simulation::Simulation(const Model& model, const Options& options) : system_(new System(model, options)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

bool Simulation::find_equilibrium(std::string& message) { return system_->find_equilibrium(message); }
bool Simulation::advance_step() {
  system_->start();
  return system_->advance_step();
}
double Simulation::time() const { return system_->state.time; }
double Simulation::step() const { return system_->step; }
const View& Simulation::calc_view() {
  system_->start();
  return system_->calc_view();
}
std::vector<std::byte> Simulation::snapshot() const {
  system_->start();
  return write_snapshot(*system_);
}
void Simulation::restore(const std::vector<std::byte>& bytes) { read_snapshot(bytes, *system_); }
Summary Simulation::summary() const { return system_->summary; }

void System::start() {
  if (!started) evaluate_start();
}

void System::evaluate_start() {
  started = true;
  joint_force.assign(B, {});
  joint_torque.assign(B, {});
  clusters_due = true;
  state.gravity_at_start = 0;
  state.gravity_at_start = calc_energy().gravity;
  evaluate_forces(0);
  pack_elements();
  state.total_at_start = 0;
  const Energy e = calc_energy();
  state.total_at_start = e.residual;
}

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

}  // namespace

Summary run(const Model& model, const Options& options) {
  System s(model, options);
  Summary& out = s.summary;
  if (options.equilibrium) {
    if (!s.find_equilibrium(out.message)) {
      out.ending = Summary::Ending::NoEquilibrium;
      return out;
    }
  }
  s.start();
  const double h = s.step;
  const long steps = static_cast<long>(std::ceil(options.duration / h - 1e-9));
  double last_event = 0;
  for (const Event& e : model.events) last_event = std::max(last_event, e.time);
  const bool has_loads = !model.loads.empty();
  const long rest_steps = std::max(1L, static_cast<long>(options.rest_time / h));
  const double interval = std::max(options.frame_interval, h);
  const auto begin = std::chrono::steady_clock::now();
  long frame = 0;
  double shown = -1;
  std::vector<bool> softened(s.elements.size() + s.rotationals.size(), false);
  const auto show = [&] {
    if (shown == s.state.time) return;
    shown = s.state.time;
    const View& v = s.calc_view();
    for (size_t i = 0; i < softened.size(); ++i)
      if (!softened[i] && v.element_state[i] == ElementState::Softening) {
        softened[i] = true;
        s.say({Happening::Kind::ElementSoftening, s.state.time, static_cast<int>(i), -1, {}, 0});
      }
    s.state.largest_residual = std::max(s.state.largest_residual, std::abs(v.energy.residual));
    s.state.released = v.energy.released;
    if (options.on_frame) options.on_frame(v);
  };
  Sampler sampler(options.samplings);
  show();
  ++frame;
  if (sampler.is_due(s.state.time, 0.5 * h)) sampler.take(s.calc_view(), 0.5 * h);
  out.ending = Summary::Ending::TimeLimit;
  while (s.state.step_index < steps) {
    if (!s.advance_step()) {
      out.ending = Summary::Ending::Diverged;
      break;
    }
    if (sampler.is_due(s.state.time, 0.5 * h)) sampler.take(s.calc_view(), 0.5 * h);
    const bool due = s.state.time >= static_cast<double>(frame) * interval - 0.5 * h;
    if (due) {
      show();
      while (s.state.time >= static_cast<double>(frame) * interval - 0.5 * h) ++frame;
      if (options.progress.report) options.progress.report(s.state.time, options.duration);
    }
    if (options.progress.is_cancelled()) {
      out.ending = Summary::Ending::Cancelled;
      break;
    }
    if (has_loads) last_event = std::max(last_event, s.calc_last_load_change());
    if (options.rest_speed > 0 && s.state.time > last_event) {
      double fastest2 = 0, twice_kinetic = 0, mass = 0;
      for (size_t b = 0; b < s.B; ++b) {
        if (s.fixed[b]) continue;
        const Vec3 &v = s.state.v[b], &w = s.state.w[b];
        fastest2 = std::max(fastest2, dot(v, v));
        twice_kinetic += s.state.body[b].mass * dot(v, v) + dot(w, s.state.L[b]);
        mass += s.state.body[b].mass;
      }
      const double limit2 = options.rest_speed * options.rest_speed;
      const bool quiet = twice_kinetic < limit2 * mass && fastest2 < 625 * limit2;
      s.state.quiet_steps = quiet ? s.state.quiet_steps + 1 : 0;
      if (s.state.quiet_steps >= rest_steps) {
        out.ending = Summary::Ending::AtRest;
        show();
        break;
      }
    }
  }
  out.wall_time = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  out.time = s.state.time;
  out.steps = s.state.step_index;
  out.energy_error = s.state.released > 0 ? s.state.largest_residual / s.state.released : 0;
  out.joint_drift = s.state.largest_drift;
  out.message = std::string(words_of(out.ending)) + " at " + std::to_string(out.time) + " s";
  if (!s.trouble.empty()) {
    out.message += ": " + s.trouble;
  } else if (out.ending == Summary::Ending::Diverged) {
    if (s.step > s.damper_limit) out.message += "; " + out.notes.front();
    for (size_t b = 0; b < s.B; ++b)
      if (!is_finite(s.state.p[b]) || !is_finite(s.state.v[b])) {
        out.message += ": the pose of body \"" + model.bodies[b].name + "\" is no longer finite";
        break;
      }
  }
  return out;
}

}  // namespace topple::mbs
