// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "math/exponential.hpp"
#include "pose_graph/initialise.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::pose_graph {
namespace {

/// Weights that move by less than this between two rounds have converged.
constexpr double kSettled = 1e-4;
constexpr int kStepsPerRound = 4;
constexpr double kRoundTolerance = 1e-4;

/// Mean number of correspondences of the loops: the translation block of sum G'G is the count times
/// the identity.
double mean_correspondences(const Problem& problem) {
  double sum = 0;
  int loops = 0;
  for (const EdgeTerm& edge : problem.edges) {
    if (edge.odometry) continue;
    sum += problem.modes[edge.first_mode].information.bottomRightCorner<3, 3>().trace() / 3;
    ++loops;
  }
  return loops ? sum / loops : 1;
}

}  // namespace

Estimate solve_line_process(const Problem& problem, const std::vector<char>& known,
                            Control& control) {
  const LineProcessOptions& options = control.options.line_process;
  const SolverOptions& solver = control.options.solver;
  NormalEquations equations(problem, control.threads);
  Estimate out;
  out.poses = problem.poses;
  out.selection = all_edges(problem);
  poses_from_paths(problem, known, std::vector<char>(problem.edges.size(), 0), out.selection.modes,
                   out.poses);
  Selection& selection = out.selection;
  for (int k = 0; k < problem.edge_count(); ++k)
    if (problem.edges[k].odometry) selection.weights[k] = options.odometry_weight;
  out.initial_cost = weighted_cost(problem, out.poses, selection, control.threads);
  const double mu =
      options.tau * (options.tau_not_squared ? 1 : options.tau) * mean_correspondences(problem);
  const auto minimise_now = [&](int iterations, double tolerance) {
    const MinimisationResult result =
        minimise(problem, equations, selection, iterations, tolerance, control, out.poses);
    out.failed = result.failed;
    out.converged = result.converged;
    out.cost = result.cost;
    return !result.failed && !control.cancelled;
  };
  for (int round = 0; round < options.max_rounds; ++round) {
    double moved = 0;
    for (int k = 0; k < problem.edge_count(); ++k) {
      const EdgeTerm& edge = problem.edges[k];
      if (edge.odometry) continue;
      double least = -1;
      for (int m = 0; m < edge.modes; ++m) {
        const double error = squared_error(out.poses[edge.source], out.poses[edge.target],
                                           problem.modes[edge.first_mode + m]);
        if (least >= 0 && error >= least) continue;
        least = error;
        selection.modes[k] = m;
      }
      // The minimum of l f + mu (sqrt(l) - 1)^2 over l. At first every loop counts in full, as in
      // Choi et al. 2015.
      const double l = round == 0 ? 1 : portable::square(mu / (mu + least));
      moved = std::max(moved, std::abs(l - selection.weights[k]));
      selection.weights[k] = l;
    }
    if (round > 0 && moved < kSettled) break;
    if (!minimise_now(kStepsPerRound, kRoundTolerance)) return out;
  }
  // Rejected loops take no part in the result; weights keep the line process's values.
  Selection weights = selection;
  for (int k = 0; k < problem.edge_count(); ++k)
    if (!problem.edges[k].odometry && selection.weights[k] < options.min_weight)
      selection.weights[k] = 0;
  minimise_now(solver.max_iterations, solver.relative_tolerance);
  for (int k = 0; k < problem.edge_count(); ++k) {
    const double l = weights.weights[k];
    if (!problem.edges[k].odometry) out.cost += 0.5 * mu * portable::square(std::sqrt(l) - 1);
  }
  selection = weights;
  return out;
}

}  // namespace gpureg::pose_graph
