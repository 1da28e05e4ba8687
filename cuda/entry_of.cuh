// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg::cuda {

/// The entry of a batch that item i belongs to; offset has entries + 1 numbers, i is below the last.
__device__ inline std::uint32_t entry_of(const std::uint32_t* offset, std::uint32_t entries, std::uint32_t i) {
  std::uint32_t lo = 0, hi = entries;
  while (hi - lo > 1) {
    const std::uint32_t mid = (lo + hi) / 2;
    (offset[mid] <= i ? lo : hi) = mid;
  }
  return lo;
}

}  // namespace gpureg::cuda
