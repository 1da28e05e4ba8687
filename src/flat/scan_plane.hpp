// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "pipeline/scan_plane.hpp"

namespace gpureg {

/// Recognises a scan of a 2-D scanner: all finite points lie in one plane, exactly but for
/// rounding, and they form curves in it. A floor or a wall that a 3-D sensor scanned is rough, or
/// fills its plane.
/// @param points rows of x, y, z in host memory.
/// @param stride floats from one row to the next.
/// @return the plane, without layers; nothing for every other cloud.
std::optional<ScanPlane> find_scan_plane(const float* points, std::size_t size, std::size_t stride);

}  // namespace gpureg
