// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg::cuda {

// Loads that leave no trace in the first-level cache: for data that is read once while something smaller wants to stay there.
__device__ inline std::uint32_t load_passing(const std::uint32_t* p) {
  std::uint32_t v;
  asm("ld.global.nc.L1::no_allocate.u32 %0, [%1];" : "=r"(v) : "l"(p));
  return v;
}
__device__ inline float4 load_passing(const float4* p) {
  float4 v;
  asm("ld.global.nc.L1::no_allocate.v4.f32 {%0,%1,%2,%3}, [%4];" : "=f"(v.x), "=f"(v.y), "=f"(v.z), "=f"(v.w) : "l"(p));
  return v;
}

}  // namespace gpureg::cuda
