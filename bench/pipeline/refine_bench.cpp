// SPDX-License-Identifier: BSD-3-Clause
#include "fragments.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::bench {
namespace {

/// The scene as a map before its joint refinement.
struct Scene {
  RegistrationOptions options = RegistrationOptions{0.05f};
  std::vector<reconstruction::Surface> surfaces;
  reconstruction::Reconstruction map;

  Scene() {
    const Context best = Context::best();
    const auto clouds = prepare_batch(best, views(), options);
    const auto pairs = all_pairs();
    map = reconstruction::reconstruct_from_poses(clouds.size(), pairs,
                                                 align_batch(best, clouds, pairs, options));
    for (const PreparedCloud& cloud :
         prepare_batch(best, views(), reconstruction::surface_options(options)))
      surfaces.push_back(reconstruction::surface_of(cloud));
  }
};

/// Joint refinement of the map of the scene, with the upload of its surfaces.
void refine_map(benchmark::State& state, const std::string& backend, std::uint32_t max_points) {
  const Context* on = context(state, backend);
  if (!on) return;
  static const Scene scene;
  auto options = reconstruction::RefineOptions::for_depth_cameras(scene.options.voxel_size);
  options.max_points = max_points;
  reconstruction::RefineReport report;
  for (auto _ : state) {
    reconstruction::Reconstruction map = scene.map;
    report = reconstruction::refine(*on, scene.surfaces, map, options);
  }
  state.counters["scans"] = static_cast<double>(scene.map.placed());
  state.counters["pairs"] = static_cast<double>(report.pairs);
  state.counters["correspondences"] = static_cast<double>(report.correspondences);
  state.counters["steps"] = report.iterations;
  state.counters["mm_rmse"] = 1e3 * report.final_rmse;
}

BENCHMARK_CAPTURE(refine_map, cuda, "cuda", 1500)->Apply(elapsed);
BENCHMARK_CAPTURE(refine_map, cuda_all_points, "cuda", 1u << 20)->Apply(elapsed);
BENCHMARK_CAPTURE(refine_map, cpu, "cpu", 1500)->Apply(elapsed);

}  // namespace
}  // namespace gpureg::bench
