// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

namespace gpureg::cli {

/// Four lines that read back as the pose, to a few micrometres also where the coordinates that it
/// moves are those of a map: 12 decimals of the rotation, 6 of the translation.
std::string pose_text(const Eigen::Matrix4d& pose);

}  // namespace gpureg::cli
