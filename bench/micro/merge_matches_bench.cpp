// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/feature_index.hpp"
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void MergeMatches(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::merge_matches(s.exec, {&s.pair, 1}, s.options));
  state.counters["queries/s"] = benchmark::Counter(2.0 * (s.pair.source.size + s.pair.target.size),
                                                   benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(MergeMatches)->Unit(benchmark::kMillisecond);

void IndexFeatures(benchmark::State& state) {
  const CloudView& c = EvidenceScene::get().pair.source;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::index_features({c.features, c.has_feature, c.size, c.feature_dimension}));
}
BENCHMARK(IndexFeatures)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
