// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "algorithm/cell_summary.hpp"
#include "cpu/common/stage_data.hpp"

/// Bounds that let the CPU decide most points of a hypothesis without reading a target point: per
/// cell of the closest-point grid, a bound on the normals of all its candidates, and a bit for
/// cells in which every location has a candidate within the distance.
namespace gpureg::cpu {

/// Points in groups of 64 that spread over the cloud, one array per coordinate, padded with NaN to
/// whole vectors.
ScoringOrder scoring_order(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                           float cell_size);

/// Summaries of the cells of one closest-point grid; points and normals are the cloud's.
CellSummaries summarize_cells(const ClosestGrid& closest, float search_distance, float cloud_radius,
                              const std::vector<Vec3>& points, const std::vector<Vec3>& normals);

struct PointBounds {
  std::uint64_t possible;  ///< bit k is 0 only where point first + k is definitely no inlier
  std::uint64_t certain;   ///< bit k is 1 only where it definitely is one
};

/// Summary index of the cell of each of 64 moved points; 0, an empty summary, where there is no
/// block. first: a multiple of 64.
void locate_cells(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                  const CellSummaries& summaries, std::int32_t* cells);

/// Bounds of 64 points from the summaries of their cells.
PointBounds bound_inliers(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                          const CellSummaries& summaries, const SummaryLimits& limits,
                          const std::int32_t* cells);

}  // namespace gpureg::cpu
