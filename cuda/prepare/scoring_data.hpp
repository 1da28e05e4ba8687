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
  std::size_t runs, bricks, blocks, cells, positions, near, near_index;
  std::size_t points, normals, index;
  std::size_t bytes;
  bool has_table() const { return nx > 0; }
};

ScoringLayout scoring_layout(std::uint32_t points, const ClosestGridSize& size,
                             const CellRange& blocks);
/// Sets the cloud's pointers into the memory that was laid out.
void place_scoring_data(const ScoringLayout& layout, const ClosestGeometry& geometry, char* memory,
                        CudaCloud& cloud);
/// Fills the memory of all clouds, which is zero before.
void fill_scoring_data(Exec& exec, const std::vector<std::shared_ptr<CudaCloud>>& clouds,
                       const ClosestGrids& grids);

/// A cloud and its closest-point grid on the device.
struct ScoringSlot {
  CloudView view;
  CellSummaries summaries;
  ScoringOrder order;
  ClosestGeometry geometry;
  std::uint32_t block_count;
  const Cell* blocks;
  const std::uint32_t* cell_start;  ///< blocks x 513
  const std::uint32_t* candidates;
  const std::uint32_t *near_start, *list_start;  ///< per block, in the batch
  const std::uint32_t* near;                     ///< of the batch
  std::uint32_t group_step;                      ///< coprime to the number of groups
  std::uint32_t point_offset;                    ///< in the batch
};

/// Packs the candidates of all cells, see candidate_lists.hpp. Part of fill_scoring_data(), after
/// the bricks have numbers. most_blocks: of a cloud.
void pack_lists(Exec& exec, const DeviceBuffer<ScoringSlot>& slots, std::uint32_t most_blocks);

}  // namespace gpureg::cuda
