/// One evaluation of concrete in three dimensions, by what happens at the point.

#include "material/solid_concrete.h"

#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "base/unit.h"

namespace topple::bench {
namespace {

using namespace material;

enum Kind { Elastic, Cracking, Crushing, Both };

struct Cases {
  SolidConcrete law;
  std::vector<SolidConcreteState> old;
  std::vector<std::array<double, 6>> strain;
};

/// Points of random walks in strain, sorted by what the step does there.
Cases make_cases(Kind kind) {
  SolidConcreteInput in;
  in.uniaxial.fc = 25 * unit::MPa, in.uniaxial.Ec = 30 * unit::GPa, in.uniaxial.fct = 2 * unit::MPa;
  in.uniaxial.Gf = 130, in.uniaxial.l_eq = 0.1;
  Cases cases{make_solid_concrete(in), {}, {}};
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  while (cases.old.size() < 1000) {
    SolidConcreteState state, now;
    std::array<double, 6> strain{}, step{};
    for (double& x : step) x = 1e-4 * normal(generator);
    for (int i = 0; i < 40; ++i) {
      for (size_t a = 0; a < 6; ++a) strain[a] += step[a] += 3e-5 * normal(generator);
      advance(cases.law, state, strain, now);
      const bool crush = now.compression_step > 0, crack = now.crack > 0;
      if (kind == (crush ? (crack ? Both : Crushing) : (crack ? Cracking : Elastic))) {
        cases.old.push_back(state);
        cases.strain.push_back(strain);
      }
      state = now;
    }
  }
  return cases;
}

void evaluate(benchmark::State& state, Kind kind, bool implex) {
  const Cases cases = make_cases(kind);
  size_t i = 0;
  SolidConcreteState now;
  for (auto _ : state) {
    const SolidUpdate u = implex ? advance_implex(cases.law, cases.old[i], cases.strain[i], 1, now)
                                 : advance(cases.law, cases.old[i], cases.strain[i], now);
    benchmark::DoNotOptimize(u);
    if (++i == cases.old.size()) i = 0;
  }
}

BENCHMARK_CAPTURE(evaluate, elastic, Elastic, false)->Name("solid_concrete_elastic");
BENCHMARK_CAPTURE(evaluate, cracking, Cracking, false)->Name("solid_concrete_cracking");
BENCHMARK_CAPTURE(evaluate, crushing, Crushing, false)->Name("solid_concrete_crushing");
BENCHMARK_CAPTURE(evaluate, both, Both, false)->Name("solid_concrete_both");
BENCHMARK_CAPTURE(evaluate, implex, Both, true)->Name("solid_concrete_implex");

}  // namespace
}  // namespace topple::bench
