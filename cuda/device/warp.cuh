// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg::cuda {

// Integer reductions over a full warp: every lane gets the result. One instruction from compute
// capability 8.0 on.
#if !defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800
__device__ inline std::uint32_t warp_sum(std::uint32_t v) { return __reduce_add_sync(~0u, v); }
__device__ inline std::uint32_t warp_max(std::uint32_t v) { return __reduce_max_sync(~0u, v); }
__device__ inline std::int32_t warp_max(std::int32_t v) { return __reduce_max_sync(~0u, v); }
__device__ inline std::int32_t warp_min(std::int32_t v) { return __reduce_min_sync(~0u, v); }
#else
template <typename T, typename Combine>
__device__ T warp_combine(T v, Combine combine) {
  for (int step = 16; step > 0; step /= 2)
    v = combine(v, static_cast<T>(__shfl_xor_sync(~0u, v, step)));
  return v;
}
struct Add {
  template <typename T>
  __device__ T operator()(T a, T b) const {
    return a + b;
  }
};
struct Larger {
  template <typename T>
  __device__ T operator()(T a, T b) const {
    return a > b ? a : b;
  }
};
struct Smaller {
  template <typename T>
  __device__ T operator()(T a, T b) const {
    return a < b ? a : b;
  }
};
__device__ inline std::uint32_t warp_sum(std::uint32_t v) { return warp_combine(v, Add()); }
__device__ inline std::uint32_t warp_max(std::uint32_t v) { return warp_combine(v, Larger()); }
__device__ inline std::int32_t warp_max(std::int32_t v) { return warp_combine(v, Larger()); }
__device__ inline std::int32_t warp_min(std::int32_t v) { return warp_combine(v, Smaller()); }
#endif

__device__ inline std::int64_t warp_sum(std::int64_t v) {
  for (int step = 16; step > 0; step /= 2) v += __shfl_xor_sync(~0u, v, step);
  return v;
}

/// Sum of the values of this lane and of the lanes before it. Thread blocks of one dimension.
__device__ inline std::uint32_t warp_prefix_sum(std::uint32_t v) {
  for (std::uint32_t step = 1; step < 32; step *= 2) {
    const std::uint32_t before = __shfl_up_sync(~0u, v, step);
    if (threadIdx.x % 32 >= step) v += before;
  }
  return v;
}

}  // namespace gpureg::cuda
