// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/device/warp.cuh"

namespace gpureg::cuda {

/// Sums of N integers over a thread block; the first warp has them in v afterwards. scratch: shared
/// memory, N integers per warp.
template <int N>
__device__ void block_sum(std::int64_t (&v)[N], std::int64_t* scratch) {
  const int warp = static_cast<int>(threadIdx.x / 32), warps = static_cast<int>(blockDim.x / 32);
  __syncthreads();
#pragma unroll
  for (int k = 0; k < N; ++k) {
    const std::int64_t sum = warp_sum(v[k]);
    if (threadIdx.x % 32 == 0) scratch[warp * N + k] = sum;
  }
  __syncthreads();
  if (warp > 0) return;
#pragma unroll
  for (int k = 0; k < N; ++k)
    v[k] = warp_sum(static_cast<int>(threadIdx.x) < warps
                        ? scratch[static_cast<int>(threadIdx.x) * N + k]
                        : std::int64_t(0));
}

}  // namespace gpureg::cuda
