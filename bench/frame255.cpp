/// 255 boxes and 660 linear-brittle connections: equilibrium apart, then 1.7 s of collapse; one run, and an ensemble.

#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "base/heap.h"
#include "cpu_time.h"
#include "frame.h"
#include "mbs/batch.h"
#include "mbs/solver.h"

namespace topple::bench {
namespace {

constexpr double kDuration = 1.7;  // [s]

/// The collapse alone, from the equilibrium on.
///   step     in microseconds, 0 for the engine's own choice
///   contact  bodies touch each other too, not the ground alone
void collapse(benchmark::State& state, double step, bool contact) {
  mbs::Model model = make_frame();
  model.contact.bodies = contact;
  mbs::Options options;
  options.step = 1e-6 * step;
  int broken = 0;
  options.on_happening = [&](const mbs::Happening& h) { broken += h.kind == mbs::Happening::Kind::ElementBroken; };
  mbs::Simulation simulation(model, options);
  std::string message;
  if (!simulation.find_equilibrium(message)) return state.SkipWithError(message.c_str());
  const auto start = simulation.snapshot();
  double total = 0, steps = 0;
  for (auto _ : state) {
    broken = 0;
    simulation.restore(start);
    const double begin = cpu_time();
    while (simulation.time() < kDuration) {
      if (!simulation.advance_step()) return state.SkipWithError("the state is no longer finite");
      ++steps;
    }
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
  }
  const mbs::View& v = simulation.calc_view();
  const double runs = static_cast<double>(state.iterations());
  state.counters["steps"] = steps / runs;
  state.counters["h_us"] = 1e6 * kDuration * runs / steps;
  state.counters["step_us"] = 1e6 * total / steps;
  state.counters["connection_ns"] = 1e9 * total / (steps * static_cast<double>(model.elements.size()));
  state.counters["real_time_factor"] = kDuration * runs / total;
  state.counters["broken"] = broken;
  state.counters["body_contacts"] = v.body_contacts;
  state.counters["energy_error_pct"] = 100 * std::abs(v.energy.residual) / v.energy.released;
}
void frame255(benchmark::State& state) { collapse(state, static_cast<double>(state.range(0)), false); }
BENCHMARK(frame255)->Arg(0)->Arg(100)->Unit(benchmark::kMillisecond)->UseManualTime();
void frame255_contact(benchmark::State& state) { collapse(state, static_cast<double>(state.range(0)), true); }
BENCHMARK(frame255_contact)->Arg(0)->Unit(benchmark::kMillisecond)->UseManualTime();

/// An ensemble of the frame with connections of varied strength, one thread; ground contact. Compiling and equilibrium
/// of every sample are in the time.
void frame255_ensemble(benchmark::State& state) {
  keep_freed_memory();  // as studies do
  mbs::Model model = make_frame();
  model.contact.bodies = false;
  const size_t count = static_cast<size_t>(state.range(0));
  std::vector<mbs::Variation> variations;
  for (size_t i = 0; i < count; ++i)
    variations.push_back([i](mbs::Model& m) {
      const double f = 0.9 + 0.2 * static_cast<double>((7 * i) % 16) / 16;
      const auto vary = [f](mbs::ZoneLaw& law) {
        for (mbs::Curve* c : {&law.tension, &law.compression})
          for (double& x : c->f) x *= f;
        for (mbs::MomentFamily* family : {&law.moment_y, &law.moment_z})
          for (std::vector<double>* limits : {&family->positive, &family->negative})
            for (double& x : *limits) x *= f;
        law.shear_y *= f, law.shear_z *= f, law.torsion *= f;
      };
      for (size_t k = 0; k < m.laws.size(); ++k) m.laws.edit(k, vary);
    });
  mbs::BatchOptions options;
  options.run.duration = kDuration;
  options.run.frame_interval = kDuration;
  double total = 0;
  for (auto _ : state) {
    const double begin = cpu_time();
    const std::vector<mbs::Summary> ends = mbs::run_batch(model, variations, options);
    for (const mbs::Summary& end : ends)
      if (end.ending != mbs::Summary::Ending::TimeLimit) return state.SkipWithError(end.message.c_str());
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
  }
  state.counters["samples_per_second"] = static_cast<double>(count * state.iterations()) / total;
}
BENCHMARK(frame255_ensemble)->Arg(16)->Unit(benchmark::kMillisecond)->UseManualTime();

/// Cost of a body and step as the frame grows; the first 0.1 s, ground contact, one thread and two.
void frame_growing(benchmark::State& state) {
  mbs::Model model = make_frame(static_cast<int>(state.range(0)));
  model.contact.bodies = false;
  mbs::Options options;
  options.threads = static_cast<int>(state.range(1));
  mbs::Simulation simulation(model, options);
  std::string message;
  if (!simulation.find_equilibrium(message)) return state.SkipWithError(message.c_str());
  const auto start = simulation.snapshot();
  double total = 0, steps = 0;
  for (auto _ : state) {
    simulation.restore(start);
    const auto begin = std::chrono::steady_clock::now();
    while (simulation.time() < 0.1) {
      if (!simulation.advance_step()) return state.SkipWithError("the state is no longer finite");
      ++steps;
    }
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    total += spent;
    state.SetIterationTime(spent);
  }
  state.counters["bodies"] = static_cast<double>(model.bodies.size());
  state.counters["connections"] = static_cast<double>(model.elements.size());
  state.counters["body_ns"] = 1e9 * total / (steps * static_cast<double>(model.bodies.size()));
}
BENCHMARK(frame_growing)
    ->Args({8, 1})
    ->Args({42, 1})
    ->Args({333, 1})
    ->Args({333, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime();

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
