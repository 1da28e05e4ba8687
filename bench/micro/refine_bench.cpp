// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void RefinePose(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::refine_poses(s.exec, {&s.pair, 1}, s.best, s.options));
}
BENCHMARK(RefinePose)->Unit(benchmark::kMillisecond);

void VerifyPose(benchmark::State& state) {
  Scene& s = Scene::get();
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::verify_poses(s.exec, {&s.pair, 1}, s.best, s.options));
}
BENCHMARK(VerifyPose)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
