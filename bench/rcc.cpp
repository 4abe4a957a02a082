/// Resistance characteristic curves, layered route: the ground column of the Weida storehouse.

#include "nearfield/rcc.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "base/unit.h"
#include "cpu_time.h"
#include "nearfield/fibres.h"
#include "nearfield/section_kernel.h"

namespace topple::bench {
namespace {

using namespace nearfield;

constexpr double pi = 3.14159265358979323846;

/// 500 x 500 mm with eight bars, 64 cm² together.
ZoneInput make_column() {
  ZoneInput in;
  product::Section& s = in.section;
  s.name = "column", s.width = s.height = 0.5;
  s.cover = 0.03, s.tie_diameter = 0.01, s.tie_spacing = 0.2;
  const double area = 8e-4, diameter = std::sqrt(4 * area / pi);
  const double edge = 0.25 - s.cover - s.tie_diameter - 0.5 * diameter;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      if (i != 0 || j != 0) s.bars.push_back({i * edge, j * edge, area, diameter});
  in.concrete.fc = 25 * unit::MPa, in.concrete.fct = 1.994 * unit::MPa, in.concrete.Ec = 30e9;
  in.concrete.eps_c1 = 2.2e-3, in.concrete.Gf = 73 * std::pow(25.0, 0.18), in.concrete.Gcl = 15e3;
  in.steel = {"", 420 * unit::MPa, 525 * unit::MPa, 200e9, 0.08};
  in.length = 0.5;
  return in;
}

/// One axis, one direction: 12 normal forces from 0.9 of crushing to a tension of half the bars' yield, 60 rotations
/// from below cracking to 0.2 rad, each 12 % above the one before.
void rcc_family(benchmark::State& state) {
  const ZoneInput in = make_column();
  std::vector<double> kappa{0};
  for (int j = 0; j < 60; ++j) kappa.push_back(0.2 / in.length * std::pow(1.12, j - 59));
  double held = 0;
  for (auto _ : state) {
    const Fibres f = make_fibres(in, Axis::Y);
    const double crushing = find_crushing(f).force;
    held = 0;
    for (int k = 0; k < 12; ++k) {
      const March march = march_curvature(f, crushing * (-0.9 + k * (1.05 / 11)), 1, kappa);
      held += march.last;
      benchmark::DoNotOptimize(march.moment.data());
    }
  }
  state.counters["families"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["held_points"] = held;  // equilibria found, of 720
}
BENCHMARK(rcc_family)->Unit(benchmark::kMillisecond);

/// Four families (both axes, both directions; the column is symmetric, so one is computed), axial curves, capacities.
void rcc_zone(benchmark::State& state) {
  const ZoneInput in = make_column();
  for (auto _ : state) benchmark::DoNotOptimize(make_rcc(in));
}
BENCHMARK(rcc_zone)->Unit(benchmark::kMillisecond);

/// One evaluation of the section: in lanes, in vectors of one number, by the plain laws.
template <class Calc>
void walk(benchmark::State& state, const Calc& calc) {
  double e = -1e-3;
  for (auto _ : state) {
    benchmark::DoNotOptimize(calc(e));
    e = e < 1e-3 ? e + 1e-6 : -1e-3;
  }
}
void rcc_section(benchmark::State& state) {
  const Fibres plain = make_fibres(make_column(), Axis::Y);
  const PackedSection f = pack_section(plain);
  walk(state, [&](double e) { return calc_resultants(f, e, 0.02); });
  // the plain laws in the same run
  const auto time = [](const auto& calc) {
    const double begin = cpu_time();
    for (int i = 0; i < 200000; ++i) benchmark::DoNotOptimize(calc(-1e-3 + 1e-8 * i));
    return cpu_time() - begin;
  };
  const double lanes = time([&](double e) { return calc_resultants(f, e, 0.02); });
  state.counters["times_plain"] = time([&](double e) { return calc_resultants(plain, e, 0.02); }) / lanes;
}
BENCHMARK(rcc_section);
void rcc_section_singly(benchmark::State& state) {
  const PackedSection f = pack_section(make_fibres(make_column(), Axis::Y));
  walk(state, [&](double e) { return calc_resultants_singly(f, e, 0.02); });
}
BENCHMARK(rcc_section_singly);
void rcc_section_plain(benchmark::State& state) {
  const Fibres f = make_fibres(make_column(), Axis::Y);
  walk(state, [&](double e) { return calc_resultants(f, e, 0.02); });
}
BENCHMARK(rcc_section_plain);

}  // namespace
}  // namespace topple::bench
