// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/inlier.hpp"
#include "block_sum.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 768;

/// A thread block per pair.
__global__ void __launch_bounds__(kThreads) judge(const PairView* pairs, const BestPose* poses, InlierTest test, Judgement* out) {
  __shared__ std::int64_t scratch[kThreads / 32 * 12];
  const CloudView &source = pairs[blockIdx.x].source, &target = pairs[blockIdx.x].target;
  const BestPose& best = poses[blockIdx.x];
  Judgement j{{0, 0, 0}, {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}}, {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}}};
  if (best.found) {
    const Rigid rigid = to_rigid(best.pose);
    for (std::uint32_t i = threadIdx.x; i < source.size; i += kThreads) {
      const Closest c = find_closest(target.closest, target.points, apply(rigid, source.points[i]), test.max_squared);
      if (c.index == kNoValue) continue;
      add_moment(source.points[i] * (1.0f / source.radius), j.source);
      add_moment(target.points[c.index] * (1.0f / target.radius), j.target);
      const bool agree = normals_agree(rotate(rigid, source.normals[i]), target.normals[c.index], test.min_cosine);
      j.support.inliers += agree ? 1u : 0u;
      j.support.residual += agree ? fixed_residual(c.squared_distance, test.inverse_max_squared) : 0u;
    }
  }
  std::int64_t first[12] = {j.support.inliers, static_cast<std::int64_t>(j.support.residual), static_cast<std::int64_t>(j.source.count)};
  std::int64_t second[10] = {static_cast<std::int64_t>(j.target.count)};
#pragma unroll
  for (int k = 0; k < 3; ++k) first[3 + k] = j.source.sum[k], second[1 + k] = j.target.sum[k];
#pragma unroll
  for (int k = 0; k < 6; ++k) first[6 + k] = j.source.outer[k], second[4 + k] = j.target.outer[k];
  block_sum(first, scratch);
  block_sum(second, scratch);
  if (threadIdx.x != 0) return;
  j.support = {static_cast<std::uint32_t>(first[0]), best.found ? best.support.hypothesis : 0, static_cast<std::uint64_t>(first[1])};
  j.source.count = static_cast<std::uint64_t>(first[2]), j.target.count = static_cast<std::uint64_t>(second[0]);
#pragma unroll
  for (int k = 0; k < 3; ++k) j.source.sum[k] = first[3 + k], j.target.sum[k] = second[1 + k];
#pragma unroll
  for (int k = 0; k < 6; ++k) j.source.outer[k] = first[6 + k], j.target.outer[k] = second[4 + k];
  out[blockIdx.x] = j;
}

}  // namespace

DeviceBuffer<Judgement> judge_poses(Exec& exec, Span<const PairView> pairs, const DeviceBuffer<BestPose>& poses, const ScoreOptions& options) {
  auto out = exec.buffer<Judgement>(pairs.size);
  const auto views = exec.upload(pairs.data, pairs.size);
  judge<<<static_cast<unsigned>(pairs.size), kThreads, 0, exec.stream()>>>(
      views.data(), poses.data(), inlier_test(options.max_correspondence_distance, options.max_judged_normal_angle), out.data());
  check_launch("judge");
  return out;
}

}  // namespace gpureg::cuda
