// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void WeighCandidates(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  for (auto _ : state)
    cpu::weigh_candidates(s.exec, {&s.pair, 1}, s.matches, s.candidates, s.options.evidence,
                          s.options.score);
  state.counters["poses/s"] = benchmark::Counter(static_cast<double>(s.candidates[0].pose.size()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(WeighCandidates)->Unit(benchmark::kMillisecond);

void WeighModes(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  PairOutcome outcome;
  for (auto _ : state)
    cpu::weigh_modes(s.exec, {&s.pair, 1}, s.matches, s.candidates, s.modes, s.options,
                     {&outcome, 1});
  state.counters["modes"] = static_cast<double>(s.modes[0].size());
}
BENCHMARK(WeighModes)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
