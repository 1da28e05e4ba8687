// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pose_graph/problem.hpp"

namespace gpureg::pose_graph {

/// Takes the weight of every accepted loop that is a bridge (on no cycle of odometry and accepted
/// loops) and whose chosen mode has a smaller confidence than min_confidence. No cycle checks such
/// a loop: it fits perfectly, and its probability is still that of its prior.
void reject_unchecked(const Problem& problem, double min_confidence, Selection& selection);

}  // namespace gpureg::pose_graph
