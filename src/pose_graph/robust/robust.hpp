// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "pose_graph/problem.hpp"
#include "pose_graph/solver/levenberg_marquardt.hpp"

namespace gpureg::pose_graph {

/// Poses of one component and what they make of its edges.
struct Estimate {
  std::vector<Pose> poses;
  Selection selection;
  double initial_cost = 0;
  double cost = 0;  ///< of the robust objective
  /// Share of the cost that the last step of the last minimisation took away.
  double last_decrease = std::numeric_limits<double>::infinity();
  bool converged = false;
  bool failed = false;
};

/// Quantile of the chi-square distribution with 6 degrees of freedom.
double chi_square_quantile(double probability);

/// Squared error at which accepting a mode costs as much as rejecting its edge; <= 0: never
/// accepted.
double threshold(const ModeTerm& mode, double quantile);

/// The objective of truncated least squares with priors and modes: half the sum of odometry's
/// squared errors and, per loop, min(quantile, min over modes of (squared error - prior)), shifted
/// so that a perfect graph costs 0.
double truncated_cost(const Problem& problem, const std::vector<Pose>& poses, double quantile,
                      int threads);

/// Least squares over odometry and the loops with a flag in `candidates`, from the estimate's
/// poses; false, and weights that mean nothing, where a loop is further from its threshold than
/// noise explains, and where the minimisation failed or was cancelled. true: every weight is 0 or
/// 1, as after graduate().
bool fit_all(const Problem& problem, NormalEquations& equations,
             const std::vector<char>& candidates, double quantile, Control& control,
             Estimate& estimate);

/// Graduated non-convexity over odometry and the loops with a flag in `candidates`, from the
/// estimate's poses; every weight is 0 or 1 in the end. Other loops have weight 0.
/// least_squares_first: minimise with all weights 1 before the first round.
void graduate(const Problem& problem, NormalEquations& equations,
              const std::vector<char>& candidates, bool least_squares_first, double quantile,
              Control& control, Estimate& estimate);

/// Accepts exactly the loops below their threshold, of all, and minimises; until the set stands.
/// Fills in the cost.
void settle(const Problem& problem, NormalEquations& equations, double quantile, Control& control,
            Estimate& estimate);

/// Of the loops with a flag in `asked`, those whose misclosure at the estimate the uncertainty of
/// the estimate itself explains: the covariance of the relative pose comes from samples of the
/// posterior of the accepted edges.
std::vector<char> explained_by_drift(const Problem& problem, NormalEquations& equations,
                                     const std::vector<char>& asked, double quantile,
                                     const Control& control, const Estimate& estimate);

/// The whole robust optimisation by Robust::gnc.
Estimate solve_gnc(const Problem& problem, const std::vector<char>& known, Control& control);

/// The whole robust optimisation by Robust::line_process.
Estimate solve_line_process(const Problem& problem, const std::vector<char>& known,
                            Control& control);

}  // namespace gpureg::pose_graph
