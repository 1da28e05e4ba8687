// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/map_state.hpp"

namespace gpureg::localization {

/// A pose that a tile, or the plan of the map, proposes for a scan.
struct Candidate {
  UnalignedIsometry3d map_from_scan = no_pose();
  double confidence = 0;
  std::size_t tile = 0, mode = 0;
  double agreeing = 0;  ///< of a place of the plan: share of the scan's points that agree with it
};

/// Of two poses that move the middle of the scan to one place with one attitude, one is enough.
bool same_place(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                const Eigen::Vector3d& middle, const EvidenceSettings& options);

/// The most confident candidates, each of another place.
std::vector<Candidate> distinct(std::vector<Candidate> candidates, const Eigen::Vector3d& middle,
                                const EvidenceSettings& options, std::size_t most);

/// The map within a distance of the scan's points at a pose, without sides that are inferred.
PointCloud neighborhood(const MapState& map, const std::vector<Eigen::Vector3d>& scan,
                        const UnalignedIsometry3d& map_from_scan, double distance);

/// Odds of a confidence, bounded: differences of near-certain ones do not tell places apart.
double odds_of(double confidence);

/// Shares the probability among places: each has the odds that it would have alone, and so has
/// "nowhere", with odds of 1.
/// @return probability of each place, and that of none at the end.
std::vector<double> shared_probability(const std::vector<double>& alone);

}  // namespace gpureg::localization
