// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "algorithm/closest_build.hpp"

namespace gpureg::cpu {

/// Keys of all blocks of a closest-point grid with a location within the search distance of a
/// point, ascending. least_keys: duplicates are removed in between from so many keys on.
std::vector<std::uint64_t> reachable_blocks(const std::vector<Vec3>& points,
                                            const ClosestGeometry& geometry,
                                            std::size_t least_keys);

}  // namespace gpureg::cpu
