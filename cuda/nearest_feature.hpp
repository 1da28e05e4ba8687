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
  const std::uint16_t *query_half, *row_half;  ///< see FeatureAids; null: not made
  const float *query_padded, *row_padded;
  const float* query_error;
  const float2* row_square;
  const float *query_scale, *row_scale;
};

/// Nearest rows of every query: k indices per query in order of distance (squared norm of the difference as a chain of fmaf over the
/// dimensions, then the lower index), kNoValue where fewer exist. Exactly what cpu::nearest_features finds.
DeviceBuffer<std::uint32_t> nearest_features(Exec& exec, const std::vector<FeatureQuery>& queries, std::uint32_t k, std::size_t answers);

/// Rows are cut into parts only where the queries alone do not fill the device: rows per part, a multiple of the tile.
std::uint32_t rows_of_part(const Exec& exec, std::size_t query_blocks, std::uint32_t most_rows, std::uint32_t tile);

/// Most features of rooms are near that of a plane. Distances do not change when it is taken off both features, but the lengths that the
/// rounding of their product grows with do.
GPUREG_HD float center_of_fpfh(std::uint32_t d) { return d < kFpfhSize && d % kFpfhBins == kFpfhBins / 2 ? 100.0f : 0.0f; }

/// Let v be a feature, v' what binary16 makes of it, square = |v|^2 and lost = |v - v'|^2. Then for every two features
///   | |a - b|^2 - (|a|^2 + |b|^2 - 2 a'.b') |  <=  product_error(a) + product_error(b),
/// since 2 (a.b - a'.b') = 2 a.(b - b') + 2 (a - a').b - 2 (a - a').(b - b'), and 2 x.y <= s |x|^2 + |y|^2 / s for every s > 0; this s makes
/// it least for what rounding to 11 bits loses on average. The last term is for the roundings of float32: of the squares, of the products'
/// sums, and of the distance itself.
GPUREG_HD float product_error(float square, float lost) {
  constexpr float kSpread = 2e-4f, kRounding = 2e-5f;
  return (kSpread + kRounding) * square + (1.0f / kSpread + 2.0f) * lost;
}

/// Features for the tensor cores: rows padded with zeros to this width, zero where not valid. 0: too many dimensions.
inline std::uint32_t half_width(std::uint32_t dimension) { return dimension <= 64 ? (dimension + 15) / 16 * 16 : 0; }
/// The same for those that distances are measured of.
inline std::uint32_t padded_width(std::uint32_t dimension) {
  return dimension > 64 ? 0 : dimension > 32 && dimension <= 36 ? 36 : half_width(dimension);
}

/// For k = 1: the tensor cores tell which rows can be the nearest, and only those are measured exactly. Folds (distance, index) into `best`
/// by atomicMin, as the plain search does. batch is on the device; all entries have these dimensions. Needs compute capability 8.0.
void filter_nearest(Exec& exec, const FeatureQuery* batch, unsigned entries, std::uint32_t most_queries, std::uint32_t most_rows,
                    std::uint32_t dimensions, std::size_t answers, unsigned long long* best);

}  // namespace gpureg::cuda
