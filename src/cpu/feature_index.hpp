// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/stages.hpp"

namespace gpureg::cpu {

/// Feature rows for exact nearest-row searches that look at few of them: rows that lie together in
/// leaves of 16, leaves in nodes of 8, and of each leaf and node the box around its rows.
struct FeatureIndex {
  static constexpr std::uint32_t kLeaf = 16, kNode = 8, kNodeRows = kLeaf * kNode;
  std::uint32_t dimension = 0, nodes = 0;
  std::vector<std::uint32_t>
      row;                    ///< nodes x 128, valid rows in the order of the leaves, then kNoValue
  std::uint32_t rows = 0;     ///< how many of them
  std::vector<float> values;  ///< leaf, dimension, row of the leaf; infinity where there is none
  std::vector<float>
      leaf_boxes;  ///< node, dimension, lower ends of its 8 leaves and then the upper ones
  std::vector<float> node_boxes;  ///< the same, 8 nodes to a block
};

FeatureIndex index_features(FeatureRows rows);

/// out[q] becomes what nearest_features() with k = 1 finds for row q, for the rows begin to end
/// (exclusive) in the order of their own index. The rows of one leaf ask alike, so each begins with
/// the answer of the one before.
void nearest_features(FeatureRows queries, const FeatureIndex& order, FeatureRows rows,
                      const FeatureIndex& index, std::size_t begin, std::size_t end,
                      std::uint32_t* out);

}  // namespace gpureg::cpu
