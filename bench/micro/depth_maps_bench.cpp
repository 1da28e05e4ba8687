// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_scene.hpp"

namespace gpureg::bench {
namespace {

void BuildDepthMaps(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  const auto points = cpu::downsample(s.exec, {s.raw, 1}, s.options.prepare);
  for (auto _ : state)
    benchmark::DoNotOptimize(cpu::build_depth_maps(s.exec, {s.raw, 1}, points, s.options.prepare));
}
BENCHMARK(BuildDepthMaps)->Unit(benchmark::kMillisecond);

/// Input of the stages after the normals.
struct WithNormals {
  explicit WithNormals(EvidenceScene& s)
      : points(cpu::downsample(s.exec, {s.raw, 1}, s.options.prepare)),
        grids(cpu::build_grids(s.exec, points, s.options.prepare)),
        normals(cpu::estimate_normals(s.exec, points, grids, s.options.prepare.normal_radius)) {}
  std::vector<cpu::DownsampledCloud> points;
  std::vector<cpu::Grid> grids;
  std::vector<std::vector<Vec3>> normals;
};

void BuildSurfaceSides(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  const WithNormals cloud(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::build_surface_sides(s.exec, cloud.points, cloud.normals, s.options.prepare));
}
BENCHMARK(BuildSurfaceSides)->Unit(benchmark::kMillisecond);

void ComputeWideFeatures(benchmark::State& state) {
  EvidenceScene& s = EvidenceScene::get();
  const WithNormals cloud(s);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cpu::compute_wide_features(s.exec, cloud.points, cloud.grids, s.options.prepare));
}
BENCHMARK(ComputeWideFeatures)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gpureg::bench
