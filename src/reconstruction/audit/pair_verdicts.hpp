// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// A pair at its pose in a map, not judged yet.
AuditedPair pair_at(const Pair& pair, const std::vector<UnalignedIsometry3d>& world_from_scan);

/// What the evidence at a pose says.
/// @param refined where ICP moves the pair; null: it was not asked.
/// @param margin by which the map may be off, metres.
/// @param out scans and pose are given, the rest is filled in.
void judge_pair(const PoseVerification& given, const PoseVerification* refined, double margin,
                AuditedPair& out);

/// What the scans of each pair say about its pose. ICP moves those that contradict it: what goes
/// away within the margin of the map is none.
/// @param pairs scans and pose are given, the rest is filled in.
void judge_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const RegistrationOptions& registration, const AuditOptions& options,
                 std::vector<AuditedPair>& pairs);

}  // namespace gpureg::reconstruction
