// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// Raw clouds to prepared clouds, one statement per stage (LoopSmart, section III).
/// Argument-dependent look-up by Exec finds the stages of a backend; assemble() waits for the
/// results.
/// @param watch called with the points and the normals once they are there.
template <typename Exec, typename Watch>
auto prepare(Exec& exec, Span<const RawCloud> clouds, const PrepareSettings& options,
             const Watch& watch) {
  const auto begin = exec.mark();
  auto points = downsample(exec, clouds, options);
  const auto downsampled = exec.mark();
  auto grids = build_grids(exec, points, options);
  const auto gridded = exec.mark();
  auto normals = estimate_normals(exec, points, grids, options.normal_radius);
  watch(exec, points, normals);
  const auto oriented = exec.mark();
  auto features = compute_features(exec, points, normals, grids, options);
  auto wide_features = compute_wide_features(exec, points, grids, options);
  const auto widened = exec.mark();
  auto closest = build_closest_grids(exec, points, grids, options);
  const auto searchable = exec.mark();
  auto depth_maps = build_depth_maps(exec, clouds, points, options);
  const auto mapped = exec.mark();
  auto surface_sides = build_surface_sides(exec, points, normals, options);
  const auto fronted = exec.mark();
  auto prepared = assemble(exec, points, normals, features, wide_features, closest, depth_maps,
                           surface_sides, options);

  const double share = 1.0 / static_cast<double>(clouds.size);
  for (auto& cloud : prepared) {
    PrepareStatistics& ms = cloud->statistics;
    ms.downsample = exec.milliseconds(begin, downsampled) * share;
    ms.normals = exec.milliseconds(gridded, oriented) * share;
    ms.features = exec.milliseconds(oriented, widened) * share;
    ms.grid =
        (exec.milliseconds(downsampled, gridded) + exec.milliseconds(widened, searchable)) * share;
    ms.depth_maps = exec.milliseconds(searchable, mapped) * share;
    ms.surface_sides = exec.milliseconds(mapped, fronted) * share;
  }
  return prepared;
}

template <typename Exec>
auto prepare(Exec& exec, Span<const RawCloud> clouds, const PrepareSettings& options) {
  return prepare(exec, clouds, options, [](const auto&...) {});
}

}  // namespace gpureg::pipeline
