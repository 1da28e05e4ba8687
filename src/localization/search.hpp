// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/candidates.hpp"

namespace gpureg::localization {

/// A scan on its way through the map.
struct Scan {
  PreparedCloud cloud, coarse;          ///< in voxels of the map, and of the coarse search
  std::vector<Eigen::Vector3d> points;  ///< of `cloud`, in the scan's frame
  Eigen::Vector3d middle{0, 0, 0};
  double reach = 0;  ///< largest distance of a point from the origin of the frame
  LocatePrior prior;
  std::size_t tiles = 0;  ///< that the scan was aligned with
  std::vector<Candidate> candidates;
  std::vector<double> best;  ///< per tile: the largest confidence of a mode
};

/// @param coarse may be an empty handle.
Scan scan_of(PreparedCloud cloud, PreparedCloud coarse, const LocatePrior& prior);

bool contradicts(const Scan& scan, const UnalignedIsometry3d& map_from_scan);

/// Preparation of scans and tiles for the coarse search.
PrepareOptions coarse_prepare(const MapState& map, const LocateOptions& options);

/// Aligns the scans with all tiles in coarse voxels, and keeps the most confident places.
void search_all_tiles(const Context& context, const MapState& map, const LocateOptions& options,
                      std::vector<Scan>& scans);

/// Aligns the scans of `which` with the `fine_tiles` tiles that were the most confident in the
/// coarse search, in voxels of the map.
void search_best_tiles(const Context& context, const MapState& map, const LocateOptions& options,
                       const std::vector<std::size_t>& which, std::vector<Scan>& scans);

}  // namespace gpureg::localization
