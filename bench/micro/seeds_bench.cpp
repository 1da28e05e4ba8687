// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void ChooseSeeds(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  for (auto _ : state) benchmark::DoNotOptimize(cpu::choose_seeds(s.exec, s.matches, s.options));
  const double n = s.matches[0].size();
  state.counters["tests/s"] =
      benchmark::Counter(0.5 * n * n, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(ChooseSeeds)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
