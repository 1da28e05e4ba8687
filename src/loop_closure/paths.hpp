// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <map>
#include <vector>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// A covariance as a sum: what comes with the rotation, and the translation where that is known.
struct RotationShare {
  Matrix6d rotation, translation;
};
RotationShare rotation_share(const Matrix6d& covariance);

/// The relative pose along a path with the parts of its covariance.
struct PathParts {
  pose_graph::Pose pose;
  Matrix6d rotation, translation;  ///< of modelled odometry, see RotationShare
  Matrix6d fixed;                  ///< of odometry with a covariance of the host
};

/// The best-known paths from one node to all others.
class PathTree {
 public:
  bool reaches(int node) const { return steps_[index(node)].cost < kNever; }
  /// Grows with the uncertainty along the path; comparable within one graph.
  double cost(int node) const { return steps_[index(node)].cost; }
  int hops(int node) const { return steps_[index(node)].hops; }
  /// root_from_node with the covariance of its right perturbation, in the node's frame. First-order
  /// composition along the path: other paths would only lower it. Errors of modelled odometry have
  /// one sign over Options::drift_correlation.
  UncertainPose root_from(int node);
  /// The same by parts.
  PathParts parts(int node) const;
  /// false: the host has given the covariance of the whole path.
  bool modelled(int node) const { return steps_[index(node)].steps > 0; }

 private:
  friend class Paths;
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  static std::size_t index(int node) { return static_cast<std::size_t>(node); }
  struct Step {
    double cost = kNever;
    int hops = 0;
    int parent = -1;
    double length = 0, steps = 0;         ///< of modelled odometry
    const UncertainPose* edge = nullptr;  ///< parent_from_node
  };
  std::vector<Step> steps_;
  std::map<int, UncertainPose> known_;  ///< of independent errors, of the nodes asked for so far
  double correlation_ = 0;
};

/// The graph of odometry, and of accepted loops where wanted, without edges whose covariance is
/// beyond all numbers. Nodes are positions in State::nodes.
class Paths {
 public:
  Paths(const State& state, bool with_loops, const Options& options);

  int size() const { return static_cast<int>(ids_.size()); }
  int position(FragmentId id) const;
  FragmentId id(int position) const { return ids_[static_cast<std::size_t>(position)]; }
  /// Number of the connected set of a node, equal to the smallest position in it.
  int component(int node) const { return component_[static_cast<std::size_t>(node)]; }

  /// Valid as long as this object. max_hops: longer paths are left out.
  PathTree tree(int root, int max_hops = std::numeric_limits<int>::max()) const;

 private:
  struct Link {
    int to;
    double cost;
    double length, steps;
    UncertainPose here_from_there;
  };
  void connect(FragmentId source, FragmentId target, const UncertainPose& target_from_source,
               double length, double steps);

  double correlation_;
  std::vector<FragmentId> ids_;
  std::vector<std::vector<Link>> links_;
  std::vector<int> component_;
};

}  // namespace gpureg::loop_closure
