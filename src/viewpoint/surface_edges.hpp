// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "common/thread_group.hpp"
#include "math/vec3.hpp"

namespace gpureg {

/// Two neighbouring points, a < b.
struct SurfaceEdge {
  std::uint32_t a, b;
  float cosine;  ///< of the angle between the normals
};

/// Each point with its nearest neighbours, every pair once, in ascending order of (a, b). The
/// result does not depend on the number of threads.
/// @param normals unit vectors; points with a zero normal have no neighbours.
/// @param radius largest distance of neighbours, in the unit of the points.
std::vector<SurfaceEdge> surface_edges(const std::vector<Vec3>& points,
                                       const std::vector<Vec3>& normals, float radius,
                                       ThreadGroup& threads);

}  // namespace gpureg
