// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"
#include "reconstruction/audit/common_shift.hpp"

namespace gpureg::reconstruction {

/// An edge of a graph that holds two scans together.
struct Bond {
  std::uint32_t a = 0, b = 0;
  double confidence = 0;
};

/// From the verdicts of pairs to those of connections: along the most supported spanning tree of
/// each island, and between the parts of an island that nothing supports.
/// @param islands of each scan; scans of kNoIsland are left out.
/// @param bonds edges of the graph; empty: none is known. Their own pairs support nothing more.
/// Time and memory grow with the number of scans and of pairs.
/// @param world_from_scan in the frame of each island; empty: no common shift is looked for.
/// @param audit its pairs are given, connections, order and islands are filled in. Pairs across a
/// connection
///   that a common shift contradicts get their share of it.
void judge_connections(const std::vector<std::uint32_t>& islands, const std::vector<Bond>& bonds,
                       const std::vector<UnalignedIsometry3d>& world_from_scan,
                       const AuditOptions& options, Audit& audit);

/// What pairs between two parts say together, as of judge_connections(): the logarithm of how much
/// more likely they are if the parts lie right to each other.
/// @param below says of a scan whether it is of the one part.
double log_odds_between(const std::vector<AuditedPair>& pairs, const ScansBelow& below,
                        const std::vector<UnalignedIsometry3d>& world_from_scan,
                        const AuditOptions& options);

constexpr std::uint32_t kNoIsland = 0xffffffffu;

}  // namespace gpureg::reconstruction
