// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

/// Ratio of the upper to the lower quartile of the distances from points to their nearest
/// neighbours; 1 for a regular grid.
struct SpacingSpread {
  double plain = 1;   ///< of the distances
  double radial = 1;  ///< of the distances divided by the range from a viewpoint
};

/// Spread of the spacing about a viewpoint, from a sample of the rows. A scanner samples
/// directions: about its position, and nowhere else, the distance of neighbours grows with the
/// range.
/// @param viewpoint relative to the rows.
SpacingSpread spacing_spread(const RawCloud& rows, Vec3 viewpoint);

}  // namespace gpureg
