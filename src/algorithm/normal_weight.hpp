// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"

namespace gpureg {

// Normal-space weights (Rusinkiewicz and Levoy 2001, normal-space sampling): the weight of a point
// decreases with the number of normals of its cloud in its direction. A floor then does not
// dominate the furniture on it.

/// The 26 directions to the neighbours of a cell, and one bin for unknown normals.
constexpr int kNormalBins = 27;
constexpr float kNormalWeightScale = 65536.0f;  ///< weights are 16-bit fixed point

/// Index of the direction nearest to the normal, the first of equals; 26 for an unknown normal.
GPUREG_HD std::uint32_t normal_bin(Vec3 n) {
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

/// Weight of each point of a bin with `count` points: the sum over the bin is the square root of
/// their number.
GPUREG_HD std::uint32_t normal_weight_in_bin(std::uint32_t count) {
  return count == 0
             ? 0
             : static_cast<std::uint32_t>(kNormalWeightScale / sqrtf(static_cast<float>(count)));
}

}  // namespace gpureg
