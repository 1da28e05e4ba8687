// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "algorithm/closest.hpp"
#include "common/limits.hpp"
#include "common/shown.hpp"
#include "gpureg/error.hpp"
#include "settings/settings.hpp"

/// Errors of clouds that cannot be prepared: the same limits and messages on every backend.
namespace gpureg::pipeline {

/// The voxel size, for messages.
inline std::string resolution_of(const PrepareSettings& options) {
  return options.voxel_size > 0 ? "voxel_size " + shown(options.voxel_size)
                                : "voxel_size 0, which keeps every point,";
}

/// Throws where the cells of a structure exceed the range of their keys; the structure with the
/// smallest cells decides. radius: of the points about the local origin.
inline void check_extent(float radius, const PrepareSettings& options) {
  float cell = options.feature_radius * 0.5f;
  if (options.voxel_size > 0 && options.voxel_size < cell) cell = options.voxel_size;
  const float blocks =
      options.max_correspondence_distance / 3.0f * static_cast<float>(ClosestGridView::kBlockEdge);
  if (blocks < cell) cell = blocks;
  if (!(radius < cell * (static_cast<float>(kCellBias) - 8.0f)))
    throw InvalidArgument("point cloud reaches " + shown(radius) +
                          " from its centre, more than 2^20 cells of " + shown(cell) + ": " +
                          resolution_of(options) +
                          " is too small for it, or it holds stray points");
}

/// Throws for clouds that are too dense or too sparse for the radii. Cells are half a feature
/// radius wide, so a thousand points in one mean many thousands within the radius; such
/// neighbourhoods make features meaningless and take hours. A large cloud of isolated points
/// (millimetres, and a voxel size in metres) has nothing to align, but its closest-point grid
/// exhausts the memory. squares: sum over the cells of their squared number of points.
inline void check_density(double squares, std::size_t points, const PrepareSettings& options) {
  const double per_cell = points == 0 ? 0 : squares / static_cast<double>(points);
  if (per_cell > limits::kMaxPointsPerCell)
    throw InvalidArgument("on average more than " + std::to_string(static_cast<long>(per_cell)) +
                          " points lie within feature_radius " + shown(options.feature_radius) +
                          " of each other: use a larger voxel_size or a smaller radius");
  if (points > limits::kMaxIsolatedPoints && per_cell < limits::kIsolatedPointsPerCell &&
      options.max_correspondence_distance < 0.5f * options.feature_radius)
    throw InvalidArgument(
        "nearly all of " + std::to_string(points) +
        " points are isolated within half of feature_radius " + shown(options.feature_radius) +
        ": " + resolution_of(options) +
        " or the radii are too small for the cloud; are they in the unit of the points?");
}

/// True where a closest-point grid has more candidates than a cloud of so many points may need.
inline bool too_many_candidates(std::uint64_t candidates, std::uint64_t points) {
  return candidates > limits::kMaxGridCandidates &&
         (candidates > limits::kMaxCandidatesPerPoint * points ||
          candidates >= limits::kMaxMapCandidates);
}

/// For a grid with too_many_candidates() or a block with more than limits::kMaxBlockCandidates:
/// downsampling is the remedy, not memory.
[[noreturn]] inline void throw_too_dense(float search_distance) {
  throw InvalidArgument("point cloud is too dense for max_correspondence_distance " +
                        shown(search_distance) + ": prepare it with voxel_size > 0");
}

}  // namespace gpureg::pipeline
