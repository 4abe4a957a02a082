/// Load steps of a solid zone of a column: a column of 50 x 50 cm with eight bars and ties under a constant normal
/// force.

#include <benchmark/benchmark.h>

#include <cmath>

#include "cpu_time.h"
#include "nearfield/solid.h"

namespace topple::bench {
namespace {

nearfield::ZoneInput make_zone() {
  nearfield::ZoneInput in;
  product::Section& s = in.section;
  s.name = "column 50 x 50", s.width = s.height = 0.5;
  s.cover = 0.03, s.tie_diameter = 0.01, s.tie_spacing = 0.2;
  constexpr double edge = 0.194, diameter = 0.0319;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      if (i != 0 || j != 0) s.bars.push_back({i * edge, j * edge, 8e-4, diameter});
  in.concrete.fc = 25e6, in.concrete.fct = 1.994e6, in.concrete.Ec = 30e9, in.concrete.eps_c1 = 2.2e-3;
  in.concrete.Gf = 130, in.concrete.Gcl = 15e3;
  in.steel = {"", 420e6, 500e6, 200e9, 0.1};
  in.length = 0.5;
  return in;
}

/// N of 0.2 of the crushing force, rotations to 0.01: elastic, cracking, yielding, crushing. One thread.
void march_zone(benchmark::State& state) {
  nearfield::SolidOptions options;
  options.element_size = 1e-3 * static_cast<double>(state.range(0));
  options.largest_rotation = 0.01;
  options.steps = 60;
  nearfield::SolidMarch m;
  const double start = cpu_time();
  for (auto _ : state) m = nearfield::march_solid(make_zone(), -1.78e6, 0, 1, options, {});
  const double used = cpu_time() - start, steps = m.steps + m.failed_steps;
  // shares by the clock, which other programs stretch alike
  const double clock = m.element_time + m.factor_time + m.solve_time;
  state.counters["unknowns"] = m.degrees_of_freedom;
  state.counters["steps"] = m.steps;
  state.counters["iterations_a_step"] = m.iterations / steps;
  state.counters["step_s"] = used / steps;
  state.counters["elements_pct"] = 100 * m.element_time / clock;
  state.counters["factor_pct"] = 100 * m.factor_time / clock;
  state.counters["solve_pct"] = 100 * m.solve_time / clock;
}
BENCHMARK(march_zone)->Name("solid_zone")->Arg(60)->Arg(42)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace topple::bench
