// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/verification.hpp"

namespace gpureg::cli {

/// Poses of a text file: 4 x 4 matrices row by row, separated by anything blank, or the blocks of a
/// Redwood log. Lines that begin with # are comments. Throws IoError naming file and line.
std::vector<UnalignedIsometry3d> read_initial_poses(const std::string& path);

/// The verified poses as a result: modes in descending order of their confidence, aligned where the
/// first reaches min_confidence.
RegistrationResult result_of(const std::vector<PoseVerification>& poses, double min_confidence);

}  // namespace gpureg::cli
