// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace gpureg::io {

/// Rows that are enough to tell poses from points.
inline constexpr std::size_t kPoseRows = 12;

/// What the first rows of a text are, where they are poses and no points: rotations of a 4 x 4
/// matrix, unit quaternions. Empty for points.
std::string poses_in(const std::vector<std::vector<double>>& rows);

}  // namespace gpureg::io
