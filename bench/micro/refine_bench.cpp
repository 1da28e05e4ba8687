// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void RefinePose(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::refine_poses(s.exec, {&s.pair, 1}, s.best, s.options.score, s.options.refine));
}
BENCHMARK(RefinePose)->Unit(benchmark::kMillisecond);

void JudgePose(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::judge_poses(s.exec, {&s.pair, 1}, s.best, s.options.score));
}
BENCHMARK(JudgePose)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
