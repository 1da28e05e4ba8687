// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/levenberg_marquardt.hpp"

#include <algorithm>
#include <cmath>

#include "common/stop_scope.hpp"

namespace gpureg::pose_graph {
namespace {

constexpr double kMaxDamping = 1e12;  ///< beyond it steps are shorter than rounding
constexpr double kMinDamping = 1e-12;
/// A sum of squared errors in units of sigma^2 as small as this is zero.
constexpr double kNegligibleCost = 1e-12;

}  // namespace

bool Control::stop(double cost) {
  StopScope::poll();
  if (!cancelled && options.should_stop && options.should_stop({iterations, cost}))
    cancelled = true;
  return cancelled;
}

MinimisationResult minimise(const Problem& problem, NormalEquations& equations,
                            const Selection& selection, int max_iterations,
                            double relative_tolerance, Control& control, std::vector<Pose>& poses) {
  MinimisationResult out;
  out.cost = weighted_cost(problem, poses, selection, control.threads);
  double damping = std::min(control.options.solver.initial_damping, control.damping), growth = 2;
  bool moved = true;
  std::vector<Vector6d> step;
  std::vector<Pose> candidate(poses.size());
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (out.cost <= kNegligibleCost) {
      out.converged = true;
      break;
    }
    if (control.stop(out.cost)) break;
    if (moved) equations.linearise(poses, selection);
    ++control.iterations;
    moved = false;
    double gain = -1, cost = out.cost, expected = 0;
    const bool solved = equations.solve(damping, step);
    if (solved) {
      for (std::size_t k = 0; k < poses.size(); ++k)
        candidate[k] = problem.held[k] ? poses[k] : retract(poses[k], step[k]);
      cost = weighted_cost(problem, candidate, selection, control.threads);
      expected = equations.expected_decrease(damping, step);
      gain = expected > 0 ? (out.cost - cost) / expected : -1;
    }
    if (solved && expected <= relative_tolerance * out.cost && gain <= 0) {
      out.converged = true;  // nothing that the model still hopes for matters
      break;
    }
    if (gain > 0 && std::isfinite(cost)) {
      out.last_decrease = (out.cost - cost) / out.cost;
      const bool little = out.last_decrease <= relative_tolerance;
      poses.swap(candidate);
      out.cost = cost;
      moved = true;
      const double fit = 2 * std::min(gain, 1.0) - 1;
      damping = std::max(kMinDamping, damping * std::max(1.0 / 3, 1 - fit * fit * fit));
      growth = 2;
      // A short step because of much damping is no sign of a minimum.
      if (little && damping < 1) {
        out.converged = true;
        break;
      }
    } else {
      damping *= growth;
      growth *= 2;
      if (damping > kMaxDamping) {
        out.failed = !solved;
        out.converged = solved;
        break;
      }
    }
  }
  control.damping = damping;
  return out;
}

}  // namespace gpureg::pose_graph
