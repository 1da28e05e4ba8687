// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void ScoreCandidates(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  for (auto _ : state)
    cpu::score_candidates(s.exec, {&s.pair, 1}, s.matches, s.candidates, s.options);
  state.counters["poses/s"] = benchmark::Counter(static_cast<double>(s.candidates[0].pose.size()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(ScoreCandidates)->Unit(benchmark::kMillisecond);

void VerifyModes(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  PairOutcome outcome;
  for (auto _ : state)
    cpu::verify_modes(s.exec, {&s.pair, 1}, s.matches, s.candidates, s.modes, s.options,
                      {&outcome, 1});
  state.counters["modes"] = static_cast<double>(s.modes[0].size());
}
BENCHMARK(VerifyModes)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
