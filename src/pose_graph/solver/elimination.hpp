// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

namespace gpureg::pose_graph {

/// Consecutive columns of the factor that share their structure.
struct Supernode {
  int first = 0;
  int columns = 0;
  std::vector<int> rows;  ///< below the columns, ascending
};

/// Order and structure of a sparse Cholesky factor, in blocks.
struct Elimination {
  std::vector<int> order;             ///< position -> block
  std::vector<Supernode> supernodes;  ///< children before parents
};

/// pattern: pairs (column, row) with column != row, without repetition.
Elimination eliminate(int size, const std::vector<std::pair<int, int>>& pattern);

}  // namespace gpureg::pose_graph
