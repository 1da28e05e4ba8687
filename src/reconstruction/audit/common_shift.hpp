// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// Whether a scan is of the one part.
using ScansBelow = std::function<bool(std::uint32_t)>;

/// ICP moves the pairs of a right map by centimetres, each in its own direction. Where one part of
/// a map lies off, it moves all pairs between the parts by one motion, also if that is within the
/// margin of each.
/// @param across pairs between two parts.
/// @param noise RMS of what ICP finds in a right map, metres.
/// @return for each pair the logarithm of: how much less likely its shift is with such a motion;
///   empty: there is none.
std::vector<double> common_shift(const std::vector<AuditedPair>& pairs,
                                 const std::vector<std::size_t>& across, const ScansBelow& below,
                                 const std::vector<UnalignedIsometry3d>& world_from_scan,
                                 double noise);

}  // namespace gpureg::reconstruction
