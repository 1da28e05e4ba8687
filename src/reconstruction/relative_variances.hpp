// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Variance of every point relative to one within the range, see RefineOptions::noise_range.
std::vector<float> relative_variances(const Surface& surface, double noise_range);

}  // namespace gpureg::reconstruction
