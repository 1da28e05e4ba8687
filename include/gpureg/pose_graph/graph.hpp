// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpureg/result.hpp"

namespace gpureg::pose_graph {

/// 6x6 without alignment, so that these structures have one layout for every processor.
using UnalignedMatrix6d = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// A pose to be estimated.
struct Node {
  std::int64_t id = 0;  ///< unique within the graph; any value
  /// p_world = world_from_node * p_node, metres. None: computed from the edges. A fixed node needs
  /// one.
  std::optional<UnalignedIsometry3d> world_from_node = std::nullopt;
  bool fixed = false;  ///< keeps its pose
};

/// odometry: trusted, always in the objective. loop: may be wrong, has a weight.
enum class EdgeKind { odometry, loop };

/// A further pose that a registration found plausible for the same pair.
struct EdgeMode {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  std::optional<UnalignedMatrix6d> information = std::nullopt;  ///< as Edge::information
  double confidence = 0.5;                                      ///< as Edge::confidence
};

/// A measured relative pose of two nodes.
///
/// Residual: e = Log(target_from_source^-1 * world_from_target^-1 * world_from_source), a 6-vector
/// of rotation (radians) first, then translation (metres), in the frame of the source node. Squared
/// error: e' * information * e. The same as GTSAM's BetweenFactor(target, source,
/// target_from_source, Gaussian::Information(information)).
struct Edge {
  std::int64_t source = 0;
  std::int64_t target = 0;
  /// p_target = target_from_source * p_source, metres.
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  /// Inverse covariance of e; symmetric, positive semi-definite, not zero; 1/rad^2, 1/(rad m),
  /// 1/m^2. None: Options::drift for odometry, Options::loop_noise for a loop.
  std::optional<UnalignedMatrix6d> information = std::nullopt;
  EdgeKind kind = EdgeKind::loop;
  /// Prior probability, in [0, 1], that this pose is correct; 0.5 says nothing. Not used for
  /// odometry.
  double confidence = 0.5;
  /// Further modes, loops only. At most one mode of an edge takes part in the objective at a time.
  std::vector<EdgeMode> alternatives = {};
};

/// The measured direction of "up" in the frame of one node, from an accelerometer, say. The world's
/// up is (0, 0, 1).
struct GravityFactor {
  std::int64_t node = 0;
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> up{0, 0, 1};  ///< node's frame, any length but 0
  double sigma_degrees = 1;  ///< standard deviation of the direction, > 0
};

/// What is known of one node's pose, from GNSS or a surveyed marker, say. Residual:
/// Log(world_from_node_prior^-1 * world_from_node), in the node's frame, rotation first.
struct PoseFactor {
  std::int64_t node = 0;
  UnalignedIsometry3d world_from_node = UnalignedIsometry3d::Identity();
  UnalignedMatrix6d information = UnalignedMatrix6d::Identity();  ///< as Edge::information
};

/// A pose graph: a plain value.
struct Graph {
  std::vector<Node> nodes;
  std::vector<Edge> edges;
  std::vector<GravityFactor> gravity;
  std::vector<PoseFactor> priors;

  /// Throws InvalidArgument naming the field, its place and its value: a repeated node id, an
  /// unknown id, an edge onto itself, a number that is not finite, a pose that is not rigid, an
  /// information matrix that is not symmetric or not positive semi-definite, a confidence outside
  /// [0, 1], a fixed node without a pose. optimize() calls it.
  void validate() const;
};

}  // namespace gpureg::pose_graph
