// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/pose_graph/options.hpp"

namespace gpureg::pose_graph {

inline const char* to_string(Robust robust) {
  return robust == Robust::none ? "none" : robust == Robust::gnc ? "gnc" : "line_process";
}

}  // namespace gpureg::pose_graph

namespace gpureg::fields {

template <>
struct Values<pose_graph::Robust> {
  static constexpr pose_graph::Robust kAll[] = {pose_graph::Robust::none, pose_graph::Robust::gnc,
                                                pose_graph::Robust::line_process};
};

template <>
struct Fields<pose_graph::DriftOptions> {
  static constexpr const char* kName = "DriftOptions";
  static constexpr const char* kGroup = "drift.";
  static constexpr const char* kSentence =
      "Noise of odometry without an information matrix: it grows with the motion.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::DriftOptions;
    v(&O::translation_per_metre, {"translation_per_metre", kNotNegative, "Metres of sigma per metre travelled."});
    v(&O::rotation_per_metre, {"rotation_per_metre", kNotNegative, "Degrees of sigma per metre travelled."});
    v(&O::rotation_per_degree, {"rotation_per_degree", kNotNegative, "Degrees of sigma per degree turned."});
    v(&O::min_translation, {"min_translation", kPositive.in("metres"), "Least sigma of the translation."});
    v(&O::min_rotation, {"min_rotation", kPositive.in("degrees"), "Least sigma of the rotation."});
  }
  // clang-format on
};

template <>
struct Fields<pose_graph::LoopNoiseOptions> {
  static constexpr const char* kName = "LoopNoiseOptions";
  static constexpr const char* kGroup = "loop_noise.";
  static constexpr const char* kSentence = "Noise of loop edges without an information matrix.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::LoopNoiseOptions;
    v(&O::translation, {"translation", kPositive.in("metres"), "Sigma of the translation."});
    v(&O::rotation, {"rotation", kPositive.in("degrees"), "Sigma of the rotation."});
  }
  // clang-format on
};

template <>
struct Fields<pose_graph::GncOptions> {
  static constexpr const char* kName = "GncOptions";
  static constexpr const char* kGroup = "gnc.";
  static constexpr const char* kSentence = "Graduated non-convexity with truncated least squares.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::GncOptions;
    v(&O::inlier_probability, {"inlier_probability", kOpenProbability, "Probability that a correct loop is accepted when its information is exact."});
    v(&O::mu_step, {"mu_step", above(1, kMost, "a finite number > 1"), "Factor on mu per round."});
    v(&O::max_rounds, {"max_rounds", from(1, kInfinity), "Rounds at most."});
    v(&O::min_bridge_confidence, {"min_bridge_confidence", kProbability, "Confidence from which a loop that lies on no cycle is accepted; otherwise the graph is split there."});
    v(&O::consensus, {"consensus", "Start from loops that agree with each other along short cycles, not from all of them."});
  }
  // clang-format on
};

template <>
struct Fields<pose_graph::LineProcessOptions> {
  static constexpr const char* kName = "LineProcessOptions";
  static constexpr const char* kGroup = "line_process.";
  static constexpr const char* kSentence =
      "The line process of Choi et al. 2015, as LoopSmart uses it.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::LineProcessOptions;
    v(&O::odometry_weight, {"odometry_weight", kPositive, "lambda."});
    v(&O::tau, {"tau", kPositive.in("metres"), "RMS distance at which the weight of a loop falls to 0.25."});
    v(&O::tau_not_squared, {"tau_not_squared", "mu = tau * kappa, as LoopSmart prints it, not tau^2 * kappa."});
    v(&O::min_weight, {"min_weight", between(0, 1, "a weight in (0, 1)"), "A loop with a smaller weight is rejected."});
    v(&O::max_rounds, {"max_rounds", from(1, kInfinity), "Rounds at most."});
  }
  // clang-format on
};

template <>
struct Fields<pose_graph::SolverOptions> {
  static constexpr const char* kName = "SolverOptions";
  static constexpr const char* kGroup = "solver.";
  static constexpr const char* kSentence = "Levenberg-Marquardt.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::SolverOptions;
    v(&O::max_iterations, {"max_iterations", from(1, kInfinity), "Iterations of one minimisation at most."});
    v(&O::relative_tolerance, {"relative_tolerance", kNotNegative, "Stop when the cost falls by less than this share."});
    v(&O::initial_damping, {"initial_damping", kPositive, "Damping of the first step."});
  }
  // clang-format on
};

template <>
struct Fields<pose_graph::Options> {
  static constexpr const char* kName = "PoseGraphOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "Options of the optimisation of a pose graph.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = pose_graph::Options;
    v(&O::robust, {"robust", "How wrong loops are kept out."});
    v(&O::gnc, {"gnc", "Of robust gnc."});
    v(&O::line_process, {"line_process", "Of robust line_process."});
    v(&O::drift, {"drift", "Noise of odometry without an information matrix."});
    v(&O::loop_noise, {"loop_noise", "Noise of loops without an information matrix."});
    v(&O::solver, {"solver", "Levenberg-Marquardt."});
    v(&O::use_initial_poses, {"use_initial_poses", "Start from the poses of the nodes if they have one, not from the edges."});
    v(&O::threads, {"threads", from(0, 4096, "0 (one per core) to 4096"), "Threads; results do not depend on them."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
