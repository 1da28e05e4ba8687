// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// Relative poses of islands that too few sure pairs connect, where an audit of the joined islands
/// confirms them. For each two islands, the poses that most pairs between them agree on are tried.
/// @param results belong to the pairs, as for reconstruct_from_poses().
/// @param refined pairs whose poses an audit has refined: they suggest poses, too.
/// @param map of these pairs; its islands are taken as rigid.
/// @return one for each two islands that are joined, as odometry.
std::vector<Odometry> confirmed_joins(const Context& context,
                                      const std::vector<PreparedCloud>& clouds,
                                      const std::vector<Pair>& pairs,
                                      const std::vector<RegistrationResult>& results,
                                      const std::vector<AuditedPair>& refined,
                                      const Reconstruction& map, const Options& reconstruction,
                                      const RegistrationOptions& registration,
                                      const AuditOptions& options);

}  // namespace gpureg::reconstruction
