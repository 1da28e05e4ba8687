// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration.hpp"
#include "scene.hpp"

namespace gpureg::bench {
namespace {

/// A complete alignment through the public API, with the preset of LoopSmart.
void PrepareCloud(benchmark::State& state) {
  Scene& s = Scene::get();
  const Context context = Context::cpu(static_cast<unsigned>(state.range(0)));
  const PointCloudView view(&s.raw_source[0].x, s.raw_source.size());
  for (auto _ : state) benchmark::DoNotOptimize(prepare(context, view));
}
BENCHMARK(PrepareCloud)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void AlignPair(benchmark::State& state) {
  Scene& s = Scene::get();
  const Context context = Context::cpu(static_cast<unsigned>(state.range(0)));
  const PreparedCloud source =
      prepare(context, PointCloudView(&s.raw_source[0].x, s.raw_source.size()));
  const PreparedCloud target =
      prepare(context, PointCloudView(&s.raw_target[0].x, s.raw_target.size()));
  for (auto _ : state)
    benchmark::DoNotOptimize(align(context, source, target, RegistrationOptions::loopsmart()));
}
BENCHMARK(AlignPair)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace gpureg::bench
