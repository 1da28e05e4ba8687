// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <cmath>
#include <string>

#include "common/rigid.hpp"
#include "fields/loop_consistency.hpp"
#include "fields/scale.hpp"
#include "fields/validate.hpp"
#include "loop_consistency/consistency_graph.hpp"

namespace gpureg {
namespace {

double probability(double value, const std::string& name) {
  require(std::isfinite(value) && value >= 0 && value <= 1, name.c_str(), value,
          "a probability in [0, 1]");
  return value;
}

const UnalignedIsometry3d& rigid(const UnalignedIsometry3d& pose, const std::string& name) {
  require_rigid(pose, name);
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

}  // namespace

LoopConsistencyOptions LoopConsistencyOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a length > 0");
  LoopConsistencyOptions options;
  fields::scale(options, voxel_size);
  return options;
}

void LoopConsistencyOptions::validate() const { fields::validate(*this); }

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
