// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// What the scans of each pair say about its pose. ICP moves those that contradict it: what goes
/// away within the margin of the map is none.
/// @param pairs scans and pose are given, the rest is filled in.
void judge_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const RegistrationOptions& registration, const AuditOptions& options,
                 std::vector<AuditedPair>& pairs);

}  // namespace gpureg::reconstruction
