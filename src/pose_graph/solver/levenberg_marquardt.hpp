// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "pose_graph/solver/normal_equations.hpp"

namespace gpureg::pose_graph {

/// What every minimisation of one optimize() call shares.
struct Control {
  const Options& options;
  int threads = 1;
  int iterations = 0;  ///< linear systems solved so far
  bool cancelled = false;
  /// Of the last step of this component: the next minimisation starts from nearly the same poses.
  double damping = std::numeric_limits<double>::infinity();

  /// Asks should_stop, once per linear system.
  bool stop(double cost);
};

struct MinimisationResult {
  double cost = 0;
  /// Share of the cost that the last step took away.
  double last_decrease = std::numeric_limits<double>::infinity();
  bool converged = false;
  bool failed = false;  ///< no damping made the system positive definite
};

/// Minimises the weighted sum of squared errors over the poses, in place, for a fixed selection.
/// Levenberg-Marquardt with Nielsen's rule for the damping (Madsen, Nielsen and Tingleff 2004,
/// algorithm 3.16).
MinimisationResult minimise(const Problem& problem, NormalEquations& equations,
                            const Selection& selection, int max_iterations,
                            double relative_tolerance, Control& control, std::vector<Pose>& poses);

}  // namespace gpureg::pose_graph
