// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "warp.cuh"

namespace gpureg::cuda {

/// Sums of N integers over a thread block; thread 0 has them afterwards in v. scratch: shared, N numbers per warp.
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
  if (threadIdx.x == 0)
    for (int k = 0; k < N; ++k) {
      v[k] = 0;
      for (int w = 0; w < warps; ++w) v[k] += scratch[w * N + k];
    }
}

}  // namespace gpureg::cuda
