// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/byte_rows.hpp"

#include "cpu/common/wide_vectors.hpp"

#ifdef GPUREG_WIDE_TARGET
#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpureg::cpu {
namespace {

constexpr std::size_t kLanes = ByteRows::kLanes, kRows = ByteRows::kRows,
                      kQueries = ByteRows::kQueries, kWords = ByteRows::kWords,
                      kAxes = ByteRows::kAxes, kCoordinates = 4 * kWords;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::int32_t kMissing = std::numeric_limits<std::int32_t>::min() / 2;
constexpr float kMostLength = 1e15f, kLeastLength = 1e-15f;
// The products take one signed factor: the query, shifted by half of the range.
constexpr std::int32_t kShift = 128;
// Far more than the rounding of sums of a thousand products of floats.
constexpr float kRounding = 1e-4f;

/// Some rows minus the middle, for the axes.
std::vector<float> sample(const std::vector<float>& leaves, std::size_t dimension,
                          const std::vector<float>& middle) {
  constexpr std::size_t kMost = 256;
  const std::size_t leaf_values = dimension * kRows, rows = leaves.size() / dimension,
                    stride = std::max<std::size_t>(1, rows / kMost);
  std::vector<float> out;
  for (std::size_t k = 0; k < rows; k += stride) {
    const float* row = leaves.data() + k / kRows * leaf_values + k % kRows;
    if (row[0] == kInfinity) continue;
    for (std::size_t d = 0; d < dimension; ++d) out.push_back(row[d * kRows] - middle[d]);
  }
  return out;
}

/// Makes the columns of axes orthonormal; an axis without length becomes zero.
void orthonormalize(std::vector<float>& axes, std::size_t dimension) {
  for (std::size_t a = 0; a < kAxes; ++a)
    for (int pass = 0; pass < 2; ++pass) {  // the second pass removes what rounding left
      double before = 0, after = 0;
      for (std::size_t d = 0; d < dimension; ++d)
        before += static_cast<double>(axes[d * kLanes + a]) * axes[d * kLanes + a];
      for (std::size_t b = 0; b < a; ++b) {
        double along = 0;
        for (std::size_t d = 0; d < dimension; ++d)
          along += static_cast<double>(axes[d * kLanes + a]) * axes[d * kLanes + b];
        for (std::size_t d = 0; d < dimension; ++d)
          axes[d * kLanes + a] -= static_cast<float>(along * axes[d * kLanes + b]);
      }
      for (std::size_t d = 0; d < dimension; ++d)
        after += static_cast<double>(axes[d * kLanes + a]) * axes[d * kLanes + a];
      const double inverse = after > 1e-8 * before && after > 0 ? 1 / std::sqrt(after) : 0;
      for (std::size_t d = 0; d < dimension; ++d)
        axes[d * kLanes + a] = static_cast<float>(axes[d * kLanes + a] * inverse);
    }
}

/// Roughly the principal axes, by subspace iteration.
std::vector<float> principal_axes(const std::vector<float>& rows, std::size_t dimension) {
  std::vector<std::size_t> order(dimension);
  std::vector<double> variance(dimension, 0);
  for (std::size_t d = 0; d < dimension; ++d) order[d] = d;
  for (std::size_t k = 0; k < rows.size(); ++k)
    variance[k % dimension] += static_cast<double>(rows[k]) * rows[k];
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return variance[a] > variance[b]; });
  std::vector<float> axes(dimension * kLanes, 0.0f), next(axes.size());
  for (std::size_t a = 0; a < std::min(kAxes, dimension); ++a) axes[order[a] * kLanes + a] = 1.0f;
  constexpr int kIterations = 3;
  for (int k = 0; k < kIterations && dimension > kAxes; ++k) {
    std::fill(next.begin(), next.end(), 0.0f);
    for (const float* row = rows.data(); row != rows.data() + rows.size(); row += dimension) {
      float along[kLanes] = {};
      for (std::size_t d = 0; d < dimension; ++d)
        for (std::size_t l = 0; l < kLanes; ++l) along[l] += row[d] * axes[d * kLanes + l];
      for (std::size_t d = 0; d < dimension; ++d)
        for (std::size_t l = 0; l < kLanes; ++l) next[d * kLanes + l] += row[d] * along[l];
    }
    orthonormalize(next, dimension);
    std::swap(axes, next);
  }
  return axes;
}

/// A row as its coordinates along the axes, and at kAxes the length of the rest. Returns the
/// largest error of this vector.
GPUREG_BYTE_TARGET float shorten(const ByteRows& rows, const float* row, std::size_t stride,
                                 float* out) {
  const std::size_t dimension = rows.middle.size();
  __m512 sum = _mm512_setzero_ps();
  double squares = 0;
  for (std::size_t d = 0; d < dimension; ++d) {
    const float v = row[d * stride] - rows.middle[d];
    sum = _mm512_fmadd_ps(_mm512_set1_ps(v), _mm512_loadu_ps(rows.axes.data() + d * kLanes), sum);
    squares += static_cast<double>(v) * v;
  }
  _mm512_storeu_ps(out, sum);
  double rest = squares;
  for (std::size_t a = 0; a < kAxes; ++a) rest -= static_cast<double>(out[a]) * out[a];
  const double within = kRounding * 0.1 * squares, high = std::sqrt(std::max(rest + within, 0.0)),
               low = std::sqrt(std::max(rest - within, 0.0));
  out[kAxes] = static_cast<float>((high + low) / 2);
  return static_cast<float>((high - low) / 2 + kRounding * 0.1 * std::sqrt(squares));
}

/// Rounds the coordinates; returns the length of the rounding error.
float round_coordinates(const ByteRows& rows, const float* values, std::int32_t* out) {
  const float inverse = 1.0f / rows.scale;
  float error = 0;
  for (std::size_t a = 0; a < kCoordinates; ++a) {
    const float v = (values[a] - rows.lowest[a]) * rows.scale + 0.5f;
    out[a] = static_cast<std::int32_t>(std::min(std::max(v, 0.0f), 255.0f));
    const float away = values[a] - rows.lowest[a] - static_cast<float>(out[a]) * inverse;
    error += away * away;
  }
  return std::sqrt(error);
}

GPUREG_BYTE_TARGET void scan(const ByteRows& rows, std::size_t group, const std::int32_t* queries,
                             std::int32_t* out, std::size_t stride) {
  const std::uint8_t* values = rows.values.data() + group * kRows * kWords * kLanes * 4;
  const std::int32_t* start = rows.start.data() + group * kRows * kLanes;
  __m512i most[kQueries];
  for (auto& m : most) m = _mm512_set1_epi32(kMissing);
  for (std::size_t r = 0; r < kRows; ++r, start += kLanes) {
    __m512i sum[kQueries];
    for (auto& s : sum) s = _mm512_loadu_si512(start);
    for (std::size_t w = 0; w < kWords; ++w, values += kLanes * 4) {
      const __m512i row = _mm512_loadu_si512(values);
      for (std::size_t q = 0; q < kQueries; ++q)
        sum[q] = _mm512_dpbusd_epi32(sum[q], row, _mm512_set1_epi32(queries[w * kQueries + q]));
    }
    for (std::size_t q = 0; q < kQueries; ++q) most[q] = _mm512_max_epi32(most[q], sum[q]);
  }
  for (std::size_t q = 0; q < kQueries; ++q) _mm512_storeu_si512(out + q * stride, most[q]);
}

GPUREG_BYTE_TARGET std::size_t place_of_largest(const std::int32_t* values, std::size_t count) {
  __m512i most = _mm512_set1_epi32(std::numeric_limits<std::int32_t>::min());
  __m512i block = _mm512_setzero_si512();
  for (std::size_t k = 0; k < count; k += kLanes) {
    const __m512i value = _mm512_loadu_si512(values + k);
    block =
        _mm512_mask_set1_epi32(block, _mm512_cmpgt_epi32_mask(value, most), static_cast<int>(k));
    most = _mm512_max_epi32(value, most);
  }
  const int largest = _mm512_reduce_max_epi32(most);
  const int lane = __builtin_ctz(
      static_cast<unsigned>(_mm512_cmpeq_epi32_mask(most, _mm512_set1_epi32(largest))));
  alignas(64) std::int32_t blocks[kLanes];
  _mm512_store_si512(blocks, block);
  return static_cast<std::size_t>(blocks[lane] + lane);
}

GPUREG_BYTE_TARGET std::size_t places_from(const std::int32_t* values, std::size_t count,
                                           std::int32_t least, std::uint32_t* out) {
  const __m512i limit = _mm512_set1_epi32(least);
  const __m512i lanes = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  std::size_t found = 0;
  for (std::size_t k = 0; k < count; k += kLanes) {
    const __mmask16 from = _mm512_cmpge_epi32_mask(_mm512_loadu_si512(values + k), limit);
    if (from == 0) continue;
    _mm512_mask_compressstoreu_epi32(
        out + found, from, _mm512_add_epi32(lanes, _mm512_set1_epi32(static_cast<int>(k))));
    found += static_cast<std::size_t>(__builtin_popcount(from));
  }
  return found;
}

}  // namespace

ByteRows byte_rows(const std::vector<float>& leaves, std::size_t dimension) {
  ByteRows out;
  if (!has_byte_products() || dimension == 0 || leaves.empty()) return out;
  const std::size_t leaf_values = dimension * kRows, count = leaves.size() / leaf_values,
                    groups = (count + kLanes - 1) / kLanes;
  std::vector<double> sum(dimension, 0);
  std::size_t rows = 0;
  for (std::size_t k = 0; k < leaves.size(); k += kRows)
    for (std::size_t r = 0; r < kRows && leaves[k + r] != kInfinity; ++r) {
      sum[k % leaf_values / kRows] += leaves[k + r];
      rows += k % leaf_values == 0;
    }
  for (const double s : sum)
    out.middle.push_back(static_cast<float>(s / static_cast<double>(rows)));
  double length = 0;
  for (const float m : out.middle) length += static_cast<double>(m) * m;
  out.axes = principal_axes(sample(leaves, dimension, out.middle), dimension);

  std::vector<float> shortened(count * kRows * kLanes);
  float highest[kLanes], shortening = 0;
  std::fill_n(out.lowest, kLanes, kInfinity);
  std::fill_n(highest, kLanes, -kInfinity);
  for (std::size_t k = 0; k < count * kRows; ++k) {
    const float* row = leaves.data() + k / kRows * leaf_values + k % kRows;
    float* values = shortened.data() + k * kLanes;
    if (row[0] == kInfinity) continue;
    shortening = std::max(shortening, shorten(out, row, kRows, values));
    for (std::size_t a = 0; a < kCoordinates; ++a) {
      out.lowest[a] = std::min(out.lowest[a], values[a]);
      highest[a] = std::max(highest[a], values[a]);
    }
  }
  float range = kLeastLength;
  for (std::size_t a = 0; a < kCoordinates; ++a)
    range = std::max(range, highest[a] - out.lowest[a]);
  // The differences from the middle are rounded too.
  shortening += 1e-6f * static_cast<float>(std::sqrt(length));
  if (!(range <= kMostLength) || !(length <= kMostLength)) return out;
  out.scale = 255.0f / range;
  out.values.assign(groups * kRows * kWords * kLanes * 4, 0);
  out.start.assign(groups * kRows * kLanes, kMissing);
  for (std::size_t leaf = 0; leaf < count; ++leaf)
    for (std::size_t r = 0; r < kRows; ++r) {
      if (leaves[leaf * leaf_values + r] == kInfinity) continue;
      std::int32_t bytes[kCoordinates], total = 0, squares = 0;
      const float error =
          round_coordinates(out, shortened.data() + (leaf * kRows + r) * kLanes, bytes);
      out.error = std::max(out.error, error + shortening);
      const std::size_t at = leaf / kLanes * kRows + r, lane = leaf % kLanes;
      for (std::size_t a = 0; a < kCoordinates; ++a) {
        out.values[((at * kWords + a / 4) * kLanes + lane) * 4 + a % 4] =
            static_cast<std::uint8_t>(bytes[a]);
        total += bytes[a];
        squares += bytes[a] * bytes[a];
      }
      out.start[at * kLanes + lane] = kShift * total - squares / 2;
    }
  out.valid = true;
  return out;
}

void LeafBounds::find(const ByteRows& rows, const float* const* queries, std::size_t count) {
  rows_ = &rows;
  leaves_ = rows.start.size() / kRows;
  bounds_.resize(leaves_ * kQueries);
  found_.resize(leaves_);
  std::int32_t words[kWords * kQueries] = {};
  for (std::size_t q = 0; q < count; ++q) {
    alignas(64) float values[kLanes];
    std::int32_t bytes[kCoordinates];
    const float shortening = shorten(rows, queries[q], 1, values);
    error_[q] = static_cast<double>(round_coordinates(rows, values, bytes)) + shortening;
    squares_[q] = 0;
    for (std::size_t a = 0; a < kCoordinates; ++a) {
      squares_[q] += static_cast<double>(bytes[a] * bytes[a]);
      words[a / 4 * kQueries + q] |= static_cast<std::int32_t>(
          (static_cast<std::uint32_t>(bytes[a] - kShift) & 0xffu) << 8 * (a % 4));
    }
  }
  for (std::size_t g = 0; g < leaves_ / kLanes; ++g)
    scan(rows, g, words, bounds_.data() + g * kLanes, leaves_);
}

std::size_t LeafBounds::nearest_leaf(std::size_t query) const {
  return place_of_largest(bounds_.data() + query * leaves_, leaves_);
}

const std::vector<std::uint32_t>& LeafBounds::leaves_within(std::size_t query, float distance) {
  const double reach = static_cast<double>(rows_->scale) * (1.0 + kRounding) *
                       (static_cast<double>(distance) + error_[query] + rows_->error);
  const double least = std::floor((squares_[query] - reach * reach) / 2) - 1;
  // Missing rows are below all others. reach may be infinite, or no number.
  constexpr std::int32_t kAll = kMissing / 2;
  found_.resize(leaves_);
  found_.resize(places_from(bounds_.data() + query * leaves_, leaves_,
                            least > kAll ? static_cast<std::int32_t>(least) : kAll, found_.data()));
  return found_;
}

}  // namespace gpureg::cpu
#else
namespace gpureg::cpu {

// No index is valid, and nothing else is called.
ByteRows byte_rows(const std::vector<float>&, std::size_t) { return {}; }
void LeafBounds::find(const ByteRows&, const float* const*, std::size_t) {}
std::size_t LeafBounds::nearest_leaf(std::size_t) const { return 0; }
const std::vector<std::uint32_t>& LeafBounds::leaves_within(std::size_t, float) { return found_; }

}  // namespace gpureg::cpu
#endif
