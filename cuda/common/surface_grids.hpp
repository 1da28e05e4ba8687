// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "algorithm/surface_sums.hpp"
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// Search tables of consecutive surfaces.
struct SurfaceGrids {
  DeviceBuffer<SurfaceCell> table;
  DeviceBuffer<SurfacePoint> points;
  DeviceBuffer<SurfaceNormal> normals;
  DeviceBuffer<SurfaceGridView> views;
};

/// on_host: sizes and boxes; on_device: the same with device pointers.
SurfaceGrids build_surface_grids(Exec& exec, Span<const SurfaceArrays> on_host,
                                 const SurfaceArrays* on_device, float distance);

/// Adds up the pairs. grids: of the surfaces from number first_target on. sums: zero before.
void add_up_surfaces(Exec& exec, const SurfaceArrays* surfaces, const SurfaceGrids& grids,
                     std::uint32_t first_target, const SurfacePairInput* pairs, std::size_t count,
                     std::uint32_t most_points, const SurfaceTerms& terms, SurfaceSums* sums);

}  // namespace gpureg::cuda
