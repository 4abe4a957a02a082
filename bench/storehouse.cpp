/// The storehouse of examples/weida: building the model, its equilibrium, and the 1.7 s after the second stage.

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "collapse/manager.h"
#include "cpu_time.h"
#include "mbs/solver.h"
#include "product/plan.h"

namespace topple::bench {
namespace {

constexpr double kStage = 4, kDuration = 1.7;  // second stage, and how long the paper follows it [s]

product::Plan read_storehouse() {
  std::vector<Diagnostic> warnings;
  std::string text;
  return product::read_plan_file(TOPPLE_EXAMPLES "/weida/plan.toml", warnings, text);
}

void storehouse_model(benchmark::State& state) {
  const product::Plan plan = read_storehouse();
  const collapse::Knowledge& knowledge = collapse::default_knowledge();
  mbs::Model model;
  for (auto _ : state) {
    collapse::ModelMap map;
    model = collapse::make_model(plan, knowledge, map, 1);
  }
  state.counters["bodies"] = static_cast<double>(model.bodies.size());
  state.counters["joints"] = static_cast<double>(model.joints.size());
  state.counters["elements"] = static_cast<double>(model.elements.size() + model.rotational_elements.size());
}
BENCHMARK(storehouse_model)->Unit(benchmark::kMillisecond);

void storehouse_equilibrium(benchmark::State& state) {
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(read_storehouse(), collapse::default_knowledge(), map, 1);
  mbs::Summary summary;
  mbs::Options options;
  options.duration = 0;
  for (auto _ : state) summary = mbs::run(model, options);
  if (summary.ending == mbs::Summary::Ending::NoEquilibrium) return state.SkipWithError(summary.message.c_str());
  state.counters["iterations"] = summary.equilibrium_iterations;
}
BENCHMARK(storehouse_equilibrium)->Unit(benchmark::kMillisecond);

/// Time is taken between two frames of one run from the start.
void storehouse(benchmark::State& state) {
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(read_storehouse(), collapse::default_knowledge(), map, 1);
  mbs::Options options;
  options.duration = kStage + kDuration;
  options.frame_interval = 0.1;  // both instants are frames; seldom, so that frames cost nothing
  double begin = 0, total = 0;
  bool begun = false;
  options.on_frame = [&](const mbs::View& v) {
    if (begun || v.time < kStage - 1e-3) return;
    begun = true;
    begin = cpu_time();
  };
  mbs::Summary summary;
  int broken = 0;
  options.on_happening = [&](const mbs::Happening& h) { broken += h.kind == mbs::Happening::Kind::ElementBroken; };
  for (auto _ : state) {
    begun = false;
    broken = 0;
    summary = mbs::run(model, options);
    if (summary.ending != mbs::Summary::Ending::TimeLimit) return state.SkipWithError(summary.message.c_str());
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
  }
  const double runs = static_cast<double>(state.iterations()), steps = std::round(kDuration / summary.step);
  state.counters["steps"] = steps;
  state.counters["h_us"] = 1e6 * summary.step;
  state.counters["step_us"] = 1e6 * total / (runs * steps);
  state.counters["connection_ns"] = 1e9 * total / (runs * steps * static_cast<double>(model.elements.size()));
  state.counters["real_time_factor"] = kDuration * runs / total;
  state.counters["broken"] = broken;
  state.counters["energy_error_pct"] = 100 * summary.energy_error;
}
BENCHMARK(storehouse)->Unit(benchmark::kMillisecond)->UseManualTime();

}  // namespace
}  // namespace topple::bench
