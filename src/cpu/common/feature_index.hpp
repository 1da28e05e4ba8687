// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/common/byte_rows.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

/// Index for exact nearest-row searches that read few rows: leaves of 16 similar rows, nodes of 8
/// leaves, and the bounding box of each leaf and node.
struct FeatureIndex {
  static constexpr std::uint32_t kLeaf = 16, kNode = 8, kNodeRows = kLeaf * kNode;
  std::uint32_t dimension = 0, nodes = 0;
  std::vector<std::uint32_t> row;  ///< nodes x 128, different valid rows in the order of the
                                   ///< leaves, then kNoValue
  std::uint32_t rows = 0;          ///< number of different valid rows
  /// Per row the next equal one; kNoValue: none. Noise-free walls have thousands of equal features.
  /// Only the first of them is in the index: no other is ever found, and all find the same.
  std::vector<std::uint32_t> next_equal;
  std::vector<float> values;  ///< leaf, dimension, row of the leaf; infinity where there is none
  std::vector<float>
      leaf_boxes;  ///< node, dimension, lower ends of its 8 leaves and then the upper ones
  std::vector<float> node_boxes;  ///< the same, 8 nodes to a block
  ByteRows bytes;                 ///< of the values
};

FeatureIndex index_features(FeatureRows rows);

/// Which vectors a search uses, at most; the result is the same.
enum class SearchVectors { kNarrow, kWide, kBytes };

/// Searches the nearest row for the queries at places[begin] to places[end] (exclusive) of their
/// own index, and for the rows that equal them. places: ascending. The rows of one leaf are
/// similar, so each search starts with the result of the previous one.
/// out[q]: result of nearest_features() with k = 1 for row q.
void nearest_features(FeatureRows queries, const FeatureIndex& order,
                      const std::vector<std::uint32_t>& places, FeatureRows rows,
                      const FeatureIndex& index, std::size_t begin, std::size_t end,
                      std::uint32_t* out, SearchVectors most = SearchVectors::kBytes);

}  // namespace gpureg::cpu
