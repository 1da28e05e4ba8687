// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/verification.hpp"

namespace gpureg::cli {

/// Poses of a text file: 4 x 4 matrices row by row, or 16 numbers a line, or the blocks of a
/// Redwood log. What follows a # is a comment. @throws IoError naming file and line: more or less
/// numbers, a matrix that is no rigid motion, as a transposed one.
std::vector<UnalignedIsometry3d> read_initial_poses(const std::string& path);

/// The only pose of such a file. @throws IoError.
UnalignedIsometry3d read_pose(const std::string& path);

/// The verified poses as a result: modes in descending order of their confidence, aligned where the
/// first reaches min_confidence.
RegistrationResult result_of(const std::vector<PoseVerification>& poses, double min_confidence,
                             std::uint32_t source_points, std::uint32_t target_points);

}  // namespace gpureg::cli
