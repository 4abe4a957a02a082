/// Boxes dropped in a heap: contact alone. 3 s, in which they fall, meet and come to lie.

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>

#include "cpu_time.h"
#include "mbs/solver.h"

namespace topple::bench {
namespace {

/// Boxes of 0.4 m in layers of `across` by `across`, each layer turned and shifted against the one below.
mbs::Model make_heap(int across, int layers) {
  mbs::Model m;
  m.contact.friction = m.contact.body_friction = 0.5;
  m.contact.contact_frequency = 500;
  for (int layer = 0; layer < layers; ++layer)
    for (int i = 0; i < across * across; ++i) {
      mbs::Body b;
      b.name = "b" + std::to_string(m.bodies.size());
      mbs::Shape s;
      s.half = {0.2, 0.2, 0.2};
      b.shapes = {s};
      b.mass = 2400 * 0.4 * 0.4 * 0.4;
      b.inertia = b.mass * 0.4 * 0.4 / 6 * Mat3::identity();
      b.X_WB.p = {0.6 * (i % across) + 0.1 * (layer % 3), 0.6 * (i / across) + 0.1 * (layer % 2), 0.5 + 0.6 * layer};
      b.X_WB.q = exp_rotation({0.3 * std::sin(3.0 * layer + i), 0.3 * std::cos(2.0 * layer + i), 0.5 * layer});
      add_body(m, b);
    }
  return m;
}

/// Arguments: boxes across a layer, layers.
void pile(benchmark::State& state) {
  const mbs::Model model = make_heap(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  mbs::Options options;
  options.duration = 3;
  options.equilibrium = false;
  options.frame_interval = 3;
  mbs::Summary end;
  double total = 0;
  for (auto _ : state) {
    const double begin = cpu_time();
    end = mbs::run(model, options);
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
    if (end.ending != mbs::Summary::Ending::TimeLimit) return state.SkipWithError(end.message.c_str());
  }
  const double steps = static_cast<double>(end.steps * state.iterations());
  state.counters["bodies"] = static_cast<double>(model.bodies.size());
  state.counters["steps"] = static_cast<double>(end.steps);
  state.counters["body_ns"] = 1e9 * total / (steps * static_cast<double>(model.bodies.size()));
  state.counters["energy_error_pct"] = 100 * end.energy_error;
}
BENCHMARK(pile)->Args({5, 4})->Args({10, 10})->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(1);

}  // namespace
}  // namespace topple::bench
