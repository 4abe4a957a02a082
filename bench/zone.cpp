/// One evaluation of a zone: elastic, and yielding in bending about both axes under a normal force.

#include "mbs/zone.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "cpu_time.h"

namespace topple::bench {
namespace {

using namespace mbs;

constexpr double kStiff = 1e8;

/// A family of 9 forces by 33 rotations like those of a reinforced concrete section.
ZoneLaw make_law() {
  ZoneLaw law;
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    for (int k = 0; k < 9; ++k) m->normal_force.push_back(-4e6 + 5e5 * k);
    for (int j = 0; j < 33; ++j) m->plastic_rotation.push_back(0.2 * j * j / (32.0 * 32.0));
    for (int k = 0; k < 9; ++k) {
      const double s = k / 8.0, base = 4 * 3e5 * s * (1 - s);
      for (const double phi : m->plastic_rotation) m->positive.push_back(base * std::exp(-4 * phi));
    }
    m->negative = m->positive;
  }
  law.compression = {{0, 0.002, 0.02, 0.1}, {3.5e6, 4e6, 0.4e6, 0.4e6}};
  law.tension = {{0, 0.05}, {0.5e6, 0.6e6}};
  law.crush_length = 0.3;
  law.rupture_elongation = 0.06;
  law.shear_y = law.shear_z = 1e6;
  law.shear_friction = 0.5;
  law.slip_softening = 0.02;
  law.slip_rupture = 0.1;
  law.torsion = 5e5;
  return law;
}

/// Goes to and fro in bending about both axes; a turn of `amplitude` [rad] about each.
///   stations  1, or 2 at the ends of a member of 3 m
void walk(benchmark::State& state, double amplitude, int stations) {
  const CompiledLaws laws{compile_law(make_law())};
  ZoneParameters p;
  for (int i = 0; i < 6; ++i) p.stiffness[i] = kStiff;
  p.viscous = 0.2, p.relaxation = 0.006;  // 5 % damping, 10 Hz, steps of 0.1 ms
  p.stations = stations;
  p.law[0] = p.law[1] = 0;
  if (stations == 2) {
    p.x[0] = -1.5, p.x[1] = 1.5;
    p.stiffness[1] = p.stiffness[2] = 12 * kStiff / 9;
  }
  constexpr int n = 4096;
  std::vector<Six> path(n);
  for (int i = 0; i < n; ++i) {
    const double s = std::sin(2 * 3.14159265358979323846 * i / n);
    path[static_cast<size_t>(i)] = {{-1e6 / kStiff, 0, 0, 0, amplitude * s, 0.7 * amplitude * s}};
  }
  ZoneState z;
  int flowing = 0;
  double total = 0;
  for (auto _ : state) {
    z = {};
    flowing = 0;
    double before = 0;
    const double begin = cpu_time();
    for (int i = 0; i < n; ++i) {
      advance_zone(p, laws, path[static_cast<size_t>(i)], 1e-4 * i, 1e-4, z);
      flowing += z.plastic != before;
      before = z.plastic;
    }
    benchmark::DoNotOptimize(z);
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
  }
  if (!z.live) return state.SkipWithError("the zone broke");
  state.counters["zone_ns"] = 1e9 * total / (static_cast<double>(state.iterations()) * n);
  state.counters["yielding_share"] = static_cast<double>(flowing) / n;
}

void zone_elastic(benchmark::State& state) { walk(state, 1e-4, static_cast<int>(state.range(0))); }
BENCHMARK(zone_elastic)->Arg(1)->Arg(2)->UseManualTime();
void zone_yielding(benchmark::State& state) { walk(state, 0.02, static_cast<int>(state.range(0))); }
BENCHMARK(zone_yielding)->Arg(1)->Arg(2)->UseManualTime();

}  // namespace
}  // namespace topple::bench
