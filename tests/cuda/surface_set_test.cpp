// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/gpu.hpp"
#include "reconstruction/rooms.hpp"
#include "support/surfaces.hpp"

namespace gpureg::test {
namespace {

TEST(SurfaceSetOnCuda, TheBitsDoNotDependOnTheBackend) {
  GPUREG_GPU_OR_SKIP();
  SurfaceScene scene(5, 4000);
  scene.surfaces[1].add({std::numeric_limits<float>::quiet_NaN(), 0, 0}, {0, 0, 1});
  scene.surfaces[2].add({3e8f, -3e8f, 3e8f}, {0, 0, 1});
  scene.surfaces[3].add({0, 0, 0}, {0, 0, 0});
  scene.surfaces.emplace_back();
  scene.pairs.push_back({0, 5});
  scene.pairs.push_back({5, 0});
  const SurfaceSet cpu(Context::cpu(2), scene.views()), cuda(Context::cuda(), scene.views());
  PointToPlaneOptions options;
  for (const double distance : {0.1, 0.03, 0.4, 0.1})
    for (const std::uint32_t points : {500u, 1500u, 100000u}) {
      options.max_distance = distance;
      options.max_points = points;
      const auto expected = cpu.linearise(scene.pairs, options);
      const auto sums = cuda.linearise(scene.pairs, options);
      EXPECT_GT(expected[0].count, 50u);
      for (std::size_t p = 0; p < scene.pairs.size(); ++p)
        EXPECT_TRUE(same_bits(expected[p], sums[p])) << distance << " m, pair " << p;
    }
}

TEST(SurfaceSetOnCuda, DevicesShareThePairs) {
  GPUREG_GPU_OR_SKIP();
  const SurfaceScene scene(4, 2000);
  CudaOptions twice;
  twice.devices = {0, 0};
  const SurfaceSet one(Context::cuda(), scene.views()), two(Context::cuda(twice), scene.views());
  const auto expected = one.linearise(scene.pairs), sums = two.linearise(scene.pairs);
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) EXPECT_TRUE(same_bits(expected[p], sums[p]));
  EXPECT_TRUE(two.linearise({}).empty());
}

TEST(SurfaceSetOnCuda, TheRefinedMapDoesNotDependOnTheBackend) {
  GPUREG_GPU_OR_SKIP();
  const Rooms rooms;
  auto cpu = rooms.data.map(), cuda = cpu;
  reconstruction::refine(Context::cpu(2), rooms.surfaces, cpu);
  const auto report = reconstruction::refine(Context::cuda(), rooms.surfaces, cuda);
  EXPECT_EQ(bytes_of(cpu), bytes_of(cuda));
  EXPECT_EQ(report.pairs, 10u);
}

}  // namespace
}  // namespace gpureg::test
