// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <cmath>
#include <string>

#include "common/validate.hpp"
#include "loop_consistency/consistency_graph.hpp"

namespace gpureg {
namespace {

double probability(double value, const std::string& name) {
  require(std::isfinite(value) && value >= 0 && value <= 1, name.c_str(), value,
          "a probability in [0, 1]");
  return value;
}

const UnalignedIsometry3d& rigid(const UnalignedIsometry3d& pose, const std::string& name) {
  const Eigen::Matrix3d r = pose.linear();
  const bool fine =
      pose.matrix().allFinite() &&
      (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3 &&
      r.determinant() > 0 &&
      (pose.matrix().row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() == 0;
  if (!fine) throw InvalidArgument(name + " is no rigid motion");
  return pose;
}

void check(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results) {
  if (results.size() != pairs.size())
    throw InvalidArgument("results has " + std::to_string(results.size()) +
                          " entries, but pairs has " + std::to_string(pairs.size()));
  for (std::size_t p = 0; p < results.size(); ++p) {
    const std::string name = "results[" + std::to_string(p) + "]";
    probability(results[p].score, name + ".score");
    if (results[p].has_candidate)
      rigid(results[p].target_from_source, name + ".target_from_source");
    for (std::size_t m = 0; m < results[p].modes.size(); ++m) {
      const std::string mode = name + ".modes[" + std::to_string(m) + "]";
      probability(results[p].modes[m].confidence, mode + ".confidence");
      rigid(results[p].modes[m].target_from_source, mode + ".target_from_source");
    }
  }
}

void require_between(double value, double low, double high, const char* name,
                     const char* expected) {
  require(std::isfinite(value) && value > low && value < high, name, value, expected);
}

}  // namespace

LoopConsistencyOptions LoopConsistencyOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a length > 0");
  LoopConsistencyOptions options;
  options.closing_distance = 3.0f * voxel_size;
  return options;
}

void LoopConsistencyOptions::validate() const {
  require(std::isfinite(closing_angle) && closing_angle > 0 && closing_angle <= 180,
          "closing_angle", closing_angle, "degrees in (0, 180]");
  require(positive(closing_distance), "closing_distance", closing_distance, "a length > 0");
  require_between(false_closure_rate, 0, 1, "false_closure_rate", "a probability in (0, 1)");
  require_between(missed_closure_rate, 0, 1, "missed_closure_rate", "a probability in (0, 1)");
  require(std::isfinite(max_odds_factor) && max_odds_factor >= 1, "max_odds_factor",
          max_odds_factor, "a factor of at least 1");
  require(std::isfinite(min_confidence) && min_confidence >= 0 && min_confidence <= 1,
          "min_confidence", min_confidence, "a probability in [0, 1]");
  require(std::isfinite(min_alternative_confidence) && min_alternative_confidence >= 0 &&
              min_alternative_confidence <= 1,
          "min_alternative_confidence", min_alternative_confidence, "a probability in [0, 1]");
  require(modes >= 1 && modes <= 16, "modes", modes, "1 to 16");
  require(neighbors >= 2 && neighbors <= 1024, "neighbors", neighbors, "2 to 1024");
  require(iterations >= 1 && iterations <= 100, "iterations", iterations, "1 to 100");
}

std::vector<PairConsistency> loop_consistency(const std::vector<Pair>& pairs,
                                              const std::vector<RegistrationResult>& results,
                                              const LoopConsistencyOptions& options) {
  options.validate();
  check(pairs, results);
  ConsistencyGraph graph(pairs, results, options);
  for (std::uint32_t k = 0; k < options.iterations; ++k) update_from_loops(graph);
  update_from_paths(graph);

  std::vector<PairConsistency> out(pairs.size());
  for (std::size_t p = 0; p < out.size(); ++p) out[p].confidence = results[p].score;
  for (const ConsistencyEdge& edge : graph.edges()) {
    if (edge.loops == 0 && edge.path == 0) continue;
    const std::size_t best = edge.most_likely();
    out[edge.pair] = {edge.probability[best], edge.candidates[best].mode, edge.loops, edge.path};
  }
  return out;
}

}  // namespace gpureg
