// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/pose_graph/graph.hpp"
#include "gpureg/pose_graph/result.hpp"

namespace gpureg::pose_graph {

/// The rotation part of a g2o file's information matrices.
enum class G2oRotation {
  quaternion_vector,  ///< half an angle per unit: g2o's own EDGE_SE3:QUAT
  angle               ///< radians: GTSAM's readG2o and writeG2o, and many published data sets
};

/// Reads a g2o text file: VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX; '#' begins a comment.
///
/// g2o has no kinds of edges: an edge of consecutive ids (k, k + 1) becomes odometry, any other a
/// loop. g2o's information is translation first; it is converted to Edge::information's order and
/// radians, to first order.
/// @throws IoError naming file, line and reason, also for any other tag.
Graph read_g2o(const std::string& path, G2oRotation rotation = G2oRotation::quaternion_vector);

/// Writes nodes, FIX lines and edges; an edge's first mode only.
///
/// @param result  if given, its poses and chosen modes are written and rejected loops left out.
/// @throws IoError if the file cannot be written.
/// @throws InvalidArgument for a node without a pose, an edge without information, a gravity factor
///   or a prior, which g2o's tags cannot say.
void write_g2o(const std::string& path, const Graph& graph, const Result* result = nullptr,
               G2oRotation rotation = G2oRotation::quaternion_vector);

/// Reads an Open3D PoseGraph (JSON). Nodes get the ids 0, 1, ...; an edge that is "uncertain" is a
/// loop, with its confidence; other edges are odometry.
/// @throws IoError naming file, line and reason.
Graph read_open3d(const std::string& path);

/// Writes an Open3D PoseGraph (JSON). Nodes must have the ids 0, 1, ..., as Open3D refers to nodes
/// by position.
/// @param result  as for write_g2o.
/// @throws IoError if the file cannot be written.
/// @throws InvalidArgument as write_g2o().
void write_open3d(const std::string& path, const Graph& graph, const Result* result = nullptr);

}  // namespace gpureg::pose_graph
