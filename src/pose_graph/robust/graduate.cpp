// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "math/exponential.hpp"
#include "pose_graph/parallel.hpp"
#include "pose_graph/robust/bridges.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::pose_graph {
namespace {

/// Steps per round: the weights of the next round matter more than the minimum of this one.
constexpr int kGraduateSteps = 1;
constexpr double kGraduateTolerance = 1e-3;
/// Weights closer than this to 0 or 1 are so.
constexpr double kBinary = 1e-3;
/// Beyond this mu only loops within 12 % of their threshold are undecided, which settle() decides.
constexpr double kLastMu = 8;
/// Where no loop is further from its threshold than this, as a ratio of squared errors, least
/// squares over all is right up to noise: the tail of correct loops needs no graduation.
constexpr double kWithinNoise = 2;
/// Corrections of the accepted set at the end.
constexpr int kMostCorrections = 6;

/// The mode that fits best: squared error over threshold, or infinity where no mode may be
/// accepted.
struct Fit {
  int mode = 0;
  double ratio = 0;
};

Fit fit_of(const Problem& problem, const EdgeTerm& edge, const std::vector<Pose>& poses,
           double quantile) {
  Fit best{0, std::numeric_limits<double>::infinity()};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < edge.modes; ++k) {
    const ModeTerm& mode = problem.modes[edge.first_mode + k];
    const double limit = threshold(mode, quantile);
    if (limit <= 0) continue;
    const double error = squared_error(poses[edge.source], poses[edge.target], mode);
    if (error - mode.prior < least) {
      least = error - mode.prior;
      best = {k, error / limit};
    }
  }
  return best;
}

std::vector<Fit> fits_of(const Problem& problem, const std::vector<char>& candidates,
                         const std::vector<Pose>& poses, double quantile, int threads) {
  std::vector<Fit> fits(problem.edges.size());
  for_ranges(problem.edge_count(), threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      if (!problem.edges[k].odometry && candidates[k])
        fits[k] = fit_of(problem, problem.edges[k], poses, quantile);
  });
  return fits;
}

/// Yang et al. 2020, equation 14, with the ratio of squared error and threshold.
double truncated_weight(double ratio, double mu) {
  if (ratio <= mu / (mu + 1)) return 1;
  if (ratio >= (mu + 1) / mu) return 0;
  return std::sqrt(mu * (mu + 1) / ratio) - mu;
}

}  // namespace

double chi_square_quantile(double probability) {
  // The distribution function with 6 degrees of freedom is 1 - exp(-x/2) (1 + x/2 + x^2/8).
  double low = 0, high = 1e3;
  for (int k = 0; k < 200; ++k) {
    const double x = 0.5 * (low + high);
    (1 - portable::exp(-x / 2) * (1 + x / 2 + x * x / 8) < probability ? low : high) = x;
  }
  return high;
}

double threshold(const ModeTerm& mode, double quantile) { return quantile + mode.prior; }

double truncated_cost(const Problem& problem, const std::vector<Pose>& poses, double quantile,
                      int threads) {
  std::vector<double> costs(problem.edges.size());
  for_ranges(problem.edge_count(), threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const EdgeTerm& edge = problem.edges[k];
      double least = edge.odometry ? std::numeric_limits<double>::infinity() : quantile;
      double best_prior = -quantile;
      for (int m = 0; m < edge.modes; ++m) {
        const ModeTerm& mode = problem.modes[edge.first_mode + m];
        const double error = squared_error(poses[edge.source], poses[edge.target], mode);
        least = std::min(least, error - mode.prior);
        best_prior = std::max(best_prior, mode.prior);
      }
      costs[k] = least + best_prior;
    }
  });
  Selection nothing{std::vector<double>(problem.edges.size(), 0.0),
                    std::vector<int>(problem.edges.size(), 0)};
  double sum = 0;
  for (const double cost : costs) sum += cost;
  return 0.5 * sum + weighted_cost(problem, poses, nothing, threads);
}

namespace {

/// Weights and modes of the candidates by a rule of their fit, 0 for other loops; returns whether a
/// weight is neither 0 nor 1.
template <typename Rule>
bool update_weights(const Problem& problem, const std::vector<char>& candidates,
                    const std::vector<Fit>& fits, Selection& selection, const Rule& rule) {
  bool undecided = false;
  for (int k = 0; k < problem.edge_count(); ++k) {
    if (problem.edges[k].odometry) continue;
    selection.weights[k] = candidates[k] ? rule(fits[k].ratio) : 0;
    if (candidates[k]) selection.modes[k] = fits[k].mode;
    undecided |= selection.weights[k] > kBinary && selection.weights[k] < 1 - kBinary;
  }
  return undecided;
}

double hard_weight(double ratio) { return ratio <= 1 ? 1 : 0; }

bool minimised(const Problem& problem, NormalEquations& equations, int iterations, Control& control,
               Estimate& estimate) {
  const MinimisationResult result = minimise(problem, equations, estimate.selection, iterations,
                                             kGraduateTolerance, control, estimate.poses);
  estimate.failed = result.failed;
  estimate.converged = result.converged;
  estimate.last_decrease = result.last_decrease;
  return !result.failed && !control.cancelled;
}

double worst_of(const std::vector<Fit>& fits) {
  double worst = 0;
  for (const Fit& fit : fits)
    if (std::isfinite(fit.ratio)) worst = std::max(worst, fit.ratio);
  return worst;
}

/// Least squares over odometry and all candidates that may be accepted.
bool fit_candidates(const Problem& problem, NormalEquations& equations,
                    const std::vector<char>& candidates, double quantile, Control& control,
                    Estimate& estimate) {
  update_weights(problem, candidates,
                 fits_of(problem, candidates, estimate.poses, quantile, control.threads),
                 estimate.selection, [](double ratio) { return std::isfinite(ratio) ? 1.0 : 0.0; });
  return minimised(problem, equations, control.options.solver.max_iterations, control, estimate);
}

}  // namespace

bool fit_all(const Problem& problem, NormalEquations& equations,
             const std::vector<char>& candidates, double quantile, Control& control,
             Estimate& estimate) {
  if (!fit_candidates(problem, equations, candidates, quantile, control, estimate)) return false;
  const std::vector<Fit> now =
      fits_of(problem, candidates, estimate.poses, quantile, control.threads);
  if (worst_of(now) > kWithinNoise) return false;
  update_weights(problem, candidates, now, estimate.selection, hard_weight);
  return minimised(problem, equations, control.options.solver.max_iterations, control, estimate);
}

void graduate(const Problem& problem, NormalEquations& equations,
              const std::vector<char>& candidates, bool least_squares_first, double quantile,
              Control& control, Estimate& estimate) {
  const Options& options = control.options;
  if (least_squares_first &&
      !fit_candidates(problem, equations, candidates, quantile, control, estimate))
    return;
  std::vector<Fit> now = fits_of(problem, candidates, estimate.poses, quantile, control.threads);
  const double worst = worst_of(now);
  if (worst > 1) {
    double mu = 1 / (2 * worst - 1);
    for (int round = 0; round < options.gnc.max_rounds; ++round, mu *= options.gnc.mu_step) {
      const bool undecided =
          update_weights(problem, candidates, now, estimate.selection,
                         [&](double ratio) { return truncated_weight(ratio, mu); });
      if ((!undecided && mu > 1) || mu > kLastMu) break;
      if (!minimised(problem, equations, kGraduateSteps, control, estimate)) return;
      now = fits_of(problem, candidates, estimate.poses, quantile, control.threads);
    }
  }
  update_weights(problem, candidates, now, estimate.selection, hard_weight);
  minimised(problem, equations, options.solver.max_iterations, control, estimate);
}

void settle(const Problem& problem, NormalEquations& equations, double quantile, Control& control,
            Estimate& estimate) {
  const SolverOptions& solver = control.options.solver;
  const std::vector<char> all(problem.edges.size(), 1);
  for (int round = 0; round < kMostCorrections; ++round) {
    const Selection before = estimate.selection;
    update_weights(problem, all, fits_of(problem, all, estimate.poses, quantile, control.threads),
                   estimate.selection, hard_weight);
    reject_unchecked(problem, control.options.gnc.min_bridge_confidence, estimate.selection);
    const bool same =
        estimate.selection.weights == before.weights && estimate.selection.modes == before.modes;
    const bool exact = estimate.converged && estimate.last_decrease <= solver.relative_tolerance;
    if (same && (round > 0 || exact)) break;
    const MinimisationResult result =
        minimise(problem, equations, estimate.selection, solver.max_iterations,
                 solver.relative_tolerance, control, estimate.poses);
    estimate.failed = result.failed;
    estimate.converged = result.converged;
    estimate.last_decrease = result.last_decrease;
    if (result.failed || control.cancelled) break;
  }
  estimate.cost = truncated_cost(problem, estimate.poses, quantile, control.threads);
}

}  // namespace gpureg::pose_graph
