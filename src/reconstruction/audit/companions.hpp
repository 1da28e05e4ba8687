// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// Two pairs that share a scan imply the pose of the two other scans, whether or not anybody
/// registered these: if they contradict it, one of the two pairs is wrong. Changes the confidences
/// of the first modes accordingly. A false pose at equal furniture is found before it bends a map.
/// @throws InvalidArgument as verify_poses_batch(); pairs that name no cloud are left to
///   reconstruct().
void hear_companions(const Context& context, const std::vector<PreparedCloud>& clouds,
                     const std::vector<Pair>& pairs, const RegistrationOptions& registration,
                     const AuditOptions& options, std::vector<RegistrationResult>& results);

}  // namespace gpureg::reconstruction
