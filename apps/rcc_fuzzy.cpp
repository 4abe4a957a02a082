#include "rcc_fuzzy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "base/unit.h"
#include "nearfield/family.h"
#include "nearfield/moment_curve.h"
#include "nearfield/rcc.h"
#include "rcc_report.h"
#include "study/tie.h"
#include "uncertainty/alpha.h"
#include "uncertainty/fan.h"
#include "uncertainty/possibility.h"

namespace topple::apps {

namespace {

using nearfield::Axis;
using uncertainty::Result;

/// Outcome classes of a run.
enum Outcome { Carries, LosesForce, LosesMoment, NotCarried };
std::string words_of(int outcome, double N) {
  constexpr const char* words[] = {"carries the force and resists", "loses the force while it is turned",
                                   "loses its moment while it is turned"};
  if (outcome != NotCarried) return words[outcome];
  return N > 0 ? "torn by the force alone" : "crushed by the force alone";
}

nearfield::ZoneInput to_zone(const product::SectionFile& f) {
  nearfield::ZoneInput in;
  in.section = f.section, in.concrete = f.concrete, in.steel = f.steel, in.length = f.length;
  in.cut_bars = f.cut_bars, in.cut_concrete = f.cut_concrete;
  in.concrete_loss = f.concrete_loss, in.cover_lost = f.cover_lost;
  // what is stiffly strong cannot soften over the whole length; other runs keep it, as the crisp curve does
  const double longest = nearfield::calc_largest_zone_length(in.concrete);
  if (!(in.length < longest)) in.length = nearfield::kLongestZoneShare * longest;
  return in;
}

/// Rotations common to all runs: rising by ratios up to a tenth of the whole, then evenly.
std::vector<double> make_grid(double last) {
  std::vector<double> out{0};
  constexpr int fine = 30, even = 90;
  const double first = 1e-3 * last, knee = 0.1 * last;
  for (int i = 0; i < fine; ++i) out.push_back(first * std::pow(knee / first, static_cast<double>(i) / fine));
  for (int i = 0; i <= even; ++i) out.push_back(knee + (last - knee) * i / even);
  return out;
}

struct Model {
  const product::SectionFile& section;
  const product::FuzzyFile& file;
  const FuzzyTask& task;
  const std::atomic<bool>& cancel;

  /// Runs `one` for every point of a batch; what a section cannot be counts as failed.
  uncertainty::Evaluate make(std::function<Result(const nearfield::ZoneInput&)> one) const {
    return [this, one = std::move(one)](std::span<const uncertainty::Point> batch, std::span<Result> out) {
      const bool finished = parallel_for(
          batch.size(), task.threads,
          [&](size_t i) {
            try {
              out[i] = one(to_zone(product::make_sample(section, file, batch[i])));
            } catch (const InputError& e) {
              out[i].state = Result::State::Failed;
              out[i].text = e.first_error().message;
            }
          },
          &cancel);
      (void)finished;  // points left out stay "not run"
    };
  }
};

uncertainty::Space make_space(const product::FuzzyFile& f) {
  uncertainty::Space space;
  for (const product::FuzzyValue& v : f.inputs) space.inputs.push_back(uncertainty::make_polygonal(v.corners));
  study::tie(space, f.interaction, [f](const uncertainty::Point& x) { return product::calc_interacting(f, x); });
  return space;
}

/// Degree to which the fuzzy number is not larger than x, from its cuts.
double calc_possibility_below(const std::vector<record::RccInterval>& cuts, double x) {
  if (x >= cuts.back().left) return 1;
  if (x < cuts.front().left) return 0;
  for (size_t i = 1; i < cuts.size(); ++i) {
    if (x > cuts[i].left) continue;
    const double width = cuts[i].left - cuts[i - 1].left;
    const double s = width > 0 ? (x - cuts[i - 1].left) / width : 1;
    return cuts[i - 1].alpha + s * (cuts[i].alpha - cuts[i - 1].alpha);
  }
  return 1;
}

std::vector<record::RccInterval> to_cuts(const uncertainty::OutputBounds& bounds) {
  std::vector<record::RccInterval> out;
  for (const uncertainty::LevelBounds& l : bounds.levels) out.push_back({l.alpha, l.lower.value, l.upper.value});
  return out;
}

/// Runs to be drawn: those that hold a bound, and the first ones that fill the space.
void choose_drawn(const uncertainty::AlphaResult& result, record::RccFan& fan) {
  constexpr size_t most = 60, spread = 24;
  std::vector<int> chosen{fan.core};
  for (const uncertainty::OutputBounds& output : result.outputs)
    for (const uncertainty::LevelBounds& level : output.levels)
      for (const int sample : {level.lower.sample, level.upper.sample})
        if (sample >= 0 && chosen.size() < most && std::find(chosen.begin(), chosen.end(), sample) == chosen.end())
          chosen.push_back(sample);
  const size_t stride = 1 + fan.originals.size() / spread;
  for (size_t i = 0; i < fan.originals.size(); i += stride) chosen.push_back(static_cast<int>(i));
  for (const int sample : chosen) {
    record::RccOriginal& o = fan.originals[static_cast<size_t>(sample)];
    o.is_drawn = !o.moment.empty();
  }
}

record::RccFan make_fan(const product::FuzzyFile& file, const uncertainty::Space& space,
                        const uncertainty::Archive& archive, const std::vector<double>& levels,
                        const uncertainty::PossibilityResult& possibilities, double N,
                        const std::vector<double>& rotation, const std::vector<size_t>& searched) {
  record::RccFan fan;
  fan.normal_force = -N;
  fan.rotation = rotation;
  const uncertainty::AlphaResult result = uncertainty::read_archive(space, archive, levels);
  for (size_t i = 0; i < archive.size(); ++i) {
    const uncertainty::Sample& s = archive.samples()[i];
    record::RccOriginal o;
    o.sample = static_cast<int>(i);
    o.membership = uncertainty::calc_membership(space, s.x);
    o.values = s.x;
    const std::vector<double> derived = product::calc_derived(file, s.x);
    o.values.insert(o.values.end(), derived.begin(), derived.end());
    if (s.result.state == Result::State::Done) {
      o.outcome = words_of(s.result.outcome, N);
      o.peak = s.result.values[0];
      o.moment = s.result.trajectory;
    } else {
      o.outcome = "failed";
      ++fan.failed;
      if (fan.failure.empty()) fan.failure = s.result.text;
    }
    fan.originals.push_back(std::move(o));
  }
  fan.core = std::max(0, archive.find(uncertainty::calc_centre(space)));
  for (uncertainty::FanLevel& l : uncertainty::calc_fan(space, archive, levels))
    fan.levels.push_back({l.alpha, std::move(l.lower), std::move(l.upper)});
  fan.ordinates.push_back({"largest moment", -1, to_cuts(result.outputs[0])});
  for (size_t k = 0; k < searched.size(); ++k) {
    const double phi = rotation[searched[k]];
    fan.ordinates.push_back({fmt::format("M at {:.3g} mrad", phi / 1e-3), phi, to_cuts(result.outputs[k + 1])});
  }
  for (int outcome = 0; outcome < 4; ++outcome) {
    record::RccOutcome o{words_of(outcome, N), 0, 0, -1};
    for (const uncertainty::ClassBounds& c : result.classes)
      if (c.outcome == outcome) o.count = c.count;
    for (const uncertainty::Possibility& p : possibilities.classes)
      if (p.outcome == outcome) o.possibility = p.possibility, o.sample = p.sample;
    fan.outcomes.push_back(std::move(o));
  }
  choose_drawn(result, fan);
  return fan;
}

}  // namespace

std::optional<record::RccFuzzyReport> make_fuzzy_report(const product::SectionFile& section,
                                                        const product::FuzzyFile& file, const FuzzyTask& task,
                                                        const std::atomic<bool>& cancel,
                                                        const std::function<void(const std::string&)>& say) {
  const uncertainty::Space space = make_space(file);
  const Model model{section, file, task, cancel};
  const Axis axis = task.axis == 'z' ? Axis::Z : Axis::Y;
  const int side = axis == Axis::Y ? task.direction : -task.direction;
  Progress progress;
  progress.cancel = &cancel;
  uncertainty::AlphaOptions options;
  if (!file.levels.empty()) options.levels = file.levels;
  constexpr int most_runs = 100000;
  options.limit = file.limit > 0 ? file.limit : most_runs;
  options.seed = file.seed;
  const auto watched = [&](const std::string& what) {
    return [&say, what](const uncertainty::AlphaResult&, const uncertainty::Archive& archive) {
      say(fmt::format("{}: {} runs", what, archive.size()));
    };
  };

  record::RccFuzzyReport r;
  r.axis = task.axis, r.direction = task.direction, r.seed = file.seed;
  for (const product::FuzzyValue& v : file.inputs)
    r.inputs.push_back({v.path, v.name, v.symbol, v.unit, v.corners, {}});
  for (const product::DerivedValue& d : file.derived)
    r.inputs.push_back({d.path, d.name, d.symbol, d.unit, {}, d.text});
  for (const product::Constraint& c : file.interaction.constraints) r.constraints.push_back(c.text);
  r.joint = file.interaction.joint_text;

  // the force that crushes it; a smooth function, so more levels cost little
  uncertainty::AlphaOptions crushing = options;
  crushing.levels.clear();
  constexpr int crushing_levels = 20;
  for (int i = 0; i <= crushing_levels; ++i) crushing.levels.push_back(static_cast<double>(i) / crushing_levels);
  const bool is_pulled =
      std::any_of(task.normal_forces.begin(), task.normal_forces.end(), [](double N) { return N > 0; });
  crushing.watch = watched(is_pulled ? "crushing and tearing force" : "crushing force");
  const uncertainty::AlphaResult crush =
      uncertainty::optimise(space, model.make([axis, is_pulled](const nearfield::ZoneInput& in) {
        Result out;
        const nearfield::Fibres fibres = nearfield::make_fibres(in, axis);
        out.values = {nearfield::find_crushing(fibres).force};
        double area = 0;
        for (size_t i = 0; i < fibres.at.size(); ++i) area += fibres.core_area[i] + fibres.cover_area[i];
        if (is_pulled) out.values.push_back(nearfield::calc_rupture_force(in, area, fibres.cover, out.values.front()));
        out.state = Result::State::Done;
        return out;
      }),
                            crushing, progress);
  if (crush.ending == uncertainty::Ending::Cancelled) return std::nullopt;
  r.crushing = to_cuts(crush.outputs[0]);
  if (is_pulled) r.tearing = to_cuts(crush.outputs[1]);

  const nearfield::ZoneInput core = to_zone(product::make_sample(section, file, uncertainty::calc_centre(space)));
  const nearfield::Rcc rcc = nearfield::make_rcc(core);
  const nearfield::MomentFamily& family =
      axis == Axis::Y ? (task.direction > 0 ? rcc.y_pos : rcc.y_neg) : (task.direction > 0 ? rcc.z_pos : rcc.z_neg);
  const nearfield::Fibres core_fibres = nearfield::make_fibres(core, axis);
  for (const double N : task.normal_forces) {
    const nearfield::CurvePoints points = nearfield::find_points(nearfield::make_moment_curve(
        core_fibres, axis, N, task.direction, core.length, nearfield::refine_rotations(family, 4)));
    // as far as the core's residual; a force that crushes the core itself is shown up to its yield of bending alone
    const bool has_end = std::isfinite(points.ultimate.rotation);
    double last =
        has_end ? 2 * points.ultimate.rotation
                : 10 * core.steel.fy / core.steel.Es * core.length / std::min(core.section.width, core.section.height);
    std::string window = has_end ? "twice the ultimate rotation of the core" : "the core has no curve";
    if (last > family.rotation.back()) last = family.rotation.back(), window = "as far as families go";
    const std::vector<double> rotation = make_grid(last);
    std::vector<size_t> searched;
    for (const double share : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0})
      searched.push_back(static_cast<size_t>(
          std::lower_bound(rotation.begin(), rotation.end(), share * last * (1 - 1e-9)) - rotation.begin()));
    options.watch = watched(fmt::format("N = {:.4g} MN", -N / unit::MN));
    uncertainty::Asker asker(model.make([&](const nearfield::ZoneInput& in) {
      const nearfield::Fibres fibres = nearfield::make_fibres(in, axis);
      std::vector<double> kappa(rotation);
      for (double& k : kappa) k /= in.length;
      const nearfield::March march = nearfield::march_curvature(fibres, N, side, kappa);
      Result out;
      out.state = Result::State::Done;
      out.trajectory = march.moment;
      out.values.push_back(*std::max_element(march.moment.begin(), march.moment.end()));
      for (const size_t j : searched) out.values.push_back(march.moment[j]);
      out.outcome = march.last < 0                                               ? NotCarried
                    : static_cast<size_t>(march.last) + 1 < kappa.size()         ? LosesForce
                    : !(march.moment.back() > kNothingLeft * out.values.front()) ? LosesMoment
                                                                                 : Carries;
      return out;
    }),
                             progress, nullptr, options.limit);
    const uncertainty::AlphaResult searched_for = uncertainty::optimise(space, asker, options);
    const uncertainty::PossibilityResult possibilities =
        uncertainty::find_possibilities(space, asker, {1e-4, 30, options.seed});
    if (asker.is_cancelled()) return std::nullopt;
    std::vector<double> levels;
    for (const uncertainty::Coverage& c : searched_for.coverage) levels.push_back(c.alpha);
    record::RccFan fan = make_fan(file, space, asker.archive(), levels, possibilities, N, rotation, searched);
    fan.ending = searched_for.ending == uncertainty::Ending::LimitReached ||
                         possibilities.ending == uncertainty::Ending::LimitReached
                     ? "The search ended at its limit of runs; bounds may lie inside of the true ones."
                 : searched_for.ending == uncertainty::Ending::NotConverged
                     ? "Some searches have not converged; bounds may lie inside of the true ones."
                     : "The search found nothing better.";
    fan.crushing_possibility = calc_possibility_below(r.crushing, -N);
    if (N > 0) fan.tearing_possibility = calc_possibility_below(r.tearing, N);
    double& alone = fan.outcomes[NotCarried].possibility;
    alone = std::max({alone, fan.crushing_possibility, fan.tearing_possibility});
    fan.window = window;
    r.fans.push_back(std::move(fan));
  }
  // shortest zone of all runs
  double shortest = section.length;
  size_t shortened = 0, runs = 0;
  for (const record::RccFan& fan : r.fans)
    for (const record::RccOriginal& o : fan.originals) {
      ++runs;
      if (o.outcome == "failed") continue;
      const std::vector<double> point(o.values.begin(),
                                      o.values.begin() + static_cast<std::ptrdiff_t>(space.inputs.size()));
      const product::SectionFile sample = product::make_sample(section, file, point);
      const double length = to_zone(sample).length;
      shortened += length < sample.length;
      shortest = std::min(shortest, length);
    }
  if (shortened > 0)
    r.notes.push_back(fmt::format(
        "In {} of {} runs, and in no other, the zone is shorter than given, down to {:.3g} m: strong concrete of a low "
        "modulus would give back more than its crushing or fracture energy over the whole length.",
        shortened, runs, shortest));
  return r;
}

}  // namespace topple::apps
