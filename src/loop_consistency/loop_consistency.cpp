// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <cmath>
#include <string>

#include "common/rigid.hpp"
#include "fields/in_units.hpp"
#include "fields/loop_consistency.hpp"
#include "fields/validate.hpp"
#include "loop_consistency/consistency_graph.hpp"

namespace gpureg {
namespace {

/// @param name of the value, made where it is none: thousands of results are right.
template <typename Name>
void check_probability(double value, const Name& name) {
  if (!(value >= 0 && value <= 1)) throw_option(name().c_str(), value, "a probability in [0, 1]");
}

template <typename Name>
void check_rigid(const UnalignedIsometry3d& pose, const Name& name) {
  if (!why_not_rigid(pose.matrix()).empty()) require_rigid(pose, name());
}

void check(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results) {
  if (results.size() != pairs.size())
    throw InvalidArgument("results has " + std::to_string(results.size()) +
                          " entries, but pairs has " + std::to_string(pairs.size()));
  for (std::size_t p = 0; p < results.size(); ++p) {
    const auto name = [p](const char* field) {
      return [p, field] { return "results[" + std::to_string(p) + "]." + field; };
    };
    check_probability(results[p].confidence, name("confidence"));
    if (results[p].has_pose())
      check_rigid(results[p].target_from_source, name("target_from_source"));
    for (std::size_t m = 0; m < results[p].modes.size(); ++m) {
      const auto of_mode = [&](const char* field) {
        return [&, field] { return name("modes")() + "[" + std::to_string(m) + "]." + field; };
      };
      check_probability(results[p].modes[m].confidence, of_mode("confidence"));
      check_rigid(results[p].modes[m].target_from_source, of_mode("target_from_source"));
    }
  }
}

}  // namespace

void LoopConsistencyOptions::validate() const { fields::validate(*this); }

std::vector<PairConsistency> loop_consistency(const std::vector<Pair>& pairs,
                                              const std::vector<RegistrationResult>& results,
                                              const LoopConsistencyOptions& options) {
  options.validate();
  check(pairs, results);
  const LoopConsistencyOptions in_units = fields::in_units(options, options.voxel_size);
  ConsistencyGraph graph(pairs, results, in_units);
  for (std::uint32_t k = 0; k < options.iterations; ++k) update_from_loops(graph);
  update_from_paths(graph);

  std::vector<PairConsistency> out(pairs.size());
  for (std::size_t p = 0; p < out.size(); ++p) out[p].confidence = results[p].confidence;
  for (const ConsistencyEdge& edge : graph.edges()) {
    if (edge.loops == 0 && edge.path == 0) continue;
    const std::size_t best = edge.most_likely();
    out[edge.pair] = {edge.probability[best], edge.candidates[best].mode, edge.loops, edge.path};
  }
  return out;
}

}  // namespace gpureg
