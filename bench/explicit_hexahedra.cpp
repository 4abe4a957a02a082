/// Explicit hexahedra: a frame of columns and slabs that falls on the ground and yields.

#include <benchmark/benchmark.h>
#include <hwy/targets.h>

#include <chrono>

#include "cpu_time.h"
#include "explicit_frame.h"
#include "fem/explicit_system.h"

namespace topple::bench {
namespace {

using fem::ExplicitModel;

/// Seconds to read and write a byte of a buffer of this size [s], best of several.
double measure_bandwidth(size_t bytes) {
  std::vector<double> buffer(bytes / sizeof(double), 1.0);
  double best = 1e9;
  for (int i = 0; i < 7; ++i) {
    const double start = cpu_time();
    for (double& x : buffer) x = x * 0.999 + 1e-3;
    benchmark::DoNotOptimize(buffer.data());
    best = std::min(best, cpu_time() - start);
  }
  return best / static_cast<double>(2 * buffer.size() * sizeof(double));
}

void run_frame(benchmark::State& state, int bays_x, int bays_y, int storeys, int threads, bool contact) {
  const ExplicitModel model = make_explicit_frame(bays_x, bays_y, storeys);
  fem::ExplicitOptions options;
  options.threads = threads;
  options.contact = contact;
  fem::ExplicitSystem system(model, options);
  system.set_velocity({0, 0, -3});
  if (system.advance(60 * system.step()) != fem::ExplicitEnding::ReachedTime) state.SkipWithError("diverged");
  const auto before = system.timing();
  const long long first = system.steps();
  const double elements = static_cast<double>(model.elements.size());
  double used = 0;
  for (auto _ : state) {
    const double start = cpu_time();
    const auto clock = std::chrono::steady_clock::now();
    if (system.advance(system.time() + 64 * system.step()) != fem::ExplicitEnding::ReachedTime)
      state.SkipWithError("diverged");
    used += threads == 1 ? cpu_time() - start
                         : std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count();
  }
  const auto after = system.timing();
  const double steps = static_cast<double>(system.steps() - first);
  const double kernel = after.kernel - before.kernel, boundary = after.boundary - before.boundary;
  const double contacts = after.contact - before.contact + after.search - before.search;
  const double clock = kernel + boundary + contacts;
  // state (20 read and written, 2 read), corners, and rows of the nodes (8 read and written)
  const double bytes = elements * (42 * 8 + 16) + static_cast<double>(model.nodes.size()) * 128;
  int yielding = 0;
  for (size_t e = 0; e < model.elements.size(); ++e) yielding += system.plastic_strain(static_cast<int>(e)) > 0;
  state.counters["elements"] = elements;
  state.counters["ns"] = 1e9 * used / steps / elements;
  state.counters["kernel_pct"] = 100 * kernel / clock;
  state.counters["shared_pct"] = 100 * boundary / clock;
  state.counters["contact_pct"] = 100 * contacts / clock;
  state.counters["yielded_pct"] = 100 * yielding / elements;
  state.counters["bound_ns"] = 1e9 * measure_bandwidth(static_cast<size_t>(bytes)) * bytes / elements;
  state.SetLabel(system.instruction_set());
}

/// 81,000 elements; argument: 0 the machine's best instructions, 1 at most AVX2.
void explicit_hexahedra(benchmark::State& state) {
  if (state.range(0) == 1) hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  run_frame(state, 8, 8, 9, 1, state.range(1) != 0);
  hwy::DisableTargets(0);
}
BENCHMARK(explicit_hexahedra)
    ->Args({1, 0})
    ->Args({1, 1})
    ->Args({0, 0})
    ->Args({0, 1})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(4);

void explicit_hexahedra_large(benchmark::State& state) {
  if (state.range(0) == 1) hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  run_frame(state, 32, 32, 10, 1, false);
  hwy::DisableTargets(0);
}
BENCHMARK(explicit_hexahedra_large)->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond)->Iterations(1);

/// 750 elements, in the cache: the arithmetic alone.
void explicit_hexahedra_small(benchmark::State& state) {
  if (state.range(0) == 1) hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  run_frame(state, 1, 1, 3, 1, false);
  hwy::DisableTargets(0);
}
BENCHMARK(explicit_hexahedra_small)->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond)->Iterations(40);

void explicit_hexahedra_threads(benchmark::State& state) {
  run_frame(state, 8, 8, 9, static_cast<int>(state.range(0)), true);
}
BENCHMARK(explicit_hexahedra_threads)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->Iterations(4);

/// A frame of weak concrete that has fallen to pieces: balls and faces in touch with each other; argument: 0 the
/// machine's best instructions, 1 at most AVX2.
void explicit_debris(benchmark::State& state) {
  if (state.range(0) == 1) hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  ExplicitModel model = make_explicit_frame(3, 3, 4);
  for (fem::ExplicitMaterial& m : model.materials) {
    for (fem::YieldPoint& y : m.yield) y.tension /= 5, y.compression /= 5;
    m.tension_limit = 0.03, m.compression_limit = 0.05;
  }
  fem::ExplicitSystem system(model, {});
  system.set_velocity({1, 0, -12});
  if (system.advance(0.4) != fem::ExplicitEnding::ReachedTime) state.SkipWithError("diverged");
  const auto before = system.timing();
  const long long first = system.steps();
  for (auto _ : state)
    if (system.advance(system.time() + 256 * system.step()) != fem::ExplicitEnding::ReachedTime)
      state.SkipWithError("diverged");
  const auto after = system.timing();
  const double steps = static_cast<double>(system.steps() - first);
  const double kernel = after.kernel - before.kernel + after.boundary - before.boundary;
  const double press = after.contact - before.contact, search = after.search - before.search;
  int alive = 0;
  for (size_t e = 0; e < model.elements.size(); ++e) alive += system.is_alive(static_cast<int>(e));
  state.counters["alive"] = alive;
  state.counters["balls"] = static_cast<double>(system.debris().size());
  state.counters["touches"] = system.contacts();
  state.counters["kernel_us"] = 1e6 * kernel / steps;
  state.counters["press_us"] = 1e6 * press / steps;
  state.counters["search_us"] = 1e6 * search / steps;
  state.counters["contact_over_kernel"] = (press + search) / kernel;
  state.SetLabel(system.instruction_set());
  hwy::DisableTargets(0);
}
BENCHMARK(explicit_debris)->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond)->Iterations(4);

}  // namespace
}  // namespace topple::bench
