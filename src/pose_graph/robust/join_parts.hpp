// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pose_graph/robust/robust.hpp"

namespace gpureg::pose_graph {

/// Moves the parts that odometry and accepted loops leave apart, each as a rigid body, to where
/// most loops between them agree: the pair of parts with the most support first, then what it has
/// become with the others. The loops that agree are accepted. Least squares over all loops would
/// bend the parts by the wrong ones, and its matrix is dense.
/// @param known nodes that keep their pose: one part.
/// @param asked loops that have a say.
/// @return whether a part was moved.
bool join_parts(const Problem& problem, const std::vector<char>& known,
                const std::vector<char>& asked, double quantile, Estimate& estimate);

}  // namespace gpureg::pose_graph
