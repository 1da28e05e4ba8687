// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "gpureg/calibration.hpp"

namespace gpureg::calibration {

/// Confidence of a result before any calibration: that its pose, or one that the clouds cannot tell
/// from it, is correct.
double confidence_of(const RegistrationResult& result);

/// Whether the pose of the result, or one that the clouds cannot tell from it, is the true one:
/// within an RMS distance over the points.
bool is_correct(const RegistrationResult& result, const Eigen::Isometry3d& truth,
                const std::vector<Eigen::Vector3f>& source_points, double max_rms);

/// Verdicts of loop consistency on pairs of different scans; none where it is not sure.
std::vector<std::optional<bool>> verdicts_of_loops(const std::vector<Pair>& pairs,
                                                   const std::vector<RegistrationResult>& results,
                                                   float voxel_size);

}  // namespace gpureg::calibration
