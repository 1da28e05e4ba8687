// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/visibility.hpp"
#include "math/rigid.hpp"

namespace gpureg::cpu {

/// How 64 places are seen, one bit each; of several maps the union.
struct Sights {
  std::uint64_t seen = 0, before = 0, surface = 0;
};

/// How squarely 64 places face those that see them, at best; see facing().
struct Facings {
  alignas(32) float seen[64] = {};
  alignas(32) float before[64] = {};
};

/// 64 points moved by a pose, one array per coordinate.
struct MovedGroup {
  static constexpr int kSize = 64;
  alignas(32) float x[kSize], y[kSize], z[kSize];

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

/// sight() of one map for all places, added to s; in steps that the compiler turns into vectors.
/// normals: turned like the places; asked for with facings only.
inline void add_sights(const VisibilityView& maps, std::uint32_t map, const MovedGroup& places,
                       float margin, float min_range, Sights& s,
                       const MovedGroup* normals = nullptr, Facings* facings = nullptr) {
  constexpr int kSize = MovedGroup::kSize;
  alignas(32) float ray[kSize], depth[kSize];
  alignas(32) std::uint32_t cell[kSize];
  alignas(32) std::uint32_t steps[kSize];
  const Vec3 viewpoint = maps.viewpoints[map];
  for (int k = 0; k < kSize; ++k) {
    const MapRay r = map_ray(Vec3{places.x[k], places.y[k], places.z[k]} - viewpoint);
    ray[k] = r.depth;
    cell[k] = r.cell;
  }
  const std::uint16_t* depths = maps.depth + static_cast<std::size_t>(map) * kMapCells;
  for (int k = 0; k < kSize; ++k) steps[k] = depths[cell[k]];
  for (int k = 0; k < kSize; ++k)
    depth[k] = static_cast<float>(static_cast<std::int32_t>(steps[k])) * maps.step;
  // One byte a place and question, then the bits of eight bytes at once.
  alignas(32) std::uint8_t known[kSize], before[kSize], behind[kSize];
  for (int k = 0; k < kSize; ++k) {
    known[k] = (ray[k] > min_range) & (steps[k] != kUnknownDepth);
    before[k] = ray[k] < depth[k] - margin;
    behind[k] = ray[k] > depth[k] + margin;
  }
  std::uint64_t is_known = 0, is_before = 0, is_behind = 0;
  for (int k = 0; k < kSize; ++k) {
    is_known |= static_cast<std::uint64_t>(known[k]) << k;
    is_before |= static_cast<std::uint64_t>(before[k]) << k;
    is_behind |= static_cast<std::uint64_t>(behind[k]) << k;
  }
  if (facings) {
    alignas(32) float squarely[kSize];
    for (int k = 0; k < kSize; ++k)
      squarely[k] = facing({normals->x[k], normals->y[k], normals->z[k]},
                           Vec3{places.x[k], places.y[k], places.z[k]} - viewpoint);
    for (int k = 0; k < kSize; ++k) {
      const float seen = known[k] ? squarely[k] : 0.0f;
      const float open = known[k] & before[k] ? squarely[k] : 0.0f;
      facings->seen[k] = seen > facings->seen[k] ? seen : facings->seen[k];
      facings->before[k] = open > facings->before[k] ? open : facings->before[k];
    }
  }
  s.seen |= is_known;
  s.before |= is_known & is_before;
  s.surface |= is_known & ~is_before & ~is_behind;
}

}  // namespace gpureg::cpu
