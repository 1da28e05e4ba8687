// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/icp.hpp"
#include "algorithm/inlier.hpp"
#include "cuda/common/closest_cells.cuh"
#include "cuda/common/stages.hpp"
#include "cuda/device/block_sum.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 512;

struct RefineBatch {
  const SearchPair* pairs;
  const BestPose* best;
  InlierTest test;
  std::uint32_t max_iterations;
  float max_distance, kernel_width;
  BestPose* out;
};

/// Terms of one source point, if its closest target point is within distance and normal angle.
__device__ void add_point(const SearchPair& pair, const RefineBatch& r, const Rigid& rigid,
                          float max_squared, float inverse_max, float inverse_radius,
                          std::uint32_t i, IcpSums& sums) {
  const Vec3 q = apply(rigid, pair.source.points[i]);
  const Closest c = find_closest(pair.target, pair.target_cells, q, max_squared);
  if (c.index == kNoValue) return;
  const Vec3 normal = pair.target.normals[c.index];
  if (is_zero(normal)) return;
  if (!normals_agree(rotate(rigid, pair.source.normals[i]), normal, r.test.min_cosine)) return;
  const float distance = dot(q - pair.target.points[c.index], normal);
  add_icp_term(rotate(rigid, pair.source.points[i]) * inverse_radius, normal,
               distance * inverse_max, robust_weight(distance, r.kernel_width), sums);
}

/// A thread block per pair runs all its iterations.
__global__ void __launch_bounds__(kThreads) refine(RefineBatch r) {
  __shared__ std::int64_t scratch[kThreads / 32 * 27];
  __shared__ Pose<double> pose;
  __shared__ std::uint32_t iterations;
  __shared__ bool done;
  const SearchPair& pair = r.pairs[blockIdx.x];
  const BestPose best = r.best[blockIdx.x];
  if (!best.found) {
    if (threadIdx.x == 0) r.out[blockIdx.x] = best;
    return;
  }
  if (threadIdx.x == 0) {
    pose = best.pose;
    iterations = 0;
    done = false;
  }
  __syncthreads();
  const float max_squared = r.max_distance * r.max_distance, inverse_max = 1.0f / r.max_distance,
              inverse_radius = 1.0f / pair.source.radius;
  while (!done) {
    const Rigid rigid = to_rigid(pose);
    IcpSums sums{{0}};
    for (std::uint32_t i = threadIdx.x; i < pair.source.size; i += kThreads)
      add_point(pair, r, rigid, max_squared, inverse_max, inverse_radius, i, sums);
    block_sum(sums.v, scratch);
    if (threadIdx.x == 0) {
      const IcpStep step = solve_icp(sums, pair.source.radius, r.max_distance);
      ++iterations;
      if (step.valid) pose = compose_small(step.omega, step.shift, pose);
      done = !step.valid || icp_settled(step, pair.source.radius, r.max_distance, kSettled) ||
             iterations >= r.max_iterations;
    }
    __syncthreads();
  }
  // Support of the refined pose under the normal test of the ranking.
  const Rigid rigid = to_rigid(pose);
  std::int64_t support[2] = {0, 0};
  for (std::uint32_t i = threadIdx.x; i < pair.source.size; i += kThreads) {
    const Closest c = find_closest(pair.target, pair.target_cells,
                                   apply(rigid, pair.source.points[i]), r.test.max_squared);
    if (c.index == kNoValue) continue;
    if (!normals_agree(rotate(rigid, pair.source.normals[i]), pair.target.normals[c.index],
                       r.test.min_cosine))
      continue;
    ++support[0];
    support[1] += fixed_residual(c.squared_distance, r.test.inverse_max_squared);
  }
  block_sum(support, scratch);
  if (threadIdx.x != 0) return;
  BestPose out = best;
  out.iterations = iterations;
  const Support refined{static_cast<std::uint32_t>(support[0]), best.support.hypothesis,
                        static_cast<std::uint64_t>(support[1])};
  // A refinement that fits worse than its start is dropped.
  if (truncated_cost(refined, pair.source.size) <= truncated_cost(best.support, pair.source.size)) {
    out.pose = pose;
    out.support = refined;
  }
  r.out[blockIdx.x] = out;
}

}  // namespace

DeviceBuffer<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs,
                                    const DeviceBuffer<BestPose>& best,
                                    const RegistrationSettings& options) {
  auto out = exec.buffer<BestPose>(pairs.size);
  if (options.refine.max_iterations == 0) {
    check(cudaMemcpyAsync(out.data(), best.data(), pairs.size * sizeof(BestPose),
                          cudaMemcpyDeviceToDevice, exec.stream()),
          "cudaMemcpyAsync");
    return out;
  }
  const auto views = upload_search_pairs(exec, pairs);
  RefineBatch batch{};
  batch.pairs = views.data();
  batch.best = best.data();
  batch.test =
      inlier_test(options.prepare.max_correspondence_distance, options.quadruples.max_normal_angle);
  batch.max_iterations = options.refine.max_iterations;
  batch.max_distance = options.prepare.max_correspondence_distance;
  batch.kernel_width = options.refine.kernel_width;
  batch.out = out.data();
  launch(exec, "refine", refine, {static_cast<unsigned>(pairs.size), kThreads}, batch);
  return out;
}

}  // namespace gpureg::cuda
