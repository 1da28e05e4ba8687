// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

namespace gpureg::bench {
namespace {

void counters(benchmark::State& state, const Scene& s) {
  state.counters["raw_points"] = static_cast<double>(s.raw_source.size());
  state.counters["points"] = static_cast<double>(s.source->points.size());
}

void Downsample(benchmark::State& state) {
  Scene& s = Scene::get();
  const RawCloud raw = test::raw_cloud(s.raw_source);
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::downsample(s.exec, {&raw, 1}, s.options.prepare));
  counters(state, s);
}
BENCHMARK(Downsample)->Unit(benchmark::kMillisecond);

struct Products {
  explicit Products(Scene& s) {
    const RawCloud raw = test::raw_cloud(s.raw_source);
    clouds = cpu::downsample(s.exec, {&raw, 1}, s.options.prepare);
    grids = cpu::build_grids(s.exec, clouds, s.options.prepare);
    normals = cpu::estimate_normals(s.exec, clouds, grids, s.options.prepare.normal_radius);
  }
  std::vector<cpu::DownsampledCloud> clouds;
  std::vector<cpu::Grid> grids;
  std::vector<std::vector<Vec3>> normals;
};

void BuildGrid(benchmark::State& state) {
  Scene& s = Scene::get();
  const Products p(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::build_grids(s.exec, p.clouds, s.options.prepare));
}
BENCHMARK(BuildGrid)->Unit(benchmark::kMillisecond);

void EstimateNormals(benchmark::State& state) {
  Scene& s = Scene::get();
  const Products p(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::estimate_normals(s.exec, p.clouds, p.grids, s.options.prepare.normal_radius));
}
BENCHMARK(EstimateNormals)->Unit(benchmark::kMillisecond);

void ComputeFpfh(benchmark::State& state) {
  Scene& s = Scene::get();
  const Products p(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::compute_features(s.exec, p.clouds, p.normals, p.grids, s.options.prepare));
}
BENCHMARK(ComputeFpfh)->Unit(benchmark::kMillisecond);

void BuildClosestGrid(benchmark::State& state) {
  Scene& s = Scene::get();
  const Products p(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::build_closest_grids(s.exec, p.clouds, p.grids, s.options.prepare));
}
BENCHMARK(BuildClosestGrid)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
