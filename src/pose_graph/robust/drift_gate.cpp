// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>

#include "pose_graph/parallel.hpp"
#include "pose_graph/robust/robust.hpp"
#include "pose_graph/uncertain_pose.hpp"

namespace gpureg::pose_graph {
namespace {

/// Samples of the posterior. A covariance of 6 dimensions from 32 samples is off by a factor of
/// two, seldom more.
constexpr int kSamples = 32;
/// What the gate's threshold is multiplied with: the covariance is a sample's, and linearised.
constexpr double kGenerosity = 4;
/// Keeps the matrix invertible where nothing holds a node: its variance is then very large.
constexpr double kDamping = 1e-9;

}  // namespace

std::vector<char> explained_by_drift(const Problem& problem, NormalEquations& equations,
                                     const std::vector<char>& asked, double quantile,
                                     const Control& control, const Estimate& estimate) {
  std::vector<char> explained = asked;
  equations.linearise(estimate.poses, estimate.selection);
  std::vector<Vector6d> step;
  if (!equations.solve(kDamping, step)) return explained;
  std::vector<std::vector<Vector6d>> samples(kSamples);
  const auto draw = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) samples[k] = equations.sample(k);
  };
  for_ranges(kSamples, control.threads, draw, 1);
  for_ranges(problem.edge_count(), control.threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const EdgeTerm& edge = problem.edges[k];
      if (!asked[k]) continue;
      const Pose &source = estimate.poses[edge.source], &target = estimate.poses[edge.target];
      // d (relative pose) / d target, in the source's frame.
      const Matrix6d across = adjoint(source.inverse() * target);
      Matrix6d drift = Matrix6d::Zero();
      for (const std::vector<Vector6d>& sample : samples) {
        const Vector6d d = sample[edge.source] - across * sample[edge.target];
        drift += d * d.transpose();
      }
      drift /= kSamples;
      bool any = false;
      for (int m = 0; m < edge.modes && !any; ++m) {
        const ModeTerm& mode = problem.modes[edge.first_mode + m];
        if (threshold(mode, quantile) <= 0) continue;
        const Vector6d e = residual(source, target, mode);
        const Matrix6d covariance = drift + covariance_of(mode.information);
        any = e.dot(covariance.llt().solve(e)) <= kGenerosity * threshold(mode, quantile);
      }
      explained[k] = any;
    }
  });
  return explained;
}

}  // namespace gpureg::pose_graph
