// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/side_evidence.hpp"
#include "cuda/device/block_sum.cuh"

namespace gpureg::cuda {

/// SideEvidence of one lane: counts take a register each, not two.
struct LaneEvidence {
  std::int64_t sum[kFirstCount] = {};
  std::uint32_t count[kTerms - kFirstCount] = {};

  __device__ void add(Term term, std::uint32_t value) {
    const std::uint32_t k = static_cast<std::uint32_t>(term);
    if (k < kFirstCount)
      sum[k] += value;
    else
      count[k - kFirstCount] += value;
  }
  __device__ std::uint32_t points(Term term) const {
    return count[static_cast<std::uint32_t>(term) - kFirstCount];
  }
};

/// Sum over the block, in thread 0. scratch: shared memory, kTerms integers per warp.
__device__ inline SideEvidence block_sum(const LaneEvidence& lane, std::int64_t* scratch) {
  SideEvidence side;
#pragma unroll
  for (std::uint32_t k = 0; k < kTerms; ++k)
    side.sum[k] = k < kFirstCount ? lane.sum[k] : lane.count[k - kFirstCount];
  block_sum(side.sum, scratch);
  return side;
}

}  // namespace gpureg::cuda
