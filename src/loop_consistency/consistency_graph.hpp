// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "gpureg/loop_consistency.hpp"

namespace gpureg {

/// A pose of a pair that takes part, from its second cloud into its first one.
struct ConsistencyCandidate {
  UnalignedIsometry3d first_from_second;
  double prior;
  std::uint32_t mode;
};

/// A pair that takes part; first < second are dense numbers of clouds.
struct ConsistencyEdge {
  std::uint32_t first, second;
  std::size_t pair;
  std::vector<ConsistencyCandidate> candidates;
  std::vector<double> probability;  ///< that the candidate is correct
  std::uint32_t loops = 0;          ///< loops of three that it is in
  std::uint32_t path = 0;           ///< edges of the path that it was compared with; 0: none

  std::size_t most_likely() const;
  double confidence() const { return probability[most_likely()]; }
  UnalignedIsometry3d pose(std::size_t candidate, std::uint32_t into) const;
};

/// An edge of a cloud and the cloud at its other end.
struct ConsistencyNeighbor {
  std::uint32_t cloud;
  std::uint32_t edge;
};

/// The clouds and the pairs between them that take part. Independent of the order of the pairs.
class ConsistencyGraph {
 public:
  ConsistencyGraph(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
                   const LoopConsistencyOptions& options);

  const LoopConsistencyOptions& options() const { return options_; }
  std::size_t clouds() const { return clouds_.size(); }
  /// Mean of the points in correspondences, in the cloud's frame.
  const Eigen::Vector3d& centre(std::uint32_t cloud) const { return centres_[cloud]; }
  std::vector<ConsistencyEdge>& edges() { return edges_; }
  const std::vector<ConsistencyEdge>& edges() const { return edges_; }
  /// In order of their numbers; the most confident ones where there are more than
  /// options.neighbors.
  const std::vector<ConsistencyNeighbor>& neighbors(std::uint32_t cloud) const {
    return neighbors_[cloud];
  }

  /// Likelihood ratio of a closing error: all poses of the loop correct, over at least one false.
  /// tolerance: relative to a loop of three; points: where the translation error is measured.
  double closing_ratio(const UnalignedIsometry3d& loop, double tolerance,
                       std::initializer_list<Eigen::Vector3d> points) const;

 private:
  /// Errors from which the ratio is missed_closure_rate without its exponential: those of most
  /// loops.
  struct Floor {
    explicit Floor(const LoopConsistencyOptions& options);
    double most = 0;     ///< sum of the squared errors, in standard deviations
    double cosine = -2;  ///< of the angle of a loop of three
  };

  void number_clouds(const std::vector<Pair>& pairs);
  std::uint32_t number(std::uint32_t cloud) const;
  void find_centres(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results);
  void find_edges(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results);
  void find_neighbors();

  const LoopConsistencyOptions& options_;
  Floor floor_;
  std::vector<std::uint32_t> clouds_;
  std::vector<Eigen::Vector3d> centres_;
  std::vector<ConsistencyEdge> edges_;
  std::vector<std::vector<ConsistencyNeighbor>> neighbors_;
};

/// Smallest probability of "none of the candidates".
constexpr double kMinNoneProbability = 1e-6;

/// One damped iteration over all loops of three. It uses the probabilities of the iteration before,
/// so that the order of the edges does not matter.
void update_from_loops(ConsistencyGraph& graph);

/// Compares every edge outside the maximum spanning forest with the path between its clouds, once,
/// after the loops. Perceptual aliases agree with each other in loops of three, but seldom with a
/// path of confident edges from one place to the other.
void update_from_paths(ConsistencyGraph& graph);

}  // namespace gpureg
