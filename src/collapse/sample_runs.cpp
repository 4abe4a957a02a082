#include "collapse/sample_runs.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <exception>
#include <memory>

#include "collapse/findings.h"
#include "collapse/manager.h"
#include "collapse/plan_record.h"
#include "collapse/recorder.h"
#include "collapse/stability.h"
#include "collapse/vibration.h"
#include "mbs/batch.h"
#include "mbs/kernel.h"

namespace topple::collapse {

namespace {

/// CPU time of this thread [s].
double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// One plan on its way. Not moved: the recorder holds on to its parts.
struct Sample {
  Sample(const product::Plan& p, const Knowledge& k, const SampleRunOptions& o)
      : plan(p),
        model(o.condensation ? make_condensed_model(p, k, *o.condensation, o.known, map) : make_model(p, k, map)) {
    record.building_outline = calc_building_outline(model, map);
    recorder = std::make_unique<Recorder>(model, map, k, record, callbacks);
    if (!o.condensation && has_screening(p)) recorder->keep_speeds();
  }

  const product::Plan& plan;
  ModelMap map;
  mbs::Model model;
  record::Record record;
  RunCallbacks callbacks;
  std::unique_ptr<Recorder> recorder;
  mbs::Summary summary;
  bool is_over = false;  // fell before the last stage, and that is enough
  // of a single run
  double begun = 0, first_frame = 0, last_stage = 0, in_outputs = 0, in_outputs_standing = 0;
};

double calc_release(const product::Plan& plan) { return plan.stages.empty() ? 0 : plan.stages.back().time; }

mbs::Options make_options(const product::Plan& plan, const Knowledge& k, const SampleRunOptions& in) {
  mbs::Options o;
  o.duration = calc_release(plan) + in.after;
  o.step = plan.analysis.step;
  o.step_share = in.step_share, o.full_law = in.full_law;
  constexpr double condensed_rate = 20;  // numbers between frames lie on straight lines [1/s]
  o.frame_interval = 1 / (in.frame_rate > 0 ? in.frame_rate
                          : in.condensation ? condensed_rate
                                            : plan.analysis.frame_rate);
  o.rest_speed = k.rest_speed;
  o.rest_time = k.rest_time;
  o.threads = 1;
  if (in.condensation) o.pass_speed = in.pass_speed, o.pass_share = in.pass_share, o.contact_interval = 2;
  return o;
}

/// Takes a frame in. A condensed sample that has left its place before the last stage is over `early_after` behind its
/// first touchdown: what the last stage would do to the heap is nobody's question.
void add_frame(Sample& s, const Knowledge& k, const SampleRunOptions& options, const mbs::View& v) {
  constexpr double early_after = 1;  // [s]
  if (s.is_over) return;
  s.recorder->add_frame(v);
  if (!options.condensation || !options.ends_early || v.time >= calc_release(s.plan)) return;
  // not where a bay or an annex has come down and the rest still stands or begins to move
  const std::vector<double> touchdowns = s.recorder->upper_touchdowns(0, true);
  s.is_over = !touchdowns.empty() && v.time >= touchdowns.front() + early_after &&
              !stands(s.recorder->block_frames().back(), k);
}

void run_single(Sample& s, const Knowledge& k, const SampleRunOptions& options, const std::atomic<bool>* cancel) {
  mbs::Options o = make_options(s.plan, k, options);
  std::atomic<bool> stop = false;
  o.progress.cancel = options.condensation ? &stop : cancel;
  const double release = calc_release(s.plan);
  o.on_frame = [&](const mbs::View& v) {
    const double t = now();
    if (s.first_frame == 0) s.first_frame = t;
    add_frame(s, k, options, v);
    if (s.is_over || (cancel && cancel->load(std::memory_order_relaxed))) stop = true;
    const double spent = now() - t;
    s.in_outputs += spent;
    if (v.time <= release) s.last_stage = t + spent, s.in_outputs_standing = s.in_outputs;
  };
  o.on_happening = [&s](const mbs::Happening& h) {
    if (!s.is_over) s.recorder->add_happening(h);
  };
  s.begun = now();
  s.summary = mbs::run(s.model, o);
  if (s.is_over) s.summary.ending = mbs::Summary::Ending::TimeLimit;
}

/// All of one build and one kind of options.
void run_together(const std::vector<Sample*>& samples, const Knowledge& k, const SampleRunOptions& options,
                  const std::atomic<bool>* cancel) {
  mbs::BatchOptions o;
  o.run = make_options(samples.front()->plan, k, options);
  o.progress.cancel = cancel;
  o.on_frame = [&](size_t i, const mbs::View& v) {
    const double t = now();
    add_frame(*samples[i], k, options, v);
    samples[i]->in_outputs += now() - t;
  };
  o.on_happening = [&samples](size_t i, const mbs::Happening& h) {
    if (!samples[i]->is_over) samples[i]->recorder->add_happening(h);
  };
  std::vector<mbs::Variation> variations;
  for (const Sample* s : samples) variations.emplace_back([s](mbs::Model& m) { m = s->model; });
  const std::vector<mbs::Summary> summaries = mbs::run_batch(samples.front()->model, variations, o);
  for (size_t i = 0; i < samples.size(); ++i) {
    samples[i]->summary = summaries[i];
    if (samples[i]->is_over) samples[i]->summary.ending = mbs::Summary::Ending::TimeLimit;
  }
}

bool can_share_lanes(const Sample& a, const Sample& b, const Knowledge& k, const SampleRunOptions& options) {
  const mbs::Options x = make_options(a.plan, k, options), y = make_options(b.plan, k, options);
  return x.duration == y.duration && x.step == y.step && x.frame_interval == y.frame_interval &&
         mbs::is_same_build(a.model, b.model);
}

/// The debris of a slice over the whole length of the building: nothing falls sideways.
void spread(Reach& reach, const product::Plan& plan) {
  reach.side[2] = reach.side[3] = 0;
  if (reach.outline.empty() || plan.frame_offsets.empty()) return;
  double low = reach.outline.front()[0], high = low;
  for (const Point2& p : reach.outline) low = std::min(low, p[0]), high = std::max(high, p[0]);
  const double from = plan.frame_offsets.front(), to = plan.frame_offsets.back();
  reach.outline = {{low, from}, {high, from}, {high, to}, {low, to}};
  reach.area = calc_area(reach.outline);
}

/// What findings tell besides.
void fill_findings(const Sample& s, const std::vector<Mechanism>& verdicts, SampleRun& out) {
  out.volume = find_heap(s.record, s.record.time.size() - 1).volume;
  out.deviation = calc_deviation(out.mechanism, std::atan2(s.map.fall_direction.y, s.map.fall_direction.x));
  for (const product::Neighbour& n : s.plan.neighbours)
    out.clearance.push_back(find_approach(s.record, n.footprint).least);
  if (s.summary.ending != mbs::Summary::Ending::TimeLimit) return;
  for (const OpenPart& part : find_open_parts(s.record, s.map, verdicts, norm(s.model.gravity), s.plan.ground.friction))
    out.way_left = std::max(out.way_left, part.way);
}

void fill(Sample& s, const Knowledge& k, const SampleRunOptions& options, SampleRun& out) {
  using Ending = mbs::Summary::Ending;
  s.recorder->finish();
  if (s.summary.ending == Ending::Cancelled) return;
  out.release = calc_release(s.plan);
  if (s.summary.ending == Ending::NoEquilibrium || s.summary.ending == Ending::Diverged || s.record.time.empty()) {
    out.state = SampleRun::State::Failed;
    out.text = s.summary.ending == Ending::NoEquilibrium
                   ? "no equilibrium was found under dead load before the first charge: " + s.summary.message
                   : s.summary.message;
    return;
  }
  out.state = SampleRun::State::Done;
  const auto series = [&s](const char* id) -> const std::vector<double>& {
    return std::find_if(s.record.series.begin(), s.record.series.end(),
                        [id](const record::Series& x) { return x.id == id; })
        ->value;
  };
  out.time = s.record.time;
  out.tilt = series("tilt_angle");
  const std::vector<Mechanism> verdicts = judge_structures(s.plan, s.model, s.map, k, *s.recorder, s.summary);
  out.mechanism = judge_run(verdicts, s.map, k, *s.recorder);
  out.is_open = may_change(s.plan, out.mechanism);
  const std::vector<StageTimes> stages = find_stage_times(s.map, true);
  const std::vector<bool> counts =
      find_structures_to_stand(s.plan, s.map, stages.empty() ? out.time.back() : stages.back().first);
  const std::vector<BlockFrame> block = s.recorder->farthest_block_frames(counts);
  const size_t before = find_frame(block, stages.empty() ? out.time.back() : stages.back().first);
  // in each pause by what has charges to come; the last one is known
  out.stood = stages.size() < 2 || stands(block[before], k);
  for (size_t i = 1; i + 1 < stages.size() && out.stood; ++i) {
    const double end = stages[i].first;
    const auto then = s.recorder->farthest_block_frames(find_structures_to_stand(s.plan, s.map, end));
    out.stood = stands(then[find_frame(then, end)], k);
  }
  const auto find_use = [&] {
    if (counts.size() < 2) return s.recorder->zone_frames()[before].utilisation;
    return find_zone_frames(s.record, find_zones_of(counts, s.map, s.record))[before].utilisation;
  };
  out.utilisation = out.stood ? find_use() : 1;
  // the one that decides; where none does, the first
  out.touchdown = std::numeric_limits<double>::quiet_NaN();
  for (const Mechanism& m : verdicts)
    if (m.has_touchdown) out.touchdown = std::fmin(out.touchdown, m.time);
  if (std::isnan(out.touchdown)) out.touchdown = s.recorder->first_touchdown();
  const std::vector<double>& kinetic = series("energy_kinetic");
  out.touchdown_energy = kinetic.back();
  for (const Touchdown& t : s.recorder->touchdowns())
    if (t.time == out.touchdown) out.touchdown_energy = t.kinetic;
  out.largest_energy = std::max(*std::max_element(kinetic.begin(), kinetic.end()), out.touchdown_energy);
  const size_t last = out.time.size() - 1;
  out.reach = calc_reach(s.record, last);
  out.height = calc_heap_height(find_moving_boxes(s.record, last));
  if (options.findings && !options.condensation) fill_findings(s, verdicts, out);
  if (options.condensation) {
    spread(out.reach, s.plan);
  } else if (s.plan.vibration) {
    for (const product::Neighbour& n : s.plan.neighbours)
      out.shaking.push_back(find_shaking(*s.plan.vibration, s.record, s.recorder->speeds(), s.model.gravity,
                                         s.model.contact.restitution, n.footprint)
                                .velocity);
  }
}

}  // namespace

size_t count_lanes() { return mbs::kernel::lanes(); }

std::vector<SampleRun> run_samples(std::span<const product::Plan> plans, const Knowledge& k,
                                   const SampleRunOptions& options, const std::atomic<bool>* cancel,
                                   SampleRunTimes* times) {
  std::vector<SampleRun> out(plans.size());
  SampleRunTimes spent;
  const auto is_cancelled = [cancel] { return cancel && cancel->load(std::memory_order_relaxed); };
  const auto fail = [&out](size_t i, const std::exception& e) {
    const auto* input = dynamic_cast<const InputError*>(&e);
    out[i].state = SampleRun::State::Failed;
    out[i].text = input ? input->first_error().message : e.what();
  };
  const auto make = [&](size_t i) -> std::unique_ptr<Sample> {
    const double begin = now();
    std::unique_ptr<Sample> s;
    try {
      s = std::make_unique<Sample>(plans[i], k, options);
    } catch (const std::exception& e) { fail(i, e); }
    spent.models += now() - begin;
    return s;
  };
  const auto finish = [&](size_t i, Sample& s) {
    const double begin = now();
    fill(s, k, options, out[i]);
    spent.outputs += now() - begin + s.in_outputs;
  };
  const auto run_one = [&](size_t i, Sample& s) {
    try {
      run_single(s, k, options, cancel);
    } catch (const std::exception& e) {
      fail(i, e);
      return;
    }
    const double end = now(), first = s.first_frame > 0 ? s.first_frame : end;
    const double stage = s.last_stage > 0 ? s.last_stage : first;
    spent.equilibria += first - s.begun;
    spent.standing += stage - first - s.in_outputs_standing;
    spent.falling += end - stage - (s.in_outputs - s.in_outputs_standing);
    finish(i, s);
  };
  if (!options.lanes) {
    for (size_t i = 0; i < plans.size() && !is_cancelled(); ++i)
      if (const std::unique_ptr<Sample> s = make(i)) run_one(i, *s);
  } else {
    for (size_t first = 0; first < plans.size() && !is_cancelled(); first += count_lanes()) {
      std::vector<std::unique_ptr<Sample>> samples;
      for (size_t i = first; i < std::min(plans.size(), first + count_lanes()); ++i) samples.push_back(make(i));
      std::vector<bool> done(samples.size(), false);
      for (size_t i = 0; i < samples.size(); ++i) {
        if (!samples[i] || done[i]) continue;
        std::vector<Sample*> group;
        std::vector<size_t> members;
        for (size_t j = i; j < samples.size(); ++j) {
          if (!samples[j] || done[j] || !can_share_lanes(*samples[i], *samples[j], k, options)) continue;
          group.push_back(samples[j].get());
          members.push_back(j);
          done[j] = true;
        }
        if (group.size() == 1) {
          run_one(first + i, *samples[i]);
          continue;
        }
        const double begin = now();
        try {
          run_together(group, k, options, cancel);
        } catch (const std::exception& e) {
          for (const size_t j : members) fail(first + j, e);
          continue;
        }
        spent.falling += now() - begin;
        for (const size_t j : members) spent.falling -= samples[j]->in_outputs, finish(first + j, *samples[j]);
      }
    }
  }
  if (times) *times = spent;
  return out;
}

}  // namespace topple::collapse
