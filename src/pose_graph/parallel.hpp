// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

/// Threads of the solver. Which thread does what never changes a result.
namespace gpureg::pose_graph {

/// Calls body(begin, end) for consecutive ranges that cover [0, count). Ranges of fewer edges or
/// nodes than the default of shortest_range take less time than starting a thread.
void for_ranges(int count, int threads, const std::function<void(int, int)>& body,
                int shortest_range = 512);

/// Calls body(node) for every node of a forest, children before parents; parent[node] > node or -1.
/// Returns false, and leaves nodes out, once a body has returned false.
bool for_each_bottom_up(const std::vector<int>& parent, int threads,
                        const std::function<bool(int)>& body);

}  // namespace gpureg::pose_graph
