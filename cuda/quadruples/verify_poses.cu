// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/inlier.hpp"
#include "cuda/common/closest_cells.cuh"
#include "cuda/common/stages.hpp"
#include "cuda/device/block_sum.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;
constexpr std::size_t kMaxParts = 16;

__device__ void add(std::int64_t* to, std::int64_t value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(to), static_cast<unsigned long long>(value));
}
__device__ void add(std::uint64_t* to, std::int64_t value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(to), static_cast<unsigned long long>(value));
}

/// Thread blocks (y) of a pair (x) add up integers over their points, independent of the order.
/// out: zero before.
__global__ void __launch_bounds__(kThreads)
    verify(const SearchPair* pairs, const BestPose* poses, InlierTest test, Verification* out) {
  __shared__ std::int64_t scratch[kThreads / 32 * 12];
  const SearchPair& pair = pairs[blockIdx.x];
  const CloudView &source = pair.source, &target = pair.target;
  const BestPose& best = poses[blockIdx.x];
  if (!best.found) return;
  Verification j{{0, 0, 0}, {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}}, {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}}};
  const Rigid rigid = to_rigid(best.pose);
  for (std::uint32_t i = blockIdx.y * kThreads + threadIdx.x; i < source.size;
       i += gridDim.y * kThreads) {
    const Closest c =
        find_closest(target, pair.target_cells, apply(rigid, source.points[i]), test.max_squared);
    if (c.index == kNoValue) continue;
    add_moment(source.points[i] * (1.0f / source.radius), j.source);
    add_moment(target.points[c.index] * (1.0f / target.radius), j.target);
    const bool agree =
        normals_agree(rotate(rigid, source.normals[i]), target.normals[c.index], test.min_cosine);
    j.support.inliers += agree ? 1u : 0u;
    j.support.residual += agree ? fixed_residual(c.squared_distance, test.inverse_max_squared) : 0u;
  }
  std::int64_t first[12] = {j.support.inliers, static_cast<std::int64_t>(j.support.residual),
                            static_cast<std::int64_t>(j.source.count)};
  std::int64_t second[10] = {static_cast<std::int64_t>(j.target.count)};
#pragma unroll
  for (int k = 0; k < 3; ++k) {
    first[3 + k] = j.source.sum[k];
    second[1 + k] = j.target.sum[k];
  }
#pragma unroll
  for (int k = 0; k < 6; ++k) {
    first[6 + k] = j.source.outer[k];
    second[4 + k] = j.target.outer[k];
  }
  block_sum(first, scratch);
  block_sum(second, scratch);
  if (threadIdx.x != 0) return;
  Verification& sum = out[blockIdx.x];
  if (blockIdx.y == 0) sum.support.hypothesis = best.support.hypothesis;
  atomicAdd(&sum.support.inliers, static_cast<std::uint32_t>(first[0]));
  add(&sum.support.residual, first[1]);
  add(&sum.source.count, first[2]);
  add(&sum.target.count, second[0]);
#pragma unroll
  for (int k = 0; k < 3; ++k) {
    add(&sum.source.sum[k], first[3 + k]);
    add(&sum.target.sum[k], second[1 + k]);
  }
#pragma unroll
  for (int k = 0; k < 6; ++k) {
    add(&sum.source.outer[k], first[6 + k]);
    add(&sum.target.outer[k], second[4 + k]);
  }
}

}  // namespace

DeviceBuffer<Verification> verify_poses(Exec& exec, Span<const PairView> pairs,
                                        const DeviceBuffer<BestPose>& poses,
                                        const RegistrationSettings& options) {
  auto out = exec.filled<Verification>(pairs.size, 0);
  const auto views = upload_search_pairs(exec, pairs);
  // Few pairs: more thread blocks for each.
  const std::size_t parts = std::max<std::size_t>(
      2, std::min<std::size_t>(kMaxParts,
                               4 * exec.multiprocessors() / std::max<std::size_t>(1, pairs.size)));
  launch(exec, "verify", verify,
         {{static_cast<unsigned>(pairs.size), static_cast<unsigned>(parts)}, kThreads},
         views.data(), poses.data(),
         inlier_test(options.prepare.max_correspondence_distance,
                     options.quadruples.max_verification_normal_angle),
         out.data());
  return out;
}

}  // namespace gpureg::cuda
