#include "mbs/solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "mbs/course.h"
#include "mbs/snapshot.h"
#include "mbs/succession.h"
#include "mbs/system.h"

namespace topple::mbs {

void SystemDeleter::operator()(System* s) const { delete s; }

void SystemDeleter::operator()(Course* c) const { delete c; }

Simulation::Simulation(const Model& model, const Options& options) : system_(new System(model, options)) {}
Simulation::Simulation(const Model& model, const Options& options, const Moment& moment, bool is_successor)
    : system_(new System(model, options, 0, true)) {
  go_on(moment, *system_, is_successor);
  course_.reset(new Course(*system_, moment.course));
}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

bool Simulation::begin() {
  course_.reset(new Course(*system_));
  return course_->begin();
}
bool Simulation::advance() {
  (void)system_->advance_step();
  return course_->follow();
}
Summary Simulation::finish() { return course_->finish(); }
Moment Simulation::keep() const { return keep_moment(*system_, *course_); }
long Simulation::steps() const { return system_->state.step_index; }
double Simulation::next_time() const { return system_->state.time + system_->step; }

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
  joint_force.fill({});
  joint_torque.fill({});
  clusters_due = true;
  close_joints();
  state.gravity_at_start = 0;
  state.gravity_at_start = calc_energy().gravity;
  evaluate_forces();
  pack_elements();
  state.total_at_start = 0;
  const Energy e = calc_energy();
  state.total_at_start = e.residual;
  state.stored_at_start = e.elastic + e.contact;
  if (options.tells_lost_contact) note_overlaps_at_start();
}

Summary run(const Model& model, const Options& options) {
  using Clock = std::chrono::steady_clock;
  Simulation s = options.from ? Simulation(model, options, *options.from) : Simulation(model, options);
  bool goes_on = options.from ? s.time() < options.duration - 1e-9 * s.step() : s.begin();
  Clock::time_point kept = Clock::now();
  const auto is_due = [&] {
    return std::chrono::duration<double>(Clock::now() - kept).count() >= options.moment_interval;
  };
  while (goes_on) {
    goes_on = s.advance();
    if (goes_on && options.on_moment && is_due()) options.on_moment(s.keep()), kept = Clock::now();
  }
  Summary summary = s.finish();
  if (summary.ending == Summary::Ending::Cancelled && options.on_moment) {
    Moment here = s.keep();
    here.summary.ending = Summary::Ending::TimeLimit;  // it has not ended where it goes on
    here.summary.message.clear();
    options.on_moment(here);
  }
  return summary;
}

}  // namespace topple::mbs
