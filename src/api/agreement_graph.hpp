// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "gpureg/agreement.hpp"

namespace gpureg {

/// A pose of a pair that takes part, from its second cloud into its first one.
struct AgreementCandidate {
  UnalignedIsometry3d first_from_second;
  double prior;
  std::uint32_t mode;
};

/// A pair that takes part; first < second are dense numbers of clouds.
struct AgreementEdge {
  std::uint32_t first, second;
  std::size_t pair;
  std::vector<AgreementCandidate> candidates;
  std::vector<double> belief;  ///< of each candidate: the probability that it is right
  std::uint32_t loops = 0;     ///< of three that were looked at
  std::uint32_t path = 0;      ///< edges of the path it was compared with; 0: none

  std::size_t likeliest() const;
  double trust() const { return belief[likeliest()]; }
  UnalignedIsometry3d pose(std::size_t candidate, std::uint32_t into) const;
};

/// The edge by which a cloud knows another one.
struct AgreementNeighbor {
  std::uint32_t cloud;
  std::uint32_t edge;
};

/// Clouds, and the pairs between them that take part. Nothing depends on the order of the caller's
/// pairs.
class AgreementGraph {
 public:
  AgreementGraph(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
                 const AgreementOptions& options);

  const AgreementOptions& options() const { return options_; }
  std::size_t clouds() const { return clouds_.size(); }
  /// Middle of what took part in correspondences, in the cloud's frame.
  const Eigen::Vector3d& centre(std::uint32_t cloud) const { return centres_[cloud]; }
  std::vector<AgreementEdge>& edges() { return edges_; }
  const std::vector<AgreementEdge>& edges() const { return edges_; }
  /// By number; the most confident ones where there are many.
  const std::vector<AgreementNeighbor>& neighbors(std::uint32_t cloud) const {
    return neighbors_[cloud];
  }

  /// How much likelier the closing error of a loop is when all its poses are right than when one is
  /// not. tolerance: in those of a loop of three; points: where the error is looked at.
  double closing_ratio(const UnalignedIsometry3d& loop, double tolerance,
                       std::initializer_list<Eigen::Vector3d> points) const;

 private:
  void number_clouds(const std::vector<Pair>& pairs);
  std::uint32_t number(std::uint32_t cloud) const;
  void find_centres(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results);
  void find_edges(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results);
  void find_neighbors();

  const AgreementOptions& options_;
  std::vector<std::uint32_t> clouds_;
  std::vector<Eigen::Vector3d> centres_;
  std::vector<AgreementEdge> edges_;
  std::vector<std::vector<AgreementNeighbor>> neighbors_;
};

/// Nothing is so certain that others could not speak against it.
constexpr double kLeastDoubt = 1e-6;

/// A damped round over all loops of three; beliefs from those of the round before, so that no order
/// matters.
void listen_to_loops(AgreementGraph& graph);

/// What the most trusted paths say, once, after the loops. Places that look alike agree with each
/// other in all loops of three, but seldom with the way that leads from one to the other: pairs of
/// high belief, from cloud to cloud. The most trusted ones that connect all clouds (a maximum
/// spanning forest) are taken as they are; every other pair is compared with the path between its
/// clouds.
void listen_to_paths(AgreementGraph& graph);

}  // namespace gpureg
