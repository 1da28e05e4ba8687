// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

/// Scoring data beside the cloud itself: cell summaries and the order of the points. Last step of
/// assemble().
namespace gpureg::cuda {

struct ScoringLayout {
  Cell first_block;         ///< of the table
  std::int32_t nx, ny, nz;  ///< 0: too wide for a table
  /// where each array begins
  std::size_t runs, bricks, blocks, cells, candidates, points, normals, index;
  std::size_t bytes;
};

ScoringLayout scoring_layout(const CudaCloud& cloud, const CellRange& blocks);
/// Sets the cloud's pointers into the memory that was laid out.
void place_scoring_data(const ScoringLayout& layout, const ClosestGeometry& geometry, char* memory,
                        CudaCloud& cloud);
/// Fills the memory of all clouds, which is zero before.
void fill_scoring_data(Exec& exec, const std::vector<std::shared_ptr<CudaCloud>>& clouds,
                       const std::vector<ClosestGeometry>& geometry);

}  // namespace gpureg::cuda
