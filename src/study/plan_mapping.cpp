#include "study/plan_mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <set>

#include "base/heap.h"
#include "base/interpolate.h"
#include "base/parallel.h"
#include "base/unit.h"
#include "collapse/plan_record.h"
#include "collapse/sample_runs.h"
#include "product/plan_sampler.h"
#include "study/tie.h"

namespace topple::study {

namespace {

using uncertainty::Point;
using uncertainty::Result;

/// CPU time of this thread [s].
double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// It left its place before its last stage, which stays so.
bool is_early(const collapse::SampleRun& r, bool is_early_bad) { return !r.stood && is_early_bad; }

int find_outcome(const collapse::SampleRun& r, bool is_early_bad) {
  const std::vector<std::string>& names = plan_outcomes();
  const std::string& name = is_early(r, is_early_bad) ? names.back() : r.mechanism.name;
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

struct LateCharge {
  std::size_t stage = 0;
  double after = 0;  // the last stage [s]
};
/// A charge that fires when the runs of a study have ended.
std::optional<LateCharge> find_late_charge(const product::Plan& sample, double end) {
  const double release = sample.stages.empty() ? 0 : sample.stages.back().time;
  for (std::size_t i = 0; i < sample.stages.size(); ++i)
    for (const product::Charge& c : sample.stages[i].charges)
      if (const double late = sample.stages[i].time + c.delay - release; !c.fails && late >= end)
        return LateCharge{i, late};
  return std::nullopt;
}
std::string tell_late_charge(const LateCharge& late, const std::string& with, double end) {
  return fmt::format(
      "a charge of stage {} fires {:g} s after the last stage{}, when the runs of a study have ended ({:g} s)",
      late.stage + 1, late.after, with, end);
}

}  // namespace

const std::vector<std::string>& plan_outcomes() {
  static const std::vector<std::string> names{"topple", "vertical",    "partial",         "aborted", "stands",
                                              "fold",   "progressive", "wrong direction", "early"};
  return names;
}

double find_after(const product::Plan& plan) {
  if (plan.fuzzy.search.after > 0) return plan.fuzzy.search.after;
  return plan.analysis.duration - (plan.stages.empty() ? 0 : plan.stages.back().time);
}

bool has_screening(const product::Plan& plan, const PlanMappingOptions& o) {
  return o.vibration && !o.condensed && collapse::has_screening(plan);
}

bool has_sides(const PlanMappingOptions& o) { return o.sideways && !o.condensed; }

bool has_clearances(const PlanMappingOptions& o) { return o.findings && has_sides(o); }

namespace {

/// "workshop" of "Workshop", with a number where that is not unique; no two are alike.
std::string name_of_neighbour(const product::Plan& plan, size_t neighbour) {
  const auto slug = [&plan](size_t i) {
    std::string out;
    for (const char c : plan.neighbours[i].name) {
      const bool is_plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
      if (is_plain || (c >= 'A' && c <= 'Z'))
        out += is_plain ? c : static_cast<char>(c - 'A' + 'a');
      else if (!out.empty() && out.back() != '_')
        out += '_';
    }
    while (!out.empty() && out.back() == '_') out.pop_back();
    return out;
  };
  std::vector<std::string> names;
  std::map<std::string, int> counts;
  for (size_t i = 0; i < plan.neighbours.size(); ++i) ++counts[names.emplace_back(slug(i))];
  // one that has its name alone keeps it, and nobody else gets it
  std::set<std::string> taken;
  const auto is_alone = [&](size_t i) { return !names[i].empty() && counts[names[i]] == 1; };
  for (size_t i = 0; i < names.size(); ++i)
    if (is_alone(i)) taken.insert(names[i]);
  for (size_t i = 0; i <= neighbour; ++i) {
    if (is_alone(i)) continue;
    const std::string own = names[i];
    size_t number = i + 1;
    do {
      names[i] = fmt::format("{}{}{}", own, own.empty() ? "" : "_", number);
      number += plan.neighbours.size();
    } while (!taken.insert(names[i]).second);
  }
  return names[neighbour];
}

}  // namespace

std::string name_of_clearance(const product::Plan& plan, size_t neighbour) {
  return "clearance_" + name_of_neighbour(plan, neighbour);
}

std::string name_of_screening(const product::Plan& plan, size_t neighbour) {
  return "vibration_" + name_of_neighbour(plan, neighbour);
}

struct PlanMapping::Impl {
  product::PlanSampler sampler;
  collapse::Knowledge knowledge;
  PlanMappingOptions options;
  uncertainty::Space space;
  std::vector<PlanQuantity> inputs, outputs;
  std::vector<double> trajectory_times;
  collapse::Condensation condensation;
  collapse::KnownCurves known;
  double vibration_factor = 0;  // of the band's upper end; 0: no screening
  bool has_direction = false;   // the plan has an azimuth of fall
  bool is_early_bad = false;    // the plan asks the building to stand between its stages

  collapse::SampleRunOptions run_options() const {
    collapse::SampleRunOptions o;
    o.after = options.after, o.frame_rate = options.frame_rate, o.lanes = options.lanes;
    if (options.condensed) o.condensation = &condensation, o.known = &known;
    if (!options.passes_quiet) o.pass_speed = 0;
    o.step_share = options.step_share, o.full_law = options.full_law;
    o.ends_early = is_early_bad;
    o.findings = has_clearances(options);
    return o;
  }
  Result to_result(const collapse::SampleRun&) const;
  void evaluate_chunk(std::span<const Point>, std::span<Result>, const std::atomic<bool>* cancel,
                      PlanMappingTimes& spent) const;
};

void PlanMapping::check_firing(const product::Plan& plan, const Impl& impl) {
  const auto check = [&](const product::Plan& sample, const std::string& with, const SourcePosition& where) {
    if (const auto late = find_late_charge(sample, impl.options.after))
      throw InputError({{Severity::Error, "E407", where, 1, tell_late_charge(*late, with, impl.options.after),
                         plan.fuzzy.search.after > 0 ? "raise after in [fuzzy.search], or leave it out"
                                                     : "raise duration in [analysis]"}});
  };
  check(plan, "", {plan.path, 0, 0});
  // no sample fires at other times than the plan does
  const auto is_of_a_stage = [](const product::DocumentPath& p) { return !p.empty() && p.front().key == "stage"; };
  if (std::none_of(plan.fuzzy.places.begin(), plan.fuzzy.places.end(),
                   [&](const auto& places) { return std::any_of(places.begin(), places.end(), is_of_a_stage); }))
    return;
  const std::vector<double> centre = product::calc_centre(plan.fuzzy);
  const std::vector<product::FuzzyValue>& inputs = plan.fuzzy.inputs;
  const auto try_point = [&](const std::vector<double>& point, const std::string& with, const SourcePosition& where) {
    if (!product::is_possible(plan.fuzzy, point)) return;
    try {
      check(product::make_sample(impl.sampler, point), with, where);
    } catch (const InputError& e) {
      if (e.first_error().code == "E407") throw;  // anything else is a failed run
    }
  };
  // the ends of each value, and of each two
  const auto ends = [&](size_t i) {
    return std::array{inputs[i].corners.front().first, inputs[i].corners.back().first};
  };
  const auto with = [&](size_t i, double end) { return product::text_of(inputs[i], end); };
  for (size_t i = 0; i < centre.size(); ++i)
    for (const double end : ends(i)) {
      std::vector<double> point = centre;
      point[i] = end;
      try_point(point, " with " + with(i, end), inputs[i].where);
    }
  for (size_t i = 0; i < centre.size(); ++i)
    for (size_t j = i + 1; j < centre.size(); ++j)
      for (const double end : ends(i))
        for (const double other : ends(j)) {
          std::vector<double> point = centre;
          point[i] = end, point[j] = other;
          try_point(point, fmt::format(" with {} and {}", with(i, end), with(j, other)), inputs[i].where);
        }
}

PlanMapping::PlanMapping(const product::Plan& plan, const collapse::Knowledge& k, PlanMappingOptions options) {
  keep_freed_memory();  // a sample takes and gives back some 20 MB
  if (plan.fuzzy.inputs.empty())
    throw InputError("E201", plan.path + ": the plan has no fuzzy values", "add a table [fuzzy] (docs/plan.md)");
  if (options.after == 0) options.after = find_after(plan);
  if (!(options.after > 0) || !(options.tilt_interval > 0) || !std::isfinite(options.after))
    throw InputError("E205", "the time after the last stage and its interval must be above 0");
  if (options.directions < 3 || options.directions > 3600)
    throw InputError("E205", fmt::format("{} directions of the debris outline: 3 to 3600", options.directions));
  std::erase_if(options.tilt_times, [&](double t) { return t > options.after; });
  auto impl =
      std::make_unique<Impl>(Impl{product::make_sampler(plan), k, options, {}, {}, {}, {}, {}, {}, 0, false, false});
  impl->has_direction = plan.criteria.azimuth.has_value();
  impl->is_early_bad = plan.criteria.stands_between_stages.value_or(false);
  for (const product::FuzzyValue& v : plan.fuzzy.inputs) {
    impl->inputs.push_back({v.path, v.symbol, v.unit});
    impl->space.inputs.push_back(uncertainty::make_polygonal(v.corners));
  }
  if (!plan.fuzzy.interaction.is_empty())
    tie(impl->space, plan.fuzzy.interaction,
        [fuzzy = plan.fuzzy](const Point& x) { return product::calc_interacting(fuzzy, x); });
  uncertainty::check_space(impl->space);
  check_firing(plan, *impl);
  for (const double t : options.tilt_times) impl->outputs.push_back({fmt::format("tilt_{:g}", t), "deg", unit::deg});
  for (const PlanQuantity& q : std::vector<PlanQuantity>{{"touchdown", "s", 1},
                                                         {"tilt_touchdown", "deg", unit::deg},
                                                         {"touchdown_energy", "MJ", 1e6},
                                                         {"largest_energy", "MJ", 1e6},
                                                         {"reach_neg_x", "m", 1},
                                                         {"reach_pos_x", "m", 1},
                                                         {"reach_neg_y", "m", 1},
                                                         {"reach_pos_y", "m", 1},
                                                         {"reach_mass_95", "m", 1},
                                                         {"rear_share", "%", 0.01},
                                                         {"utilisation", "%", 0.01}})
    if (has_sides(options) || (q.name != "reach_neg_y" && q.name != "reach_pos_y")) impl->outputs.push_back(q);
  if (options.class_open) impl->outputs.push_back({kClassOpen, "", 1, false});
  if (options.findings) impl->outputs.push_back({"heap_height", "m", 1, false});
  if (has_clearances(options)) {
    impl->outputs.push_back({"heap_volume", "m3", 1, false});
    impl->outputs.push_back({"debris_reach", "m", 1, false});
    for (size_t n = 0; n < plan.neighbours.size(); ++n)
      impl->outputs.push_back({name_of_clearance(plan, n), "m", 1, false});
    if (impl->has_direction) impl->outputs.push_back({"azimuth_deviation", "deg", unit::deg, false});
    impl->outputs.push_back({"way_left", "m", 1, false});
  }
  if (has_screening(plan, options)) {
    impl->vibration_factor = plan.vibration->factor;
    for (size_t n = 0; n < plan.neighbours.size(); ++n)
      impl->outputs.push_back({name_of_screening(plan, n), "mm/s", unit::mm});
  }
  if (options.condensed) {
    // values that a frame does not share with those like it show at a point off the middle
    std::vector<double> off;
    for (const uncertainty::FuzzyNumber& x : impl->space.inputs) {
      const auto support = x.cut(0);
      off.push_back(support.left +
                    (0.37 + 0.01 * static_cast<double>(off.size() % 20)) * (support.right - support.left));
    }
    // nearer to the middle where it is no plan
    const std::vector<double> centre = product::calc_centre(plan.fuzzy);
    std::optional<product::Plan> sample;
    constexpr int most = 20;
    for (int tries = 0; tries < most && !sample; ++tries) {
      try {
        // it need not be possible: constraints may leave no point off the middle
        sample = product::make_sample(impl->sampler, off);
      } catch (const InputError&) {
        // below
      }
      for (size_t i = 0; i < off.size(); ++i) off[i] = 0.5 * (off[i] + centre[i]);
    }
    if (!sample)
      throw InputError("E206", "the plan cannot be condensed: no values beside the core are a plan",
                       "run the study without --condensed");
    const product::Plan* both[] = {&plan, &*sample};
    impl->condensation = collapse::find_like_frames(both, k);
    if (!impl->condensation.refusal.empty())
      throw InputError("E206", "the plan cannot be condensed: " + impl->condensation.refusal,
                       "run the study without --condensed");
    impl->known = collapse::make_known_curves(plan, k, impl->condensation);
  }
  const int steps = static_cast<int>(std::floor(options.after / options.tilt_interval + 1e-9));
  for (int i = 0; i <= steps; ++i) impl->trajectory_times.push_back(i * options.tilt_interval);
  impl_ = std::move(impl);
}

PlanMapping::~PlanMapping() = default;
PlanMapping::PlanMapping(PlanMapping&&) noexcept = default;

const uncertainty::Space& PlanMapping::space() const { return impl_->space; }
const std::vector<PlanQuantity>& PlanMapping::inputs() const { return impl_->inputs; }
const std::vector<PlanQuantity>& PlanMapping::outputs() const { return impl_->outputs; }
const std::vector<double>& PlanMapping::trajectory_times() const { return impl_->trajectory_times; }

Result PlanMapping::Impl::to_result(const collapse::SampleRun& r) const {
  using State = collapse::SampleRun::State;
  Result out;
  if (r.state == State::Cancelled) return out;
  out.state = r.state == State::Done ? Result::State::Done : Result::State::Failed;
  out.text = r.text;
  if (r.state == State::Failed) return out;
  out.outcome = find_outcome(r, is_early_bad);
  for (const double t : options.tilt_times) out.values.push_back(interpolate(r.time, r.tilt, r.release + t));
  const bool touched = r.touchdown <= r.release + options.after;
  for (const double x : {touched ? r.touchdown - r.release : options.after,
                         interpolate(r.time, r.tilt, touched ? r.touchdown : r.time.back()), r.touchdown_energy,
                         r.largest_energy, r.reach.side[0], r.reach.side[1]})
    out.values.push_back(x);
  if (has_sides(options)) out.values.insert(out.values.end(), {r.reach.side[2], r.reach.side[3]});
  out.values.insert(out.values.end(), {r.reach.most_mass, r.mechanism.rear_share, r.utilisation});
  if (options.class_open) out.values.push_back(r.is_open && !is_early(r, is_early_bad) ? 1 : 0);
  if (options.findings) out.values.push_back(r.height);
  if (has_clearances(options)) {
    out.values.insert(out.values.end(), {r.volume, r.reach.largest});
    out.values.insert(out.values.end(), r.clearance.begin(), r.clearance.end());
    // neither towards the planned direction nor against it
    if (has_direction) out.values.push_back(std::isnan(r.deviation) ? std::numbers::pi / 2 : r.deviation);
    out.values.push_back(std::min(r.way_left, kUnlimited));
  }
  if (vibration_factor > 0)
    for (const double v : r.shaking) out.values.push_back(vibration_factor * v);
  for (const double t : trajectory_times) out.trajectory.push_back(interpolate(r.time, r.tilt, r.release + t));
  for (int k = 0; k < options.directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / options.directions;
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Point2& p : r.reach.outline)
      farthest = std::max(farthest, p[0] * std::cos(angle) + p[1] * std::sin(angle));
    out.trajectory.push_back(std::isfinite(farthest) ? farthest : std::nan(""));
  }
  const bool is_finite = std::all_of(out.values.begin(), out.values.end(), [](double x) { return std::isfinite(x); });
  if (!is_finite) {
    out.state = Result::State::Failed;
    out.values.clear(), out.trajectory.clear();
    out.text = "a result is not a finite number";
  }
  return out;
}

void PlanMapping::Impl::evaluate_chunk(std::span<const Point> points, std::span<Result> out,
                                       const std::atomic<bool>* cancel, PlanMappingTimes& spent) const {
  std::vector<product::Plan> plans;
  std::vector<size_t> index;
  const double begin = now();
  for (size_t i = 0; i < points.size(); ++i) {
    out[i] = {};
    try {
      product::Plan sample = product::make_sample(sampler, points[i]);
      if (const auto late = find_late_charge(sample, options.after)) {
        out[i].state = Result::State::Failed;
        out[i].text = tell_late_charge(*late, "", options.after);
        continue;
      }
      plans.push_back(std::move(sample));
      index.push_back(i);
    } catch (const InputError& e) {
      out[i].state = Result::State::Failed;
      out[i].text = e.first_error().message;
    }
  }
  spent.plans += now() - begin;
  collapse::SampleRunTimes times;
  const std::vector<collapse::SampleRun> runs = collapse::run_samples(plans, knowledge, run_options(), cancel, &times);
  for (size_t i = 0; i < runs.size(); ++i) out[index[i]] = to_result(runs[i]);
  spent.models += times.models, spent.equilibria += times.equilibria, spent.standing += times.standing;
  spent.falling += times.falling, spent.outputs += times.outputs;
}

void PlanMapping::evaluate(std::span<const Point> batch, std::span<Result> out, const std::atomic<bool>* cancel,
                           PlanMappingTimes* times) const {
  const size_t W = impl_->options.lanes ? collapse::count_lanes() : 1;
  const size_t chunks = (batch.size() + W - 1) / W;
  for (Result& r : out) r = {};
  std::mutex mutex;
  PlanMappingTimes sum;
  // a chunk that was not begun stays NotRun
  (void)parallel_for(
      chunks, impl_->options.threads,
      [&](size_t c) {
        PlanMappingTimes spent;
        const size_t first = c * W, count = std::min(W, batch.size() - first);
        impl_->evaluate_chunk(batch.subspan(first, count), out.subspan(first, count), cancel, spent);
        const std::lock_guard<std::mutex> lock(mutex);
        sum.plans += spent.plans, sum.models += spent.models, sum.equilibria += spent.equilibria;
        sum.standing += spent.standing, sum.falling += spent.falling, sum.outputs += spent.outputs;
      },
      cancel);
  if (times) *times = sum;
}

}  // namespace topple::study
