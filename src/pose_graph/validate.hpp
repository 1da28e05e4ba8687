// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/shown.hpp"
#include "gpureg/error.hpp"
#include "gpureg/pose_graph/graph.hpp"

namespace gpureg::pose_graph {

/// Coordinates and information beyond this overflow when squared and summed.
inline constexpr double kFarthest = 1e12;
inline constexpr double kLargestInformation = 1e18;

/// Throws InvalidArgument "field is value, expected ...".
void require(bool good, const std::string& field, double value, const char* expected);

/// What Graph::validate() asks of poses, information matrices and confidences.
void require_pose(const UnalignedIsometry3d& pose, const std::string& name);
void require_information(const UnalignedMatrix6d& information, const std::string& name);
void require_confidence(double confidence, const std::string& name);

}  // namespace gpureg::pose_graph
