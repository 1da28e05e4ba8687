// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// The edges between two parts of a map.
struct Connection {
  double accepted_wrong = 1, rejected_wrong = 1;  ///< probabilities that all of them are wrong

  void add(double confidence, bool accepted);
  /// Odds of: one of the accepted edges is correct, one of the rejected ones is, none is.
  double confidence() const;
};

/// Parts of the map whose connections are certain: sets of scans, merged as long as the accepted
/// edges between two sets reach the confidence together. Rejected edges between them count against
/// it. Odometry is certain.
/// @return number of the part of each scan.
std::vector<std::uint32_t> certain_parts(std::size_t scans, const std::vector<Edge>& edges,
                                         const std::vector<Odometry>& odometry,
                                         double min_confidence);

/// Rejects accepted edges whose pose is farther from that of the map than max_error, RMS over the
/// overlap, the farthest first, as long as other accepted edges or odometry connect their scans.
/// @return number of edges rejected.
std::size_t reject_deviating(Reconstruction& map, double max_error);

/// Scan::confidence and Scan::reason of the placed scans.
void set_confidence(Reconstruction& map);

}  // namespace gpureg::reconstruction
