/// The scene `frame255` on every engine that is built in and can express it, in the same run: steps of 0.1 ms for all.

#include <benchmark/benchmark.h>

#include <string>

#include "cpu_time.h"
#include "engines/engine.h"
#include "frame.h"

namespace topple::bench {
namespace {

constexpr double kDuration = 1.7;  // [s]

/// Processor time of a run without its equilibrium, and of the native engine for the same right before.
void frame255_engine(benchmark::State& state, const std::string& name) {
  mbs::Model model = make_frame();
  model.contact.bodies = false;
  mbs::Options options;
  options.step = 1e-4;
  options.duration = kDuration;
  options.frame_interval = kDuration;
  const auto engine = engines::make_engine(name), native = engines::make_engine("native");
  if (const auto unsupported = engine->find_unsupported(model, options); !unsupported.empty())
    return state.SkipWithError((unsupported[0].place + ": " + unsupported[0].what).c_str());
  const auto time_of = [&](const engines::Engine& e) {
    double begin = 0;
    options.on_frame = [&](const mbs::View& v) {
      if (v.time == 0) begin = cpu_time();  // the equilibrium is found
    };
    const mbs::Summary end = e.run(model, options);
    const double spent = cpu_time() - begin;
    if (end.ending != mbs::Summary::Ending::TimeLimit) state.SkipWithError(end.message.c_str());
    return spent;
  };
  double total = 0, total_native = 0;
  for (auto _ : state) {
    total_native += time_of(*native);
    const double spent = time_of(*engine);
    total += spent;
    state.SetIterationTime(spent);
  }
  state.counters["times_native"] = total / total_native;
}

// the native engine comes first, the others as they are built in
const bool registered = [] {
  for (const std::string& name : engines::engine_names())
    benchmark::RegisterBenchmark(("frame255_engine/" + name).c_str(),
                                 [name](benchmark::State& state) { frame255_engine(state, name); })
        ->Unit(benchmark::kMillisecond)
        ->UseManualTime()
        ->Iterations(1);
  return true;
}();

}  // namespace
}  // namespace topple::bench
