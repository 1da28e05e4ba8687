// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace gpureg::pose_graph {

/// How wrong loops are kept out.
enum class Robust {
  none,         ///< least squares: every edge counts in full
  gnc,          ///< truncated least squares by graduated non-convexity (Yang et al. 2020)
  line_process  ///< the line process of Choi et al. 2015, as LoopSmart uses it
};

/// Noise of odometry edges without an information matrix: it grows with the motion.
struct DriftOptions {
  double translation_per_metre = 0.02;  ///< metres of sigma per metre travelled, >= 0
  double rotation_per_metre = 0.2;      ///< degrees of sigma per metre travelled, >= 0
  double rotation_per_degree = 0.02;    ///< degrees of sigma per degree turned, >= 0
  double min_translation = 0.01;        ///< metres, > 0
  double min_rotation = 0.2;            ///< degrees, > 0
  void validate() const;                ///< throws InvalidArgument
};

/// Noise of loop edges without an information matrix.
struct LoopNoiseOptions {
  double translation = 0.05;  ///< metres, > 0
  double rotation = 1.0;      ///< degrees, > 0
  void validate() const;      ///< throws InvalidArgument
};

/// Graduated non-convexity with truncated least squares. Odometry counts as known inliers.
struct GncOptions {
  /// Probability that a correct loop is accepted when its information is exact, (0, 1). The
  /// squared-error threshold is the quantile of the chi-square distribution with 6 degrees of
  /// freedom, plus 2 log(p / (1 - p)) for a loop of confidence p.
  double inlier_probability = 0.99;
  double mu_step = 1.4;  ///< factor on mu per round, > 1 (Yang et al. 2020, Remark 5)
  int max_rounds = 200;  ///< >= 1
  /// A loop that lies on no cycle is checked by nothing: it fits perfectly, correct or not. It is
  /// accepted if its confidence is at least this, [0, 1]; otherwise the graph is split there.
  double min_bridge_confidence = 0.5;
  /// Start from loops that agree with each other along short cycles. false: start from all loops,
  /// as the paper of GNC does.
  bool consensus = true;
  void validate() const;  ///< throws InvalidArgument
};

/// The line process: E = lambda * sum odometry + sum l f + mu * (sqrt(l) - 1)^2.
struct LineProcessOptions {
  double odometry_weight = 1;  ///< lambda, > 0
  double tau = 0.2;            ///< metres, > 0
  /// false: mu = tau^2 * kappa, so that tau is the RMS distance at which l falls to 0.25. true: mu
  /// = tau * kappa as LoopSmart prints it. kappa is the mean number of correspondences, read from
  /// the translation block of the loops' information (Edge::information = sum G'G).
  bool tau_not_squared = false;
  double min_weight = 0.25;  ///< a loop with a smaller l is rejected, (0, 1)
  int max_rounds = 100;      ///< >= 1
  void validate() const;     ///< throws InvalidArgument
};

/// Levenberg-Marquardt.
struct SolverOptions {
  int max_iterations = 100;          ///< of one minimisation, >= 1
  double relative_tolerance = 1e-7;  ///< stop when the cost falls by less than this share, >= 0
  double initial_damping = 1e-6;     ///< > 0
  void validate() const;             ///< throws InvalidArgument
};

/// How far optimize() has come.
struct Progress {
  int iteration = 0;  ///< linear systems solved
  double cost = 0;    ///< of the objective that is being minimised now
};

/// Options of optimize(). The defaults take the noise from the edges' information matrices.
struct Options {
  Robust robust = Robust::gnc;
  GncOptions gnc;
  LineProcessOptions line_process;
  DriftOptions drift;
  LoopNoiseOptions loop_noise;
  SolverOptions solver;
  /// false: poses of free nodes are computed from the edges even if the nodes have one.
  bool use_initial_poses = true;
  int threads = 0;  ///< 0: one per core. Results do not depend on it.
  /// Ids of the nodes whose marginal covariance is wanted; one linear solve each.
  std::vector<std::int64_t> marginals;
  /// Called before every linear system, from the calling thread; true ends the optimisation with
  /// Status::cancelled. May be empty.
  std::function<bool(const Progress&)> should_stop;

  /// The constants of LoopSmart: line process, lambda 1000, tau 0.2, mu = tau * kappa, l >= 0.25.
  /// They suit odometry that is nearly exact: the sum of odometry errors is weighted so heavily
  /// that true loops are rejected after a drift of 0.2 to 0.44 m over 20 fragments.
  static Options loopsmart();
  void validate() const;  ///< throws InvalidArgument naming the field and its value
};

}  // namespace gpureg::pose_graph
