// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "gpureg/verification.hpp"
#include "settings/settings.hpp"

namespace gpureg {

/// verify_poses_batch() without matches of features, which the clouds need not have, and without
/// alternatives. confidence: of a pose by its evidence; it decides about unknown sides, too.
std::vector<std::vector<PoseVerification>> verify_by_surfaces(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<std::vector<UnalignedIsometry3d>>& poses,
    const RegistrationSettings& options, bool refine,
    const std::function<double(const PoseVerification&)>& confidence);

}  // namespace gpureg
