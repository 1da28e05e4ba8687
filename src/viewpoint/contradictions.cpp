// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/contradictions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "common/vector_targets.hpp"

namespace gpureg {
namespace {

/// Edges whose weights are summed as float.
constexpr std::size_t kFloatSums = 64;
/// Edges between two comparisons with the limit, and what the rounding of the sums may change.
constexpr std::size_t kBetweenLimits = 16 * kFloatSums;
constexpr double kMargin = 1.01;

/// One number for each of several viewpoints. The loops over them become vector instructions.
template <std::size_t kLanes>
struct alignas(4 * kLanes) Lanes {
  float of[kLanes];
};

/// Cosines of the angles between a normal and the directions to the viewpoints; 0 at the point.
template <std::size_t kLanes>
GPUREG_ALWAYS_INLINE void measure_cosines(Vec3 point, Vec3 normal, const Lanes<kLanes>& x,
                                          const Lanes<kLanes>& y, const Lanes<kLanes>& z,
                                          Lanes<kLanes>& out) {
#pragma omp simd
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float dx = x.of[l] - point.x, dy = y.of[l] - point.y, dz = z.of[l] - point.z;
    const float squared = std::max(dx * dx + dy * dy + dz * dz, std::numeric_limits<float>::min());
    out.of[l] = (normal.x * dx + normal.y * dy + normal.z * dz) / std::sqrt(squared);
  }
}

/// Adds the largest weights that the edges of an end may have.
template <std::size_t kLanes>
GPUREG_ALWAYS_INLINE void add_most(const Lanes<kLanes>& cosines, float weight,
                                   Lanes<kLanes>& most) {
#pragma omp simd
  for (std::size_t l = 0; l < kLanes; ++l) most.of[l] += weight * std::fabs(cosines.of[l]);
}

/// True where the shares of all viewpoints will be above a limit.
template <std::size_t kLanes>
GPUREG_ALWAYS_INLINE bool all_above(const double* bad, const Lanes<kLanes>& most, double limit) {
  int above = 0;
  for (std::size_t l = 0; l < kLanes; ++l)
    above += bad[l] > kMargin * limit * static_cast<double>(most.of[l]);
  return above == static_cast<int>(kLanes);
}

/// Adds the weight of an edge, and the same, negative where its ends show different sides.
template <std::size_t kLanes>
GPUREG_ALWAYS_INLINE void add_edge(const Lanes<kLanes>& a, const Lanes<kLanes>& b, float weight,
                                   Lanes<kLanes>& all, Lanes<kLanes>& signed_sum) {
  const float size = std::fabs(weight);
#pragma omp simd
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float here = size * std::min(std::fabs(a.of[l]), std::fabs(b.of[l]));
    all.of[l] += here;
    signed_sum.of[l] += std::copysign(here, a.of[l] * b.of[l] * weight);
  }
}

template <std::size_t kLanes>
GPUREG_ALWAYS_INLINE void count_in_lanes(const CountedEdges& counted, const Vec3* viewpoints,
                                         std::size_t count, double limit, double* shares) {
  const std::size_t points = counted.points.size();
  const std::unique_ptr<Lanes<kLanes>[]> towards(new Lanes<kLanes>[points]);
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::size_t here = std::min(kLanes, count - first);
    Lanes<kLanes> x, y, z;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Vec3& viewpoint = viewpoints[first + std::min(l, here - 1)];
      x.of[l] = viewpoint.x;
      y.of[l] = viewpoint.y;
      z.of[l] = viewpoint.z;
    }
    Lanes<kLanes> most{};
    for (std::size_t k = 0; k < points; ++k) {
      measure_cosines<kLanes>(counted.points[k], counted.normals[k], x, y, z, towards[k]);
      add_most<kLanes>(towards[k], counted.weight[k], most);
    }
    double bad[kLanes] = {0}, all[kLanes] = {0};
    bool beyond = false;
    for (std::size_t begin = 0; begin < counted.edges.size() && !beyond; begin += kFloatSums) {
      const std::size_t end = std::min(begin + kFloatSums, counted.edges.size());
      Lanes<kLanes> all_here{}, signed_here{};
      for (std::size_t k = begin; k < end; ++k) {
        const CountedEdges::Edge& e = counted.edges[k];
        add_edge<kLanes>(towards[e.a], towards[e.b], e.weight, all_here, signed_here);
      }
      for (std::size_t l = 0; l < kLanes; ++l) {
        bad[l] += 0.5 * static_cast<double>(all_here.of[l] - signed_here.of[l]);
        all[l] += static_cast<double>(all_here.of[l]);
      }
      if (end % kBetweenLimits == 0) beyond = all_above<kLanes>(bad, most, limit);
    }
    for (std::size_t l = 0; l < here; ++l)
      shares[first + l] = beyond       ? std::numeric_limits<double>::infinity()
                          : all[l] > 0 ? bad[l] / all[l]
                                       : 0.0;
  }
}

GPUREG_ALWAYS_INLINE void find_signs(Vec3 viewpoint, const std::vector<Vec3>& points,
                                     const std::vector<Vec3>& normals, std::int8_t* signs) {
  for (std::size_t i = 0; i < points.size(); ++i)
    signs[i] = dot(normals[i], viewpoint - points[i]) < 0 ? -1 : 1;
}

#ifdef GPUREG_HAS_VECTOR_TARGETS
/// Where the processor has no fused operations, each of them is the call of a function.
__attribute__((target("fma"))) void find_signs_fused(Vec3 viewpoint,
                                                     const std::vector<Vec3>& points,
                                                     const std::vector<Vec3>& normals,
                                                     std::int8_t* signs) {
  find_signs(viewpoint, points, normals, signs);
}

GPUREG_TARGET_16_LANES void count_in_16_lanes(const CountedEdges& counted, const Vec3* viewpoints,
                                              std::size_t count, double limit, double* shares) {
  count_in_lanes<16>(counted, viewpoints, count, limit, shares);
}
GPUREG_TARGET_8_LANES void count_in_8_lanes(const CountedEdges& counted, const Vec3* viewpoints,
                                            std::size_t count, double limit, double* shares) {
  count_in_lanes<8>(counted, viewpoints, count, limit, shares);
}
#endif

}  // namespace

std::size_t viewpoints_at_once() { return static_cast<std::size_t>(std::max(8, float_lanes())); }

void count_contradictions(const CountedEdges& counted, const Vec3* viewpoints, std::size_t count,
                          double limit, double* shares) {
#ifdef GPUREG_HAS_VECTOR_TARGETS
  if (float_lanes() == 16) return count_in_16_lanes(counted, viewpoints, count, limit, shares);
  if (float_lanes() == 8) return count_in_8_lanes(counted, viewpoints, count, limit, shares);
#endif
  count_in_lanes<8>(counted, viewpoints, count, limit, shares);
}

void find_signs_towards(Vec3 viewpoint, const std::vector<Vec3>& points,
                        const std::vector<Vec3>& normals, std::int8_t* signs) {
#ifdef GPUREG_HAS_VECTOR_TARGETS
  if (float_lanes() >= 8 && __builtin_cpu_supports("fma"))
    return find_signs_fused(viewpoint, points, normals, signs);
#endif
  find_signs(viewpoint, points, normals, signs);
}

}  // namespace gpureg
