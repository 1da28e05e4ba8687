// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/initialise.hpp"
#include "pose_graph/robust.hpp"

namespace gpureg::pose_graph {

Estimate solve_gnc(const Problem& problem, const std::vector<char>& known, Control& control) {
  const double quantile = chi_square_quantile(control.options.gnc.inlier_probability);
  NormalEquations equations(problem, control.threads);
  const std::vector<char> all(problem.edges.size(), 1);
  const std::vector<char> none(problem.edges.size(), 0);
  Estimate estimate;
  estimate.poses = problem.poses;
  estimate.selection = all_edges(problem);
  poses_from_paths(problem, known, none, estimate.selection.modes, estimate.poses);
  graduate(problem, equations, all, true, quantile, control, estimate);
  return estimate;
}

}  // namespace gpureg::pose_graph
