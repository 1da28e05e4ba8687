// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "pose_graph/problem.hpp"
#include "pose_graph/solver/block_cholesky.hpp"

namespace gpureg::pose_graph {

/// Residual and Jacobians of one edge: d residual / d (right perturbation of either node).
struct EdgeLinearisation {
  Vector6d residual;
  Matrix6d source, target;
};
EdgeLinearisation linearise_edge(const Pose& source, const Pose& target, const ModeTerm& mode);

/// R up - (0, 0, 1) and its derivative by the rotation (columns 0 to 2).
struct GravityLinearisation {
  Eigen::Vector3d residual;
  Eigen::Matrix3d rotation;
};
GravityLinearisation linearise_gravity(const Pose& node, const GravityTerm& term);

/// Half the weighted sum of squared errors.
double weighted_cost(const Problem& problem, const std::vector<Pose>& poses,
                     const Selection& selection, int threads);

/// The Gauss-Newton system of a problem in the perturbations of its nodes that are not held.
class NormalEquations {
 public:
  NormalEquations(const Problem& problem, int threads);

  /// Sums up the system. The structure is computed again only where the set of edges with a weight
  /// has changed much.
  void linearise(const std::vector<Pose>& poses, const Selection& selection);

  /// The step of (H + damping * diagonal(H)) step = -gradient, per node, zero for held ones. false
  /// where that matrix is not positive definite.
  bool solve(double damping, std::vector<Vector6d>& step);

  /// Cost decrease that the quadratic model expects of a step.
  double expected_decrease(double damping, const std::vector<Vector6d>& step) const;

  /// Marginal covariance of a node that is not held, after a solve with that damping.
  Matrix6d marginal(int node) const;

  /// Perturbations of all nodes drawn from the posterior, after a solve; a function of the number.
  std::vector<Vector6d> sample(int number) const;

 private:
  struct Contribution {
    Matrix6d source, target, cross;  ///< cross: rows of the node with the larger column
    Vector6d source_gradient, target_gradient;
  };
  void build_structure(const Selection& selection);
  bool structure_fits(const Selection& selection) const;
  Vector6d scale(int column) const;

  const Problem& problem_;
  int threads_;
  std::vector<int> column_;  ///< of each node; -1: held
  int columns_ = 0;
  BlockMatrix matrix_, damped_;
  std::vector<int> block_of_;  ///< per edge: index into the pattern, or -1
  int active_edges_ = 0;       ///< that the structure was built for
  std::vector<Vector6d> gradient_;
  std::vector<Contribution> contributions_;
  std::unique_ptr<BlockCholesky> cholesky_;
};

}  // namespace gpureg::pose_graph
