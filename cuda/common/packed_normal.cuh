// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"

namespace gpureg::cuda {

/// A normal in 30 bits. The error of a cosine between two of them is below kPackedCosineError. A
/// zero normal has a word of its own.
constexpr float kPackedCosineError = 0.005f;
/// Error of the cosine where only one of the two is packed. Each coordinate has an error of up to
/// 1/1022, the cosine of up to sqrt(3)/1022 = 0.0017.
constexpr float kHalfPackedCosineError = 0.0025f;
constexpr std::uint32_t kPackedZero = ~std::uint32_t(0);

__device__ inline std::uint32_t pack_normal(Vec3 n) {
  if (is_zero(n)) return kPackedZero;
  const auto part = [](float v) {
    return static_cast<std::uint32_t>(__float2int_rn(v * 511.0f) + 512);
  };
  return part(n.x) | part(n.y) << 10 | part(n.z) << 20;
}

__device__ inline Vec3 unpack_normal(std::uint32_t packed) {
  const auto part = [&](int shift) {
    return (static_cast<float>((packed >> shift) & 1023u) - 512.0f) * (1.0f / 511.0f);
  };
  return {part(0), part(10), part(20)};
}

}  // namespace gpureg::cuda
