// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void ProposePoses(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::propose_poses(s.exec, s.matches, s.seeds, s.options));
  state.counters["seeds/s"] = benchmark::Counter(static_cast<double>(s.seeds[0].size()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(ProposePoses)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
