// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg::cuda {

/// Entry of a batch that element i belongs to; offset has entries + 1 numbers, i is below the last.
__device__ inline std::uint32_t entry_of(const std::uint32_t* offset, std::uint32_t entries,
                                         std::uint32_t i) {
  std::uint32_t lo = 0, hi = entries;
  while (hi - lo > 1) {
    const std::uint32_t mid = (lo + hi) / 2;
    (offset[mid] <= i ? lo : hi) = mid;
  }
  return lo;
}

/// The same for the consecutive elements of a thread block: one thread searches, the others step on
/// from its result. All threads of the block call it; i is the element of the thread and may be
/// beyond the last. first: first element of the block, below the last.
__device__ inline std::uint32_t entry_in_block(const std::uint32_t* offset, std::uint32_t entries,
                                               std::uint32_t first, std::uint32_t i) {
  __shared__ std::uint32_t found;
  if (threadIdx.x == 0) found = entry_of(offset, entries, first);
  __syncthreads();
  std::uint32_t entry = found;
  while (entry + 1 < entries && offset[entry + 1] <= i) ++entry;
  return entry;
}

}  // namespace gpureg::cuda
