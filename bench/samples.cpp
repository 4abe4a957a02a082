/// Samples of the storehouse's fuzzy plan, from the plan's values to numbers, one by one in lanes, and condensed.

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "base/error.h"
#include "study/plan_mapping.h"

namespace topple::bench {
namespace {

constexpr int kSamples = 8;

/// argument: 0 whole, one by one; 1 whole, in lanes; 2 condensed; 3 condensed, in lanes. Counters are seconds of the
/// processor a sample, and the ratio to whole samples one by one right before.
void storehouse_samples(benchmark::State& state) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::Plan plan = product::read_plan_file(TOPPLE_EXAMPLES "/weida/plan-fuzzy.toml", warnings, text);
  study::PlanMappingOptions options;
  options.lanes = state.range(0) % 2 != 0;
  options.condensed = state.range(0) >= 2;
  const study::PlanMapping mapping(plan, collapse::default_knowledge(), options);
  const uncertainty::Box support = uncertainty::make_box(mapping.space(), 0);
  std::vector<uncertainty::Point> points;
  for (const uncertainty::Point& p : uncertainty::make_sobol_points(mapping.space().size(), 0, kSamples, 1))
    points.push_back(uncertainty::place_in(support, p));
  std::vector<uncertainty::Result> results(points.size());
  study::PlanMappingTimes t;
  for (auto _ : state) mapping.evaluate(points, results, nullptr, &t);
  const double all = t.plans + t.models + t.equilibria + t.standing + t.falling + t.outputs;
  static double singly = 0;
  if (state.range(0) == 0) singly = all;
  if (singly > 0) state.counters["times_cheaper"] = singly / all;
  const auto each = [&state](const char* name, double seconds) { state.counters[name] = seconds / kSamples; };
  each("sample", all);
  each("plans", t.plans), each("models", t.models), each("equilibria", t.equilibria);
  each("standing", t.standing), each("falling", t.falling), each("outputs", t.outputs);
}
BENCHMARK(storehouse_samples)->DenseRange(0, 3)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace topple::bench
