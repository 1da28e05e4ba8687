// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// No edge is certain: keeps odds finite.
constexpr double kMostConfidence = 1 - 1e-9;

/// Log odds and back: a confidence of exactly the minimum counts.
constexpr double kRounding = 1e-9;

/// The edges between two parts of a map, added in descending order of confidence.
///
/// Scans that see the same place fail together, and loop consistency raises what fails together.
/// Between parts of several scans only edges that share no scan count therefore, by the pair alone.
/// A part of one scan has no others: there every edge counts.
class Connection {
 public:
  /// @param lone one of the parts is a single scan.
  void add(const Edge& edge, bool lone);
  /// Odds of: one of the accepted edges is correct, one of the rejected ones is, none is.
  double confidence() const;

 private:
  double accepted_wrong_ = 1, rejected_wrong_ = 1;  ///< probabilities that all of them are wrong
  std::vector<std::uint32_t> used_, used_against_;  ///< scans of edges that counted
};

/// Indices of the edges, the most confident first.
std::vector<std::size_t> by_confidence(const std::vector<Edge>& edges);

/// Parts of the map whose connections are certain: sets of scans, merged as long as the accepted
/// edges between two sets reach the confidence together. Rejected edges between them count against
/// it. The most certain connections are made first, so that the others are judged by all edges
/// between the parts. Odometry is certain.
/// @return number of the part of each scan.
std::vector<std::uint32_t> certain_parts(std::size_t scans, const std::vector<Edge>& edges,
                                         const std::vector<Odometry>& odometry,
                                         double min_confidence);

/// Splits parts at the connections of weakest_links() that do not reach the confidence, the most
/// contradicted first. Two small parts can be joined by certain edges while many edges between all
/// that grew around them say otherwise: only the whole part shows it. Odometry is never split.
void split_at_weak_links(const std::vector<Edge>& edges, const std::vector<Odometry>& odometry,
                         double min_confidence, std::vector<std::uint32_t>& parts);

/// How far the pose of an edge is from that of the map, metres: 0 up to max_error, RMS over the
/// overlap. Both scans are placed, in one island.
double deviation(const Edge& edge, const Reconstruction& map, double max_error);

/// Rejects accepted edges whose pose is farther from that of the map than max_error, RMS over the
/// overlap, the farthest first, as long as other accepted edges or odometry connect their scans.
/// @return number of edges rejected.
std::size_t reject_deviating(Reconstruction& map, double max_error);

/// Scan::confidence and Scan::reason of the placed scans.
void set_confidence(Reconstruction& map);

}  // namespace gpureg::reconstruction
