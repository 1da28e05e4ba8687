// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/visibility.hpp"
#include "cpu/common/wide_vectors.hpp"
#include "math/rigid.hpp"

namespace gpureg::cpu {

/// Observations of 64 locations, one bit each; the union over several maps.
struct Observations {
  std::uint64_t observed = 0, violating = 0, surface = 0;
};

/// Incidence weights of 64 locations, the maximum over several maps; see incidence().
struct Incidences {
  alignas(32) float observed[64] = {};
  alignas(32) float violating[64] = {};
};

/// 64 points moved by a pose, one array per coordinate.
struct MovedGroup {
  static constexpr int kSize = 64;
  alignas(32) float x[kSize], y[kSize], z[kSize];

  Vec3 at(int k) const { return {x[k], y[k], z[k]}; }
  void turn(const Rigid& pose, const float* nx, const float* ny, const float* nz) {
    for (int k = 0; k < kSize; ++k) {
      const Vec3 n = rotate(pose, {nx[k], ny[k], nz[k]});
      x[k] = n.x;
      y[k] = n.y;
      z[k] = n.z;
    }
  }
  void move(const Rigid& pose, const float* px, const float* py, const float* pz) {
    for (int k = 0; k < kSize; ++k) {
      const Vec3 q = apply(pose, {px[k], py[k], pz[k]});
      x[k] = q.x;
      y[k] = q.y;
      z[k] = q.z;
    }
  }
};

/// add_observations() with the vectors of the caller's target.
template <typename Mask>
GPUREG_ALWAYS_INLINE void add_observations_in_vectors(const VisibilityView& maps, std::uint32_t map,
                                                      const MovedGroup& locations, float margin,
                                                      float min_range, Observations& s,
                                                      const MovedGroup* normals,
                                                      Incidences* incidences) {
  constexpr int kSize = MovedGroup::kSize;
  alignas(32) float ray[kSize], depth[kSize];
  alignas(32) std::uint32_t cell[kSize];
  alignas(32) std::uint32_t steps[kSize];
  const Vec3 viewpoint = maps.viewpoints[map];
  for (int k = 0; k < kSize; ++k) {
    const MapRay r = map_ray(locations.at(k) - viewpoint);
    ray[k] = r.depth;
    cell[k] = r.cell;
  }
  const std::uint16_t* depths = maps.depth + static_cast<std::size_t>(map) * kMapCells;
  for (int k = 0; k < kSize; ++k) steps[k] = depths[cell[k]];
  for (int k = 0; k < kSize; ++k)
    depth[k] = static_cast<float>(static_cast<std::int32_t>(steps[k])) * maps.step;
  // One byte for each location and comparison.
  alignas(64) std::uint8_t known[kSize], before[kSize], behind[kSize];
  for (int k = 0; k < kSize; ++k) {
    known[k] = (ray[k] > min_range) & (steps[k] != kUnknownDepth);
    before[k] = ray[k] < depth[k] - margin;
    behind[k] = ray[k] > depth[k] + margin;
  }
  const std::uint64_t is_known = Mask::of(known), is_before = Mask::of(before),
                      is_behind = Mask::of(behind);
  if (incidences) {
    alignas(32) float weight[kSize];
    for (int k = 0; k < kSize; ++k)
      weight[k] = incidence(normals->at(k), locations.at(k) - viewpoint);
    for (int k = 0; k < kSize; ++k) {
      const float observed = known[k] ? weight[k] : 0.0f;
      const float violating = known[k] & before[k] ? weight[k] : 0.0f;
      incidences->observed[k] =
          observed > incidences->observed[k] ? observed : incidences->observed[k];
      incidences->violating[k] =
          violating > incidences->violating[k] ? violating : incidences->violating[k];
    }
  }
  s.observed |= is_known;
  s.violating |= is_known & is_before;
  s.surface |= is_known & ~is_before & ~is_behind;
}

#ifdef GPUREG_WIDE_TARGET
GPUREG_WIDE_TARGET inline void add_observations_wide(const VisibilityView& maps, std::uint32_t map,
                                                     const MovedGroup& locations, float margin,
                                                     float min_range, Observations& s,
                                                     const MovedGroup* normals,
                                                     Incidences* incidences) {
  add_observations_in_vectors<WideMask>(maps, map, locations, margin, min_range, s, normals,
                                        incidences);
}
#endif

/// observe() of one map for all locations, added to s, in vectorised loops. normals: moved like the
/// locations; read only with incidences.
inline void add_observations(const VisibilityView& maps, std::uint32_t map,
                             const MovedGroup& locations, float margin, float min_range,
                             Observations& s, const MovedGroup* normals = nullptr,
                             Incidences* incidences = nullptr) {
#ifdef GPUREG_WIDE_TARGET
  if (has_wide_vectors())
    return add_observations_wide(maps, map, locations, margin, min_range, s, normals, incidences);
#endif
  add_observations_in_vectors<NarrowMask>(maps, map, locations, margin, min_range, s, normals,
                                          incidences);
}

}  // namespace gpureg::cpu
