// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "algorithm/closest.hpp"
#include "gpureg/error.hpp"
#include "gpureg/options.hpp"

/// What makes a cloud impossible to prepare: the same limits and words on every backend.
namespace gpureg::pipeline {

/// Cells of every structure that will be built must fit their keys; the smallest of them decides.
/// radius: of the points about the local origin.
inline void check_extent(float radius, const PrepareOptions& options) {
  float cell = options.feature_radius * 0.5f;
  if (options.voxel_size > 0 && options.voxel_size < cell) cell = options.voxel_size;
  const float blocks =
      options.max_correspondence_distance / 3.0f * static_cast<float>(ClosestGridView::kBlockEdge);
  if (blocks < cell) cell = blocks;
  if (!(radius < cell * (static_cast<float>(kCellBias) - 8.0f)))
    throw InvalidArgument("point cloud reaches " + std::to_string(radius) +
                          " from its centre, more than 2^20 cells of " + std::to_string(cell) +
                          ": voxel_size " + std::to_string(options.voxel_size) +
                          " is too small for it, or it holds stray points");
}

/// Cells are half a radius wide, so a thousand points in one mean many thousands within the radius:
/// such neighbourhoods make features meaningless and take hours. And where nearly all of very many
/// points are alone in theirs, farther from each other than alignment will ever look, as
/// millimetres are with a voxel in metres, there is nothing to align, but the closest-point grid
/// would take some 20 KB a point. Better an error at once. squares: sum over the cells of their
/// squared number of points.
inline void check_density(double squares, std::size_t points, const PrepareOptions& options) {
  const double per_cell = points == 0 ? 0 : squares / static_cast<double>(points);
  if (per_cell > 1000)
    throw InvalidArgument("on average more than " + std::to_string(static_cast<long>(per_cell)) +
                          " points lie within feature_radius " +
                          std::to_string(options.feature_radius) +
                          " of each other: use a larger voxel_size or a smaller radius");
  constexpr std::size_t kMaxLonely = 20000;
  if (points > kMaxLonely && per_cell < 1.1 &&
      options.max_correspondence_distance < 0.5f * options.feature_radius)
    throw InvalidArgument(
        "nearly all of " + std::to_string(points) +
        " points are alone within half of feature_radius " +
        std::to_string(options.feature_radius) + ": voxel_size " +
        std::to_string(options.voxel_size) +
        " or the radii are too small for the cloud; are they in the unit of the points?");
}

/// Lists this long mean millions of points within one search distance of each other; downsampling
/// is the answer, not memory.
constexpr std::size_t kMaxCandidates = std::size_t(1) << 28;
constexpr std::size_t kMaxBlockCandidates = std::size_t(1) << 24;

[[noreturn]] inline void throw_too_dense(float search_distance) {
  throw InvalidArgument("point cloud is too dense for search_distance " +
                        std::to_string(search_distance) + ": prepare it with voxel_size > 0");
}

}  // namespace gpureg::pipeline
