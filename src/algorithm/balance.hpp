// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"

namespace gpureg {

/// Points are weighed by how rare their normal's direction is, so that a floor does not outvote
/// everything that stands on it. the 26 directions to the neighbours of a cell, and one for unknown
/// normals
constexpr int kBalanceBins = 27;
constexpr float kBalanceScale = 65536.0f;  ///< weights are 16-bit fixed point

/// Direction of the 26 that the normal is nearest to; the first of equals. 26: the normal is
/// unknown.
GPUREG_HD std::uint32_t balance_bin(Vec3 n) {
  if (is_zero(n)) return 26;
  std::uint32_t best = 0, bin = 0;
  float largest = -2.0f;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const int terms = x * x + y * y + z * z;
        if (terms == 0) continue;
        const float scale = terms == 1 ? 1.0f : terms == 2 ? 0.70710678f : 0.57735027f;
        const float cosine =
            dot(n, {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}) * scale;
        best = cosine > largest ? bin : best;
        largest = cosine > largest ? cosine : largest;
        ++bin;
      }
  return best;
}

/// Weight of each point of a bin with that many: all points of a bin together weigh the root of
/// their number.
GPUREG_HD std::uint32_t balance_weight(std::uint32_t count) {
  return count == 0 ? 0
                    : static_cast<std::uint32_t>(kBalanceScale / sqrtf(static_cast<float>(count)));
}

}  // namespace gpureg
