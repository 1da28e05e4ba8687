// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

/// True where a cloud looks as if a scanner at this place had made it: it has one return in each
/// direction, so neighbours in direction are on one surface more often about its position than
/// about places beside it. Holds for thinned scans, too.
/// @param viewpoint relative to the rows.
bool has_one_return_per_direction(const RawCloud& rows, Vec3 viewpoint);

}  // namespace gpureg
