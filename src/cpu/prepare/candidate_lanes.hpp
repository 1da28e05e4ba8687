// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "algorithm/closest_build.hpp"
#include "cpu/common/wide_vectors.hpp"

namespace gpureg::cpu {

constexpr std::size_t kLanes = 16;

/// Squared distances of points to a location, 16 at a time. Both kinds round alike.
struct NarrowLanes {
  /// Writes d2 and returns the least; size: a multiple of 16.
  static float measure(const float* x, const float* y, const float* z, std::size_t size,
                       Vec3 center, float* d2) {
    float least[kLanes];
    for (float& l : least) l = std::numeric_limits<float>::max();
    for (std::size_t k = 0; k < size; k += kLanes)
      for (std::size_t l = 0; l < kLanes; ++l) {
        const float dx = x[k + l] - center.x, dy = y[k + l] - center.y, dz = z[k + l] - center.z;
        const float d = fmaf(dz, dz, fmaf(dy, dy, dx * dx));
        d2[k + l] = d;
        least[l] = d < least[l] ? d : least[l];
      }
    return *std::min_element(least, least + kLanes);
  }
  /// Bits of the 16 values that are at most `most`.
  static std::uint32_t within(const float* d2, float most) {
    std::uint32_t mask = 0;
    for (std::uint32_t l = 0; l < kLanes; ++l)
      mask |= static_cast<std::uint32_t>(d2[l] <= most) << l;
    return mask;
  }
  /// Bits of the 16 points that dominated_in_cell() does not rule out. nearest2: of best.
  static std::uint32_t undominated(const float* x, const float* y, const float* z, const float* d2,
                                   Vec3 best, float nearest2, const ClosestGeometry& g) {
    const DominanceTest test = dominance_test(g);
    std::uint8_t flag[kLanes];
    for (std::uint32_t l = 0; l < kLanes; ++l)
      flag[l] = !dominated({x[l] - best.x, y[l] - best.y, z[l] - best.z}, d2[l] - nearest2, test);
    std::uint32_t mask = 0;
    for (std::uint32_t l = 0; l < kLanes; ++l) mask |= static_cast<std::uint32_t>(flag[l]) << l;
    return mask;
  }
};
#ifdef GPUREG_WIDE_TARGET
struct WideLanes {
  GPUREG_WIDE_TARGET static float measure(const float* x, const float* y, const float* z,
                                          std::size_t size, Vec3 center, float* d2) {
    const __m512 cx = _mm512_set1_ps(center.x), cy = _mm512_set1_ps(center.y),
                 cz = _mm512_set1_ps(center.z);
    __m512 least = _mm512_set1_ps(std::numeric_limits<float>::max());
    for (std::size_t k = 0; k < size; k += kLanes) {
      const __m512 dx = _mm512_sub_ps(_mm512_loadu_ps(x + k), cx),
                   dy = _mm512_sub_ps(_mm512_loadu_ps(y + k), cy),
                   dz = _mm512_sub_ps(_mm512_loadu_ps(z + k), cz);
      const __m512 d = _mm512_fmadd_ps(dz, dz, _mm512_fmadd_ps(dy, dy, _mm512_mul_ps(dx, dx)));
      _mm512_storeu_ps(d2 + k, d);
      least = _mm512_min_ps(d, least);
    }
    return _mm512_reduce_min_ps(least);
  }
  GPUREG_WIDE_TARGET static std::uint32_t within(const float* d2, float most) {
    return _mm512_cmp_ps_mask(_mm512_loadu_ps(d2), _mm512_set1_ps(most), _CMP_LE_OQ);
  }
  GPUREG_WIDE_TARGET static std::uint32_t undominated(const float* x, const float* y,
                                                      const float* z, const float* d2, Vec3 best,
                                                      float nearest2, const ClosestGeometry& g) {
    const DominanceTest test = dominance_test(g);
    const __m512 dx = _mm512_abs_ps(_mm512_sub_ps(_mm512_loadu_ps(x), _mm512_set1_ps(best.x))),
                 dy = _mm512_abs_ps(_mm512_sub_ps(_mm512_loadu_ps(y), _mm512_set1_ps(best.y))),
                 dz = _mm512_abs_ps(_mm512_sub_ps(_mm512_loadu_ps(z), _mm512_set1_ps(best.z)));
    const __m512 l1 = _mm512_add_ps(_mm512_add_ps(dx, dy), dz),
                 difference = _mm512_sub_ps(_mm512_loadu_ps(d2), _mm512_set1_ps(nearest2)),
                 most = _mm512_add_ps(_mm512_mul_ps(l1, _mm512_set1_ps(test.edge)),
                                      _mm512_set1_ps(test.rest));
    return static_cast<std::uint32_t>(
        static_cast<__mmask16>(~_mm512_cmp_ps_mask(difference, most, _CMP_GT_OQ)));
  }
};
#endif

}  // namespace gpureg::cpu
