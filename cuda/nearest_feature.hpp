// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "algorithm/fpfh.hpp"
#include "exec.hpp"

namespace gpureg::cuda {

/// One cloud's features asked for in another's; all pointers on the device.
struct FeatureQuery {
  const float* queries;
  const std::uint8_t* query_valid;
  std::uint32_t query_count;
  const float* rows;
  const std::uint8_t* row_valid;
  std::uint32_t row_count;
  std::uint32_t dimension;
  std::uint32_t out;  ///< where its answers begin
  const float2* query_norm;        ///< squared length and length, of the difference to a constant where that makes them shorter
  const float2* row_norm;          ///< infinite where the row is not valid, or equal to one before it
  const std::uint32_t* query_tf32;  ///< see filter_width(); null: not made
  const std::uint32_t* row_tf32;
  const float* query_padded;        ///< rows as wide, not rounded
  const float* row_padded;
};

/// Nearest rows of every query: k indices per query in order of distance (squared norm of the difference as a chain of fmaf over the
/// dimensions, then the lower index), kNoValue where fewer exist. Exactly what cpu::nearest_features finds.
DeviceBuffer<std::uint32_t> nearest_features(Exec& exec, const std::vector<FeatureQuery>& queries, std::uint32_t k, std::size_t answers);

/// Rows are cut into parts only where the queries alone do not fill the device: rows per part, a multiple of the tile.
std::uint32_t rows_of_part(const Exec& exec, std::size_t query_blocks, std::uint32_t most_rows, std::uint32_t tile);

/// Most features of rooms are near that of a plane. Distances do not change when it is taken off both features, but the lengths that the
/// rounding of their product grows with do.
GPUREG_HD float center_of_fpfh(std::uint32_t d) { return d < kFpfhSize && d % kFpfhBins == kFpfhBins / 2 ? 100.0f : 0.0f; }

/// Features for the tensor cores: rounded to tf32, rows padded with zeros to this width, zero where not valid. 0: too many dimensions.
inline std::uint32_t filter_width(std::uint32_t dimension) { return dimension <= 16 ? 16 : dimension <= 40 ? 40 : dimension <= 64 ? 64 : 0; }

/// For k = 1: the tensor cores tell which rows can be the nearest, and only those are measured exactly. Folds (distance, index) into `best`
/// by atomicMin, as the plain search does. batch is on the device; all entries have these dimensions. Needs compute capability 8.0.
void filter_nearest(Exec& exec, const FeatureQuery* batch, unsigned entries, std::uint32_t most_queries, std::uint32_t most_rows,
                    std::uint32_t dimensions, std::size_t answers, unsigned long long* best);

}  // namespace gpureg::cuda
