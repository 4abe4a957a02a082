#include "collapse/live_run.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "collapse/plan_record.h"

namespace topple::collapse {

namespace {

constexpr size_t kMostPaths = 2000;  // zones whose paths are kept; more would be larger than the record

}  // namespace

LiveRun::LiveRun(std::shared_ptr<const LiveModel> model, const RunOptions& options, double moment_interval, int)
    : model_(std::move(model)),
      options_(options),
      record_(std::make_unique<record::Record>()),
      moment_interval_(moment_interval) {
  callbacks_.on_event = [this](const record::Event& e) {
    if (on_event) on_event(e);
  };
  const mbs::Model& m = model_->model();
  keeps_paths_ = m.elements.size() + m.rotational_elements.size() <= kMostPaths;
  fill_provenance(options_, "native", *record_);
  fill_from_plan(model_->plan(), m, model_->map(), *record_);
  recorder_ = std::make_unique<Recorder>(m, model_->map(), model_->knowledge(), *record_, callbacks_);
  if (has_screening(model_->plan())) recorder_->keep_speeds();
}

LiveRun::LiveRun(std::shared_ptr<const LiveModel> model, const RunOptions& options, double moment_interval)
    : LiveRun(std::move(model), options, moment_interval, 0) {
  tell_failing_charges(model_->plan(), model_->map(), *recorder_);
}

LiveRun::LiveRun(std::shared_ptr<const LiveModel> model, const RunOptions& options, double moment_interval,
                 const mbs::Moment& moment, bool is_successor, const Recorder& before)
    : LiveRun(std::move(model), options, moment_interval, 0) {
  recorder_->follow(before, moment.time);
  tell_failing_charges(model_->plan(), model_->map(), *recorder_, moment.time);
  begun_ = true;
  time_ = start_time_ = last_moment_ = moment.time;
  steps_ = start_steps_ = moment.steps;
  summary_ = moment.summary;
  simulation_ = std::make_unique<mbs::Simulation>(model_->model(), make_options(), moment, is_successor);
  // the last frame before it, where that run has seen others since
  if (before.last_time() > moment.time) recorder_->look(simulation_->calc_view());
  // a successor's own start, from which its model alone goes on
  moments_.push_back(simulation_->keep());
  note_state();
}

mbs::Options LiveRun::quiet_options() const {
  return make_mbs_options(settings_of(model_->plan(), model_->knowledge(), options_), model_->knowledge(),
                          options_.threads, {});
}

mbs::Options LiveRun::make_options() {
  mbs::Options o = quiet_options();
  record_into(*recorder_, o);
  o.on_frame = [this](const mbs::View& v) { add_frame(v); };
  return o;
}

void LiveRun::add_frame(const mbs::View& v) {
  const size_t before = record_->time.size();
  recorder_->add_frame(v);
  if (record_->time.size() == before) return;
  frame_steps_.push_back(simulation_->steps());
  frame_seconds_.push_back(seconds());
  cable_force_ = v.cable_force;
  if (keeps_paths_) {
    const auto add = [this](double N, double My, double Mz, double ry, double rz) {
      for (const double x : {N, My, Mz, ry, rz}) zone_path_.push_back(static_cast<float>(x));
    };
    // moments of a law have the signs of its rotations, forces of a on b the other ones
    for (size_t e = 0; e < v.element_force.size(); ++e)
      add(-v.element_force[e].x, -v.element_moment[e].y, -v.element_moment[e].z, v.element_rotation[e].y,
          v.element_rotation[e].z);
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    for (size_t r = 0; r < v.hinge_moment.size(); ++r)
      add(v.hinge_normal[r], none, -v.hinge_moment[r], none, v.hinge_rotation[r]);
  }
  if (on_frame) on_frame();
}

void LiveRun::note_state() {
  time_ = simulation_->time();
  steps_ = simulation_->steps();
  next_time_ = simulation_->next_time();
}

void LiveRun::keep_moment() {
  moments_.push_back(simulation_->keep());
  last_moment_ = time_;
}

double LiveRun::seconds() const {
  if (!called_) return seconds_;
  return seconds_ + std::chrono::duration<double>(std::chrono::steady_clock::now() - *called_).count();
}

bool LiveRun::count_time(bool (LiveRun::*compute)()) {
  called_ = std::chrono::steady_clock::now();
  const bool goes_on = (this->*compute)();
  seconds_ = seconds();
  called_.reset();
  return goes_on;
}

bool LiveRun::begin() { return begun_ ? !ended_ : count_time(&LiveRun::compute_beginning); }

bool LiveRun::advance() { return !ended_ && count_time(&LiveRun::compute_step); }

bool LiveRun::compute_beginning() {
  begun_ = true;
  simulation_ = std::make_unique<mbs::Simulation>(model_->model(), make_options());
  const bool goes_on = simulation_->begin();
  summary_ = simulation_->finish();
  if (summary_.ending == mbs::Summary::Ending::NoEquilibrium) {
    ended_ = true;
    simulation_.reset();
    return false;
  }
  note_state();
  keep_moment();
  ended_ = !goes_on;
  return goes_on;
}

bool LiveRun::compute_step() {
  if (simulation_ == nullptr) {
    simulation_ = std::make_unique<mbs::Simulation>(model_->model(), make_options(), moments_.back());
    note_state();
  }
  const bool goes_on = simulation_->advance();
  note_state();
  if (!goes_on) {
    ended_ = true;
    summary_ = simulation_->finish();
    simulation_.reset();
    return false;
  }
  if (time_ - last_moment_ >= moment_interval_) keep_moment();
  return true;
}

mbs::Summary LiveRun::summary() const {
  mbs::Summary s = ended_ || (simulation_ == nullptr && moments_.empty()) ? summary_
                   : simulation_ != nullptr                               ? simulation_->finish()
                                                                          : moments_.back().summary;
  s.wall_time = seconds();
  if (ended_) return s;
  s.ending = mbs::Summary::Ending::Cancelled;
  s.time = time_;
  s.steps = steps_;
  return s;
}

void LiveRun::tell(const record::Event& e) { recorder_->add_event(e); }

void LiveRun::rest() {
  if (simulation_ == nullptr) return;
  if (moments_.back().steps != steps_) keep_moment();
  simulation_.reset();
}

mbs::Moment LiveRun::moment_at(long step) const {
  const auto after = std::upper_bound(moments_.begin(), moments_.end(), step,
                                      [](long s, const mbs::Moment& m) { return s < m.steps; });
  if (after == moments_.begin()) throw std::logic_error("a moment before the start of a run");
  const mbs::Moment& from = *(after - 1);
  if (from.steps == step) return from;
  if (simulation_ != nullptr && steps_ == step) return simulation_->keep();
  // quietly: frames are shown to nobody, but they are shown
  mbs::Simulation simulation(model_->model(), quiet_options(), from);
  while (simulation.steps() < step && simulation.advance()) {}
  return simulation.keep();
}

void LiveRun::thin_out() {
  moment_interval_ *= 2;
  std::vector<mbs::Moment> kept;
  for (size_t i = 0; i < moments_.size(); ++i)
    if (i % 2 == 0 || i + 1 == moments_.size()) kept.push_back(std::move(moments_[i]));
  moments_ = std::move(kept);
}

std::size_t LiveRun::moment_bytes() const {
  std::size_t sum = 0;
  for (const mbs::Moment& m : moments_) sum += m.bytes();
  return sum;
}

}  // namespace topple::collapse
