// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/registration.hpp"

namespace gpureg::reconstruction {

/// Pairs of scans that are near each other, by the places that their points and their lines of
/// sight take up: a grid finds them, time grows with their number.
/// @param world_from_scan a pose that is not finite, and an empty handle: left out.
/// @param islands scans of different ones are no pair; empty: all are of one.
/// @param most pairs of one scan; a pair stays if either scan keeps it.
/// @return ascending.
std::vector<Pair> near_pairs(const std::vector<PreparedCloud>& clouds,
                             const std::vector<UnalignedIsometry3d>& world_from_scan,
                             const std::vector<std::uint32_t>& islands, std::uint32_t most);

}  // namespace gpureg::reconstruction
