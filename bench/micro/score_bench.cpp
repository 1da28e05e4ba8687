// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void ScoreHypotheses(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::score_hypotheses(s.exec, {&s.pair, 1}, s.hypotheses, s.options));
  const double tests = static_cast<double>(s.hypotheses[0].id.size()) * s.pair.source.size;
  state.counters["point_tests/s"] =
      benchmark::Counter(tests, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(ScoreHypotheses)->Unit(benchmark::kMillisecond);

void MeasureSupport(benchmark::State& state) {
  Scene& s = Scene::get();
  const Rigid pose = to_rigid(s.best[0].pose);
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::measure_support(s.pair.source, s.pair.target, pose, s.options));
  state.counters["point_tests/s"] =
      benchmark::Counter(s.pair.source.size, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(MeasureSupport)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace gpureg::bench
