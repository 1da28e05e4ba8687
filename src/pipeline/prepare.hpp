// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// Raw clouds to fragments, one statement per stage (LoopSmart, section III). Exec brings the stages, found by its namespace.
template <typename Exec>
auto prepare(Exec& exec, Span<const RawCloud> clouds, const PrepareOptions& options) {
  exec.start_clock();
  auto points = downsample(exec, clouds, options);
  const double downsample_ms = exec.lap();
  auto grids = build_grids(exec, points, options);
  const double grid_ms = exec.lap();
  auto normals = estimate_normals(exec, points, grids, options);
  const double normals_ms = exec.lap();
  auto features = compute_features(exec, points, normals, grids, options);
  const double features_ms = exec.lap();
  auto closest = build_closest_grids(exec, points, grids, options);
  const double closest_ms = exec.lap();

  auto prepared = assemble(exec, points, normals, features, closest, options);
  for (auto& cloud : prepared) {
    const double share = 1.0 / static_cast<double>(clouds.size);
    cloud->statistics.downsample = downsample_ms * share;
    cloud->statistics.normals = normals_ms * share;
    cloud->statistics.features = features_ms * share;
    cloud->statistics.grid = (grid_ms + closest_ms) * share;
  }
  return prepared;
}

}  // namespace gpureg::pipeline
