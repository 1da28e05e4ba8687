// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/agreement.hpp"

#include <cmath>
#include <string>

#include "api/agreement_graph.hpp"
#include "api/validate.hpp"

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

AgreementOptions AgreementOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a length > 0");
  AgreementOptions options;
  options.closing_distance = 3.0f * voxel_size;
  return options;
}

void AgreementOptions::validate() const {
  require(std::isfinite(closing_angle) && closing_angle > 0 && closing_angle <= 180,
          "closing_angle", closing_angle, "degrees in (0, 180]");
  require(positive(closing_distance), "closing_distance", closing_distance, "a length > 0");
  require_between(chance, 0, 1, "chance", "a probability in (0, 1)");
  require_between(miss, 0, 1, "miss", "a probability in (0, 1)");
  require(std::isfinite(max_factor) && max_factor >= 1, "max_factor", max_factor,
          "a factor of at least 1");
  require(std::isfinite(min_confidence) && min_confidence >= 0 && min_confidence <= 1,
          "min_confidence", min_confidence, "a probability in [0, 1]");
  require(std::isfinite(min_rival) && min_rival >= 0 && min_rival <= 1, "min_rival", min_rival,
          "a probability in [0, 1]");
  require(modes >= 1 && modes <= 16, "modes", modes, "1 to 16");
  require(neighbors >= 2 && neighbors <= 1024, "neighbors", neighbors, "2 to 1024");
  require(rounds >= 1 && rounds <= 100, "rounds", rounds, "1 to 100");
}

std::vector<PairAgreement> agreement(const std::vector<Pair>& pairs,
                                     const std::vector<RegistrationResult>& results,
                                     const AgreementOptions& options) {
  options.validate();
  check(pairs, results);
  AgreementGraph graph(pairs, results, options);
  for (std::uint32_t round = 0; round < options.rounds; ++round) listen_to_loops(graph);
  listen_to_paths(graph);

  std::vector<PairAgreement> out(pairs.size());
  for (std::size_t p = 0; p < out.size(); ++p) out[p].confidence = results[p].score;
  for (const AgreementEdge& edge : graph.edges()) {
    if (edge.loops == 0 && edge.path == 0) continue;
    const std::size_t best = edge.likeliest();
    out[edge.pair] = {edge.belief[best], edge.candidates[best].mode, edge.loops, edge.path};
  }
  return out;
}

}  // namespace gpureg
