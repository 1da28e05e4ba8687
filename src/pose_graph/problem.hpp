// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/pose_graph/graph.hpp"
#include "gpureg/pose_graph/options.hpp"
#include "pose_graph/se3.hpp"

/// A graph as the solver sees it: nodes by ascending id, edges in an order that the caller's order
/// does not influence, every information matrix filled in.
namespace gpureg::pose_graph {

struct ModeTerm {
  Pose target_from_source;
  Pose inverse;
  Matrix6d information;
  /// 2 log(p / (1 - p)) of the confidence p: by how much it raises the threshold of the squared
  /// error.
  double prior = 0;
};

struct EdgeTerm {
  int source = 0, target = 0;  ///< positions of nodes
  bool odometry = false;
  int first_mode = 0, modes = 1;
  int original = 0;  ///< place in Graph::edges
};

struct GravityTerm {
  int node = 0;
  Eigen::Vector3d up;  ///< unit vector, node's frame
  double weight = 1;   ///< 1 / sigma^2, 1/rad^2
};

struct PriorTerm {
  int node = 0;
  Pose inverse;  ///< node_from_world of the prior
  Matrix6d information;
};

struct Problem {
  std::vector<std::int64_t> ids;
  std::vector<int> original;  ///< place in Graph::nodes
  std::vector<Pose> poses;    ///< initial; identity where there is none
  std::vector<char> has_pose;
  std::vector<char> held;  ///< does not move
  std::vector<EdgeTerm> edges;
  std::vector<ModeTerm> modes;
  std::vector<GravityTerm> gravity;
  std::vector<PriorTerm> priors;

  int node_count() const { return static_cast<int>(ids.size()); }
  int edge_count() const { return static_cast<int>(edges.size()); }
};

/// Information of odometry without a matrix of its own: it falls with the motion.
Matrix6d odometry_information(const Pose& motion, const DriftOptions& drift);

/// The weight of each edge, and which of its modes (relative to first_mode) takes part.
struct Selection {
  std::vector<double> weights;
  std::vector<int> modes;
};

/// Every edge with weight 1 and its first mode.
Selection all_edges(const Problem& problem);

/// Of a valid graph.
Problem compile(const Graph& graph, const Options& options);

/// One problem per connected component, by smallest id.
std::vector<Problem> split(const Problem& problem);

Vector6d residual(const Pose& source, const Pose& target, const ModeTerm& mode);
double squared_error(const Pose& source, const Pose& target, const ModeTerm& mode);

}  // namespace gpureg::pose_graph
