// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void RefineModes(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  std::vector<std::vector<cpu::Mode>> modes;
  for (auto _ : state) {
    modes = s.modes;
    cpu::refine_roughly(s.exec, {&s.pair, 1}, modes, s.options);
    cpu::merge_modes(s.exec, modes, s.options, kRoughMerge);
    cpu::polish_modes(s.exec, {&s.pair, 1}, modes, s.options);
  }
  state.counters["modes"] = static_cast<double>(s.modes[0].size());
}
BENCHMARK(RefineModes)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
