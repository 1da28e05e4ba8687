// SPDX-License-Identifier: BSD-3-Clause
#include "fragments.hpp"

namespace gpureg::bench {
namespace {

void report(benchmark::State& state, const std::vector<PreparedCloud>& clouds, std::size_t runs) {
  PrepareStatistics sum;
  double raw = 0, points = 0;
  for (const PreparedCloud& cloud : clouds) {
    const PrepareStatistics& s = cloud.statistics();
    sum.downsample += s.downsample;
    sum.normals += s.normals;
    sum.features += s.features;
    sum.grid += s.grid;
    sum.depth_maps += s.depth_maps;
    sum.surface_sides += s.surface_sides;
    raw += static_cast<double>(s.input_points);
    points += s.points;
  }
  const double n = static_cast<double>(clouds.size());
  state.counters["fragments"] = n;
  state.counters["raw_points"] = raw / n;
  state.counters["points"] = points / n;
  state.counters["ms_downsample"] = sum.downsample / n;
  state.counters["ms_normals"] = sum.normals / n;
  state.counters["ms_features"] = sum.features / n;
  state.counters["ms_grid"] = sum.grid / n;
  state.counters["ms_depth_maps"] = sum.depth_maps / n;
  state.counters["ms_surface_sides"] = sum.surface_sides / n;
  state.counters["ms_per_fragment"] =
      benchmark::Counter(n * static_cast<double>(runs) * 1e-3,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

RegistrationOptions preset(const std::string& name) {
  return name == "default" ? RegistrationOptions{0.05f} : RegistrationOptions::loopsmart();
}

/// All fragments of the scene from host memory in one call.
void prepare_all(benchmark::State& state, const std::string& backend,
                 const std::string& options_name, const std::vector<PointCloudView>& all) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  std::vector<PreparedCloud> clouds = prepare_batch(*on, all, options);
  std::size_t runs = 0;
  for (auto _ : state) {
    clouds = prepare_batch(*on, all, options);
    ++runs;
  }
  report(state, clouds, runs);
}

void prepare_batch_of_fragments(benchmark::State& state, const std::string& backend,
                                const std::string& options_name) {
  prepare_all(state, backend, options_name, views());
}

/// The cameras are unknown: preparation decides which sides of the surfaces were seen.
void prepare_without_viewpoints(benchmark::State& state, const std::string& backend,
                                bool with_normals) {
  std::vector<PointCloudView> all = views();
  for (PointCloudView& view : all) {
    view.viewpoints = nullptr;
    view.viewpoint_count = 0;
    if (!with_normals) view.normals = nullptr;
  }
  prepare_all(state, backend, "default", all);
}

/// One fragment at a time.
void prepare_one_fragment(benchmark::State& state, const std::string& backend,
                          const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto all = views();
  std::vector<PreparedCloud> cloud{prepare(*on, all[0], options)};
  std::size_t runs = 0;
  for (auto _ : state) cloud[0] = prepare(*on, all[runs++ % all.size()], options);
  report(state, cloud, runs);
}

BENCHMARK_CAPTURE(prepare_batch_of_fragments, cuda, "cuda", "loopsmart")->Apply(elapsed);
BENCHMARK_CAPTURE(prepare_batch_of_fragments, cuda_default, "cuda", "default")->Apply(elapsed);
BENCHMARK_CAPTURE(prepare_without_viewpoints, cuda, "cuda", false)->Apply(elapsed);
BENCHMARK_CAPTURE(prepare_without_viewpoints, cuda_with_normals, "cuda", true)->Apply(elapsed);
BENCHMARK_CAPTURE(prepare_one_fragment, cuda, "cuda", "loopsmart")->Apply(elapsed);
BENCHMARK_CAPTURE(prepare_batch_of_fragments, cpu, "cpu", "loopsmart")->Apply(elapsed);

}  // namespace
}  // namespace gpureg::bench
