// What an archive says of its levels, outcomes and outputs.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>

#include "base/error.h"
#include "uncertainty/alpha.h"
#include "uncertainty/levels.h"

namespace topple::uncertainty {
namespace {

OutputBounds make_empty_bounds(const std::vector<double>& levels) {
  OutputBounds b;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double a : levels) b.levels.push_back({a, {nan, -1, false}, {nan, -1, false}});
  return b;
}

}  // namespace

double calc_miss_probability(const Coverage& c, double v) { return std::pow(1 - v, c.space_points); }

std::string to_text(Ending e) {
  switch (e) {
    case Ending::Complete:
      return "complete";
    case Ending::LimitReached:
      return "limit of evaluations reached";
    case Ending::Cancelled:
      return "cancelled";
    case Ending::NotConverged:
      return "some searches have not converged";
  }
  return {};
}

AlphaResult read_archive(const Space& space, const Archive& archive, const std::vector<double>& given,
                         const std::vector<int>& space_points) {
  const std::vector<double> levels = check_levels(given);
  std::vector<Box> boxes;
  for (const double a : levels) boxes.push_back(make_box(space, a));
  AlphaResult result;
  for (std::size_t k = 0; k < levels.size(); ++k)
    result.coverage.push_back({levels[k], 0, k < space_points.size() ? space_points[k] : 0});
  std::map<int, ClassBounds> classes;
  const auto take = [](Bound& bound, double value, int sample, bool lower) {
    if (bound.sample < 0 || (lower ? value < bound.value : value > bound.value)) bound = {value, sample, false};
  };
  for (int i = 0; i < static_cast<int>(archive.size()); ++i) {
    const Sample& s = archive[i];
    const int depth = count_levels(space, levels, boxes, s.x);
    if (depth == 0) continue;
    ClassBounds& c = classes[outcome_of(s.result)];
    c.outcome = outcome_of(s.result);
    ++c.count;
    if (const double mu = calc_membership(space, s.x); mu > c.possibility || c.sample < 0)
      c.possibility = mu, c.sample = i;
    for (int k = 0; k < depth; ++k) ++result.coverage[k].samples;
    const std::size_t outputs = s.result.values.size();
    if (result.outputs.size() < outputs) result.outputs.assign(outputs, make_empty_bounds(levels));
    if (c.outputs.size() < outputs) c.outputs.assign(outputs, make_empty_bounds(levels));
    for (std::size_t o = 0; o < outputs; ++o)
      for (int k = 0; k < depth; ++k)
        for (auto* bounds : {&result.outputs[o].levels[k], &c.outputs[o].levels[k]}) {
          take(bounds->lower, s.result.values[o], i, true);
          take(bounds->upper, s.result.values[o], i, false);
        }
  }
  for (auto& [outcome, c] : classes) result.classes.push_back(std::move(c));
  result.failed = archive.count_failed();
  return result;
}

FuzzyNumber make_number(const OutputBounds& bounds) {
  std::vector<AlphaCut> cuts;
  for (const auto& level : bounds.levels) {
    if (level.lower.sample < 0) throw InputError("E805", fmt::format("no run gave a value at alpha = {}", level.alpha));
    cuts.push_back({level.alpha, level.lower.value, level.upper.value});
  }
  return FuzzyNumber(std::move(cuts));
}

FuzzyNumber make_number(const AlphaResult& result, int output) {
  if (output < 0 || output >= static_cast<int>(result.outputs.size()))
    throw InputError("E805", fmt::format("there is no output {} among {}", output, result.outputs.size()));
  return make_number(result.outputs[output]);
}

AlphaOptions make_thrifty_options() {
  AlphaOptions o;
  o.starts = 1;
  o.evolutions = 0;
  o.patience = 1;
  o.restarts = 2;
  o.lines = 0;
  o.search_classes = false;
  return o;
}

AlphaResult optimise(const Space& space, Asker& asker, const AlphaOptions& options) {
  return AlphaSearch(space, asker, options).run();
}

AlphaResult optimise(const Space& space, const Evaluate& evaluate, const AlphaOptions& options,
                     const Progress& progress) {
  Asker asker(evaluate, progress, options.earlier, options.limit);
  AlphaResult result = optimise(space, asker, options);
  result.archive = asker.archive();
  return result;
}

AlphaResult optimise(const std::vector<FuzzyNumber>& inputs, const Evaluate& evaluate, const AlphaOptions& options,
                     const Progress& progress) {
  return optimise(Space{inputs, {}, {}}, evaluate, options, progress);
}

}  // namespace topple::uncertainty
