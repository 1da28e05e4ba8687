// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gpureg::cpu {

/// Short versions of the rows of a FeatureIndex: products of their bytes (AVX-512 VNNI) give lower
/// bounds of the distances to all leaves at a fraction of the operations. A row becomes its
/// coordinates along the first principal axes and the length of the rest, rounded to 8 bits.
/// Distances of such vectors are at most those of the rows, and by the triangle inequality rounding
/// changes them by at most the lengths of both rounding errors. The axes need not be exact, only
/// orthonormal.
struct ByteRows {
  static constexpr std::size_t kLanes = 16;   ///< leaves side by side
  static constexpr std::size_t kRows = 16;    ///< rows of a leaf
  static constexpr std::size_t kQueries = 8;  ///< queries of a scan
  static constexpr std::size_t kWords = 4;    ///< of four coordinates, per row
  static constexpr std::size_t kAxes = 4 * kWords - 1;

  bool valid = false;  ///< false: values that do not fit, or no byte products
  float scale = 0;
  float error = 0;                   ///< largest error of a row, in units of the values
  std::vector<float> middle;         ///< of the rows, per dimension
  std::vector<float> axes;           ///< dimension, axis; 16 floats to a dimension
  float lowest[16] = {};             ///< of the coordinates
  std::vector<std::uint8_t> values;  ///< per 16 leaves: row of the leaf, word, leaf, coordinate
  std::vector<std::int32_t> start;   ///< per 16 leaves: row of the leaf, leaf
};

/// leaves: per leaf `dimension` x 16 values, infinity for missing rows.
ByteRows byte_rows(const std::vector<float>& leaves, std::size_t dimension);

/// Bounds of the distances between up to kQueries queries and all leaves.
class LeafBounds {
 public:
  void find(const ByteRows& rows, const float* const* queries, std::size_t count);
  /// The leaf that is probably the nearest to a query.
  std::size_t nearest_leaf(std::size_t query) const;
  /// The leaves that may have a row within the distance, ascending; valid until the next call.
  const std::vector<std::uint32_t>& leaves_within(std::size_t query, float distance);

 private:
  const ByteRows* rows_ = nullptr;
  std::size_t leaves_ = 0;  ///< a multiple of 16
  /// Per query and leaf: the largest (q, r) - |r|^2 / 2 of the rounded query and the rows of the
  /// leaf, rounded up. |q|^2 minus twice this is a lower bound of the squared distance.
  std::vector<std::int32_t> bounds_;
  std::vector<std::uint32_t> found_;
  double error_[ByteRows::kQueries] = {}, squares_[ByteRows::kQueries] = {};
};

}  // namespace gpureg::cpu
