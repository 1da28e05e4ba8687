// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/registration.hpp"
#include "settings/settings.hpp"

namespace gpureg {

/// Prepares copies of one cloud, multiplied by scales, for Engine::match() alone: without what
/// poses are verified by. Where nobody gave viewpoints, one copy decides about the sides of all.
/// @throws InvalidArgument as prepare_batch().
std::vector<PreparedCloud> prepare_copies(const Context& context,
                                          const std::vector<PointCloudView>& copies,
                                          const std::vector<double>& scales,
                                          const PrepareSettings& options);

}  // namespace gpureg
