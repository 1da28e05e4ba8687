// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void SampleQuadruples(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::sample_quadruples(s.exec, s.matches, s.options));
  state.counters["hypotheses/s"] =
      benchmark::Counter(s.options.quadruples.count, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["survivors"] = static_cast<double>(s.quadruples[0].size());
}
BENCHMARK(SampleQuadruples)->Unit(benchmark::kMillisecond);

void FitHypotheses(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::fit_hypotheses(s.exec, s.matches, s.quadruples, s.options));
  state.counters["fits/s"] = benchmark::Counter(static_cast<double>(s.quadruples[0].size()),
                                                benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(FitHypotheses)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
