// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fit.hpp"

#include "cuda/common/stages.hpp"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

__global__ void __launch_bounds__(128)
    fit(const std::uint32_t* offset, std::uint32_t pairs, const std::uint32_t* id,
        const std::uint32_t* room, const MatchedPoints* matches, const std::uint32_t* match_count,
        std::uint64_t seed, Pose<float>* poses, std::uint8_t* valid, std::uint32_t* valid_count) {
  const std::uint32_t h = blockIdx.x * blockDim.x + threadIdx.x;
  const std::uint32_t p = entry_in_block(offset, pairs, blockIdx.x * blockDim.x, h);
  const bool there = h < offset[pairs];
  bool fits = false;
  if (there) {
    const MatchedPoints* m = matches + room[p];
    const Quadruple q = draw_quadruple(id[h], seed, match_count[p]);
    Vec3 source[4], target[4];
    for (int c = 0; c < 4; ++c) {
      source[c] = m[q.match[c]].source;
      target[c] = m[q.match[c]].target;
    }
    Pose<float> pose = identity_pose<float>();
    fits = fit_rigid(source, target, pose);
    poses[h] = pose;
    valid[h] = fits;
  }
  // Adjacent hypotheses mostly belong to one pair, so a warp counts for all of them at once.
  const std::uint32_t first = __shfl_sync(~0u, p, 0);
  if (__all_sync(~0u, p == first)) {
    const unsigned fitting = __ballot_sync(~0u, fits);
    if (threadIdx.x % 32 == 0 && fitting != 0)
      atomicAdd(&valid_count[p], static_cast<std::uint32_t>(__popc(static_cast<int>(fitting))));
  } else if (fits) {
    atomicAdd(&valid_count[p], 1u);
  }
}

}  // namespace

Hypotheses fit_hypotheses(Exec& exec, const Matches& matches, const Quadruples& quadruples,
                          const RegistrationSettings& options) {
  const std::uint32_t total = quadruples.segments.total();
  const std::uint32_t pairs = static_cast<std::uint32_t>(quadruples.segments.entries());
  Hypotheses out;
  out.segments = &quadruples.segments;
  out.id = quadruples.id.data();
  out.pose = exec.buffer<Pose<float>>(total);
  out.valid = exec.buffer<std::uint8_t>(total);
  out.count = exec.filled<std::uint32_t>(pairs, 0);
  if (total == 0) return out;
  launch(exec, "fit", fit, shape_for(total, 128), quadruples.segments.on_device.data(), pairs,
         quadruples.id.data(), matches.room.on_device.data() + quadruples.first_pair,
         matches.pairs.data(), matches.count.data() + quadruples.first_pair, options.seed,
         out.pose.data(), out.valid.data(), out.count.data());
  return out;
}

}  // namespace gpureg::cuda
