// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/candidates.hpp"

namespace gpureg::localization {

/// A scan on its way through the map.
struct Scan {
  PreparedCloud cloud;                  ///< in voxels of the map
  PreparedCloud coarse, coarsest;       ///< of the searches of tiles; may be empty handles
  std::vector<Eigen::Vector3d> points;  ///< of `cloud`, in the scan's frame
  Eigen::Vector3d middle{0, 0, 0};
  double reach = 0;  ///< largest distance of a point from the origin of the frame
  LocatePrior prior;
  std::size_t tiles = 0;  ///< that the scan was aligned with
  std::vector<Candidate> candidates;
  std::vector<Candidate> planned;  ///< those of the plan of the map
  std::vector<double> best;        ///< per tile: the largest confidence of a mode
};

/// So many points show enough of a place to tell that it is not there.
constexpr std::size_t kTellingPoints = 1000;

Scan scan_of(PreparedCloud cloud, const LocatePrior& prior);

bool contradicts(const Scan& scan, const UnalignedIsometry3d& map_from_scan);

/// The most confident candidates of different places, without hopeless ones.
void keep_likely(const LocateSettings& options, Scan& scan);

/// Preparation of scans and tiles in voxels `factor` times as wide as those of the map.
PrepareSettings prepare_for(const MapState& map, double factor);

/// Voxels of the search before the coarse one, in voxels of the map; 0: a map of so few tiles needs
/// none.
double coarsest_factor(const MapState& map, const LocateSettings& options);

/// Aligns the scans with all tiles in coarse voxels, and keeps the most confident places. A scan
/// that may be in more than `coarse_tiles` tiles, and has enough points in coarser voxels, is
/// aligned with all of them in those, and in coarse voxels with the best.
void search_all_tiles(const Context& context, const MapState& map, const LocateSettings& options,
                      std::vector<Scan>& scans);

/// Aligns the scans of `which` with the `fine_tiles` tiles that were the most confident in the
/// coarse search, in voxels of the map.
void search_best_tiles(const Context& context, const MapState& map, const LocateSettings& options,
                       const std::vector<std::size_t>& which, std::vector<Scan>& scans);

}  // namespace gpureg::localization
