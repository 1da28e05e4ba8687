// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// The options with max_shift in the unit of the points.
AuditOptions in_units(const AuditOptions& options, float voxel_size);

/// audit() by options in units.
Audit audit_in_units(const Context& context, const std::vector<PreparedCloud>& clouds,
                     const Reconstruction& map, const RegistrationOptions& registration,
                     const AuditOptions& options);

/// reconstruct() by options in units.
AuditedReconstruction reconstruct_in_units(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
    const Options& options, const std::vector<Odometry>& odometry,
    const RegistrationOptions& registration, const AuditOptions& audit_options);

}  // namespace gpureg::reconstruction
