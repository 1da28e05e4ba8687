// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void MatchFeatures(benchmark::State& state) {
  Scene& s = Scene::get();
  RegistrationOptions options = s.options;
  options.quadruples.neighbors = static_cast<std::uint32_t>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(cpu::match_features(s.exec, {&s.pair, 1}, options));
  // Pairs of values that are subtracted, squared and added.
  state.counters["terms/s"] =
      benchmark::Counter(static_cast<double>(s.pair.source.size) * s.pair.target.size * 33,
                         benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(MatchFeatures)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
