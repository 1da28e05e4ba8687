// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pose_graph/options.hpp"

#include "pose_graph/validate.hpp"

namespace gpureg::pose_graph {
namespace {

/// More threads than this are a mistake, and starting them could fail.
constexpr int kMostThreads = 4096;

void require_count(const std::string& field, int value) {
  require(value >= 1, field, value, "1 or more");
}

}  // namespace

void DriftOptions::validate() const {
  require_not_negative("drift.translation_per_metre", translation_per_metre);
  require_not_negative("drift.rotation_per_metre", rotation_per_metre);
  require_not_negative("drift.rotation_per_degree", rotation_per_degree);
  require_positive("drift.min_translation", min_translation);
  require_positive("drift.min_rotation", min_rotation);
}

void LoopNoiseOptions::validate() const {
  require_positive("loop_noise.translation", translation);
  require_positive("loop_noise.rotation", rotation);
}

void GncOptions::validate() const {
  require(inlier_probability > 0 && inlier_probability < 1, "gnc.inlier_probability",
          inlier_probability, "a probability in (0, 1)");
  require(std::isfinite(mu_step) && mu_step > 1, "gnc.mu_step", mu_step, "a finite number > 1");
  require_count("gnc.max_rounds", max_rounds);
  require(min_bridge_confidence >= 0 && min_bridge_confidence <= 1, "gnc.min_bridge_confidence",
          min_bridge_confidence, "a probability in [0, 1]");
}

void LineProcessOptions::validate() const {
  require_positive("line_process.odometry_weight", odometry_weight);
  require_positive("line_process.tau", tau);
  require(min_weight > 0 && min_weight < 1, "line_process.min_weight", min_weight,
          "a weight in (0, 1)");
  require_count("line_process.max_rounds", max_rounds);
  require_positive("line_process.correspondence_distance", correspondence_distance);
  require_count("line_process.refresh_interval", refresh_interval);
}

void SolverOptions::validate() const {
  require_count("solver.max_iterations", max_iterations);
  require_not_negative("solver.relative_tolerance", relative_tolerance);
  require_positive("solver.initial_damping", initial_damping);
}

Options Options::loopsmart() {
  Options options;
  options.robust = Robust::line_process;
  options.line_process.odometry_weight = 1000;
  options.line_process.tau = 0.2;
  options.line_process.tau_not_squared = true;
  options.line_process.min_weight = 0.25;
  options.line_process.correspondence_distance = 0.05;
  options.line_process.refresh_interval = 50;
  return options;
}

void Options::validate() const {
  require(robust == Robust::none || robust == Robust::gnc || robust == Robust::line_process,
          "robust", static_cast<int>(robust), "none, gnc or line_process");
  gnc.validate();
  line_process.validate();
  drift.validate();
  loop_noise.validate();
  solver.validate();
  require(threads >= 0 && threads <= kMostThreads, "threads", threads, "0 (one per core) to 4096");
}

}  // namespace gpureg::pose_graph
