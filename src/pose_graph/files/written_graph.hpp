// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gpureg/pose_graph/result.hpp"

namespace gpureg::pose_graph {

struct WrittenEdge {
  std::int64_t source = 0, target = 0;
  UnalignedIsometry3d target_from_source;
  UnalignedMatrix6d information;
  bool loop = false;
  double confidence = 0.5;
};

/// What a file holds of a graph: one pose per node, and of every edge that is not rejected the mode
/// that was chosen.
struct WrittenGraph {
  /// Throws InvalidArgument for what `format` cannot say, and for an invalid graph.
  WrittenGraph(const Graph& graph, const Result* result, const char* format);

  std::vector<UnalignedIsometry3d> poses;
  std::vector<WrittenEdge> edges;
};

/// Calls fail(reason) for a pose that Graph::validate would refuse.
void check_pose(const UnalignedIsometry3d& pose,
                const std::function<void(const std::string&)>& fail);
/// Calls fail(reason) for an information matrix that Graph::validate would refuse.
void check_information(const UnalignedMatrix6d& information,
                       const std::function<void(const std::string&)>& fail);

}  // namespace gpureg::pose_graph
