// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "algorithm/fpfh.hpp"
#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// Search of the features of one cloud in those of another; all pointers on the device.
struct FeatureQuery {
  const float* queries;  ///< rows of row_stride() floats
  const std::uint8_t* query_valid;
  const std::uint32_t* query_row;  ///< row of each query; null: query k is row k
  std::uint32_t query_count;
  const float* rows;
  const std::uint8_t* row_valid;
  std::uint32_t row_count;
  std::uint32_t dimension;
  std::uint32_t out;                           ///< first element of its results
  const std::uint16_t *query_half, *row_half;  ///< see FeatureAids; null: not made
  HalfCopy copy;                               ///< of both
  const float* query_error;
  const float2* row_square;
  const float *query_scale, *row_scale;

  GPUREG_HD std::uint32_t row_of(std::uint32_t query) const {
    return query_row ? query_row[query] : query;
  }
};

/// Nearest rows of every query: k indices per query in order of distance (squared norm of the
/// difference as a chain of fmaf over the dimensions, then the lower index), kNoValue where fewer
/// exist. Equals cpu::nearest_features bit for bit.
DeviceBuffer<std::uint32_t> nearest_features(Exec& exec, const std::vector<FeatureQuery>& queries,
                                             std::uint32_t k, std::size_t answers);

/// Rows per part, a multiple of the tile. Rows are split only where the queries alone do not fill
/// the device.
std::uint32_t rows_of_part(const Exec& exec, std::size_t query_blocks, std::uint32_t most_rows,
                           std::uint32_t tile);

/// Most features of rooms are near that of a plane. Subtracting it from both features changes no
/// distance, but shortens the vectors, with which the rounding error of their product grows.
GPUREG_HD float center_of_fpfh(std::uint32_t d) {
  return d < kFpfhSize && d % kFpfhBins == kFpfhBins / 2 ? 100.0f : 0.0f;
}

/// An orthonormal basis (Helmert's) for centred FPFH. Only 30 of its dimensions are not zero, as
/// each of the three histograms adds up to 100. Features of rooms differ most in the middle bins of
/// all three histograms. That is one dimension; the copies for the tensor cores hold it to 22 bits,
/// in the space of the unused dimensions. value(d): component d; put(k, v) for k = 0..28;
/// put_axis(v): the middle dimension; leave_out(v): nearly zero. Rounding errors are below 1e-6 of
/// the length.
template <typename Value, typename Put, typename PutAxis, typename LeaveOut>
GPUREG_HD void turn_fpfh(const Value& value, const Put& put, const PutAxis& put_axis,
                         const LeaveOut& leave_out) {
  constexpr int kMiddle = kFpfhBins / 2, kLast = kFpfhBins - 1;
  float middle[3];
  for (int part = 0; part < 3; ++part) {
    float sum = value(part * kFpfhBins);
    for (int k = 1; k <= kLast; ++k) {
      // The middle comes last.
      const float v = value(part * kFpfhBins + (k == kLast    ? kMiddle
                                                : k < kMiddle ? k
                                                              : k + 1)),
                  n = static_cast<float>(k);
      const float turned = (sum - n * v) / sqrtf(n * (n + 1.0f));
      if (k < kLast)
        put(part * (kLast - 1) + k - 1, turned);
      else
        middle[part] = turned;
      sum = sum + v;
    }
    leave_out(sum / sqrtf(static_cast<float>(kFpfhBins)));
  }
  put(3 * (kLast - 1), (middle[0] - middle[1]) / sqrtf(2.0f));
  put(3 * (kLast - 1) + 1, (middle[0] + middle[1] - 2.0f * middle[2]) / sqrtf(6.0f));
  put_axis((middle[0] + middle[1] + middle[2]) / sqrtf(3.0f));
}

/// Let v be a feature, v' its rounding to binary16, square = |v|^2, rest = the part of it beyond 22
/// bits, and lost = |v - v'|^2. Then for every two features
///   | |a - b|^2 - (|a|^2 + |b|^2 - 2 a'.b') |  <=  product_error(a) + product_error(b),
/// since 2 (a.b - a'.b') = 2 a.(b - b') + 2 (a - a').b - 2 (a - a').(b - b'), and 2 x.y <= s |x|^2
/// + |y|^2 / s for every s > 0. This s minimises the bound for the average loss of rounding to 11
/// bits. The last term covers the rounding of float32: of the squares, of the turned copies, of the
/// sums of products, of the bits beyond 22, and of the distance itself.
GPUREG_HD float product_error(float square, float rest, float lost) {
  constexpr float kSpread = 2e-4f, kRounding = 2.5e-5f;
  return kSpread * rest + kRounding * square + (1.0f / kSpread + 2.0f) * lost;
}

/// Position of the first eleven bits of the axis in a turned copy; the next eleven bits follow,
/// then the first ones again. A query has them in the order first, first, next, so the product of
/// the three is that of 22 bits up to a relative error of 2^-22.
constexpr std::uint32_t kAxisPlace = 29, kTurnedWidth = 32;

/// Features for the tensor cores: rows padded with zeros to this width, zero where not valid. 0:
/// too many dimensions.
GPUREG_HD std::uint32_t half_width(std::uint32_t dimension, HalfCopy copy) {
  return copy == HalfCopy::turned ? kTurnedWidth : dimension <= 64 ? (dimension + 15) / 16 * 16 : 0;
}
/// Width of the rows for exact distances, padded with zeros. 0: too many dimensions.
GPUREG_HD std::uint32_t padded_width(std::uint32_t dimension) {
  return dimension > 64                      ? 0
         : dimension > 32 && dimension <= 36 ? 36
                                             : half_width(dimension, HalfCopy::plain);
}

/// Floats between the rows of features on the device: they are filled up with zeros where the
/// filter reads them.
GPUREG_HD std::uint32_t row_stride(std::uint32_t dimension) {
  const std::uint32_t padded = padded_width(dimension);
  return padded > 0 ? padded : dimension;
}
/// The rows without the zeros between them.
inline std::vector<float> tight_rows(std::vector<float> rows, std::uint32_t dimension) {
  const std::uint32_t stride = row_stride(dimension);
  if (stride == dimension) return rows;
  const std::size_t size = rows.size() / stride;
  for (std::size_t i = 0; i < size; ++i)
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(i * stride), dimension,
                rows.begin() + static_cast<std::ptrdiff_t>(i * dimension));
  rows.resize(size * dimension);
  return rows;
}

/// True where filter_nearest() was compiled for tensor cores with float32 sums: architecture 8.0.
bool has_filter(const Exec& exec);

/// Search for k = 1: the tensor cores determine the rows that can be the nearest, and only those
/// are measured exactly. Folds (distance, index) into `best` by atomicMin, as the plain search
/// does. batch: on the device; all entries have equal dimensions and copies. Needs has_filter().
void filter_nearest(Exec& exec, const FeatureQuery* batch, unsigned entries,
                    std::uint32_t most_queries, std::uint32_t most_rows, std::uint32_t dimensions,
                    HalfCopy copy, std::size_t answers, unsigned long long* best);

}  // namespace gpureg::cuda
