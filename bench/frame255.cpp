/// 255 boxes and 660 linear-brittle connections: equilibrium apart, then 1.7 s of collapse.

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>

#include "cpu_time.h"
#include "frame.h"
#include "mbs/solver.h"

namespace topple::bench {
namespace {

constexpr double kDuration = 1.7;  // [s]

/// The collapse alone, from the equilibrium on; argument: step in microseconds, 0 for the engine's own choice.
void frame255(benchmark::State& state) {
  const mbs::Model model = make_frame();
  mbs::Options options;
  options.step = 1e-6 * static_cast<double>(state.range(0));
  int broken = 0;
  options.on_happening = [&](const mbs::Happening& h) { broken += h.kind == mbs::Happening::Kind::ElementBroken; };
  mbs::Simulation simulation(model, options);
  std::string message;
  if (!simulation.find_equilibrium(message)) return state.SkipWithError(message.c_str());
  const auto start = simulation.snapshot();
  const double h = simulation.step();
  const long steps = std::lround(std::ceil(kDuration / h));
  double total = 0;
  for (auto _ : state) {
    broken = 0;
    simulation.restore(start);
    const double begin = cpu_time();
    for (long i = 0; i < steps; ++i)
      if (!simulation.advance_step()) return state.SkipWithError("the state is no longer finite");
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
  }
  const mbs::View& v = simulation.calc_view();
  const double n = static_cast<double>(state.iterations()) * static_cast<double>(steps);
  state.counters["steps"] = static_cast<double>(steps);
  state.counters["h_us"] = 1e6 * h;
  state.counters["step_us"] = 1e6 * total / n;
  state.counters["connection_ns"] = 1e9 * total / (n * static_cast<double>(model.elements.size()));
  state.counters["real_time_factor"] = kDuration * static_cast<double>(state.iterations()) / total;
  state.counters["broken"] = broken;
  state.counters["body_contacts"] = v.body_contacts;
  state.counters["energy_error_pct"] = 100 * std::abs(v.energy.residual) / v.energy.released;
}
BENCHMARK(frame255)->Arg(0)->Arg(100)->Unit(benchmark::kMillisecond)->UseManualTime();

/// Compiling the model with its choice of step, and the dead-load equilibrium.
void frame255_compile(benchmark::State& state) {
  const mbs::Model model = make_frame();
  for (auto _ : state) {
    const mbs::Simulation simulation(model, {});
    benchmark::DoNotOptimize(simulation.step());
  }
  state.counters["bodies"] = static_cast<double>(model.bodies.size());
  state.counters["connections"] = static_cast<double>(model.elements.size());
}
BENCHMARK(frame255_compile)->Unit(benchmark::kMillisecond);

void frame255_equilibrium(benchmark::State& state) {
  const mbs::Model model = make_frame();
  mbs::Simulation simulation(model, {});
  const auto start = simulation.snapshot();
  std::string message;
  for (auto _ : state) {
    simulation.restore(start);
    if (!simulation.find_equilibrium(message)) return state.SkipWithError(message.c_str());
  }
  state.counters["iterations"] = simulation.summary().equilibrium_iterations;
}
BENCHMARK(frame255_equilibrium)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace topple::bench
