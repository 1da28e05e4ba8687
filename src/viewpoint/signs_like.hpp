// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"
#include "viewpoint/surface_graph.hpp"

namespace gpureg {

/// A surface in the memory of the host and where its cloud is.
struct PlacedSurface {
  const PointsAndNormals& surface;
  const float (&origin)[3];
};

/// Sides of a copy of a cloud, from those of another copy.
/// @param factor of the copy's coordinates to those of the other one.
/// @param reach of a point's side, in the unit of the copy.
SurfaceGraph::Signs signs_like(const PlacedSurface& other, const SurfaceGraph::Signs& signs,
                               const PlacedSurface& copy, double factor, float reach);

}  // namespace gpureg
