// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/span.hpp"
#include "math/vec3.hpp"

namespace gpureg {

// Free space as observed from a cloud's viewpoints: a cube of depth maps around each. A point of
// another cloud between a viewpoint and the surface that it observed violates free space.

/// Cells along an edge of a cube face: about 1/60 rad each.
constexpr int kMapEdge = 96;
constexpr std::uint32_t kMapFace = kMapEdge * kMapEdge;
constexpr std::uint32_t kMapCells = 6 * kMapFace;
constexpr std::uint16_t kMaxDepth = 65534, kUnknownDepth = 65535;

/// Cell of a cube map, and the depth: the largest coordinate.
struct MapRay {
  std::uint32_t cell;
  float depth;
};

/// Row or column of a face. Clamped before the conversion, which not every float survives: the
/// difference of two finite points may be infinite.
GPUREG_HD std::int32_t map_row(float v) {
  constexpr float kLast = static_cast<float>(kMapEdge - 1);
  return static_cast<std::int32_t>(v > 0.0f ? (v < kLast ? v : kLast) : 0.0f);
}

/// d: from the viewpoint to the point. A point nearer than kLeastDepth counts as that far
/// away, because its scale would overflow.
GPUREG_HD MapRay map_ray(Vec3 d) {
  constexpr float kLeastDepth = 1e-30f;
  const float ax = d.x < 0 ? -d.x : d.x, ay = d.y < 0 ? -d.y : d.y, az = d.z < 0 ? -d.z : d.z;
  const bool is_x = (ax >= ay) & (ax >= az), is_y = !is_x & (ay >= az);
  const float depth = is_x ? ax : is_y ? ay : az;
  const float along = is_x ? d.x : is_y ? d.y : d.z;
  const float u = is_x ? d.y : d.x, v = is_x | is_y ? d.z : d.y;
  const float scale =
      0.5f * static_cast<float>(kMapEdge) / (depth > kLeastDepth ? depth : kLeastDepth);
  const float half = 0.5f * static_cast<float>(kMapEdge);
  const std::int32_t column = map_row(fmaf(u, scale, half)), row = map_row(fmaf(v, scale, half));
  const std::uint32_t face = (is_x ? 0u : is_y ? 2u : 4u) + (along < 0 ? 1u : 0u);
  return {face * kMapFace + static_cast<std::uint32_t>(row * kMapEdge + column), depth};
}

/// Depth in steps of the maps; greater depths clamp to the largest known one.
GPUREG_HD std::uint16_t map_depth(float depth, float inverse_step) {
  const float steps = depth * inverse_step;
  return steps < static_cast<float>(kMaxDepth) ? static_cast<std::uint16_t>(steps) : kMaxDepth;
}

/// Nearest depth among the 3 x 3 cells around a known cell of the same face: a point before it is
/// in front of all their surfaces. Depth: 16 bits, or wider with the value in the lowest 16.
template <typename Depth>
GPUREG_HD std::uint16_t eroded_depth(const Depth* map, std::uint32_t cell) {
  std::uint16_t nearest = static_cast<std::uint16_t>(map[cell]);
  if (nearest == kUnknownDepth) return nearest;
  const std::int32_t in_face = static_cast<std::int32_t>(cell % kMapFace);
  const Depth* face = map + (cell - static_cast<std::uint32_t>(in_face));
  const std::int32_t row = in_face / kMapEdge, column = in_face % kMapEdge;
  for (std::int32_t r = row > 0 ? row - 1 : 0; r <= row + 1 && r < kMapEdge; ++r)
    for (std::int32_t c = column > 0 ? column - 1 : 0; c <= column + 1 && c < kMapEdge; ++c) {
      const std::uint16_t depth = static_cast<std::uint16_t>(face[r * kMapEdge + c]);
      nearest = depth < nearest ? depth : nearest;
    }
  return nearest;
}

/// Number of depth maps of a cloud. A cloud with input normals and without viewpoints gets none:
/// its sensor position is unknown.
GPUREG_HD std::size_t map_count(std::size_t viewpoints, std::size_t wanted, bool viewpoints_given,
                                bool normals_given) {
  if (!viewpoints_given && normals_given) return 0;
  return viewpoints < wanted ? viewpoints : wanted;
}

/// Viewpoint, of `known` ones, of map k of `count`: evenly spread over their order, including the
/// first and the last.
GPUREG_HD std::size_t chosen_viewpoint(std::size_t k, std::size_t count, std::size_t known) {
  return count > 1 ? k * (known - 1) / (count - 1) : 0;
}

/// Length of a step of depth: 1/32 voxel, so the 65,534 steps cover two thousand voxels.
GPUREG_HD float depth_step(float voxel_size) { return voxel_size * 0.03125f; }

/// Maps of one cloud: viewpoints x kMapCells depths, each the nearest within its 3 x 3 cells of the
/// face; unknown where nothing was observed.
struct VisibilityView {
  const std::uint16_t* depth;
  const Vec3* viewpoints;  ///< in the cloud's local frame
  std::uint32_t count;
  float step;  ///< length of one step of depth
};

/// Result of comparing a location with one depth map.
enum class Observation : std::uint32_t { unknown = 0, occluded = 1, surface = 2, free_space = 3 };

/// Incidence weight of an observation: the squared cosine between the surface normal and the line
/// of sight, in 16-bit fixed point. At a grazing angle an error of centimetres in pose or depth
/// moves a surface in front of or behind another one, so grazing observations get a small weight.
/// d: along the line of sight, not zero.
constexpr float kIncidenceScale = 65536.0f;
/// Incidence weight of a point without normal: the mean over all directions.
constexpr float kUnknownIncidence = 1.0f / 3.0f;
GPUREG_HD float incidence(Vec3 normal, Vec3 d) {
  const float along = dot(normal, d);
  return is_zero(normal) ? kUnknownIncidence : along * along / squared_norm(d);
}
GPUREG_HD std::uint32_t fixed_incidence(float incidence) {
  return static_cast<std::uint32_t>(incidence * kIncidenceScale);
}

/// Compares a location with one depth map. margin: distance in front of or behind the observed
/// surface that still counts as on it. Locations nearer to the viewpoint than min_range are
/// unknown.
GPUREG_HD Observation observe(const VisibilityView& maps, std::uint32_t map, Vec3 p, float margin,
                              float min_range) {
  const MapRay ray = map_ray(p - maps.viewpoints[map]);
  if (!(ray.depth > min_range)) return Observation::unknown;
  const std::uint16_t steps = maps.depth[static_cast<std::size_t>(map) * kMapCells + ray.cell];
  if (steps == kUnknownDepth) return Observation::unknown;
  const float depth = static_cast<float>(steps) * maps.step;
  if (ray.depth < depth - margin) return Observation::free_space;
  return ray.depth > depth + margin ? Observation::occluded : Observation::surface;
}

}  // namespace gpureg
