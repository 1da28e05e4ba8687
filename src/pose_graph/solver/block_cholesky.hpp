// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "pose_graph/se3.hpp"

namespace gpureg::pose_graph {

/// A symmetric matrix of 6x6 blocks: all diagonal blocks, and the blocks (row, column), row >
/// column, of a pattern.
struct BlockMatrix {
  std::vector<std::pair<int, int>> pattern;  ///< (column, row), ascending, without repetition
  std::vector<Matrix6d> diagonal;
  std::vector<Matrix6d> blocks;  ///< by pattern; block (row, column) of the lower triangle
};

/// Multifrontal Cholesky factorisation of a BlockMatrix (Duff and Reid 1983; Liu 1992). The
/// fill-reducing order is approximate minimum degree on the blocks. The order of all sums is fixed,
/// so that the number of threads changes nothing.
class BlockCholesky {
 public:
  /// Order and structure of the factor, for `size` block rows.
  BlockCholesky(int size, const std::vector<std::pair<int, int>>& pattern, int threads);

  /// false where the matrix is not positive definite.
  bool factorise(const BlockMatrix& matrix);

  /// Solves in place.
  void solve(std::vector<Vector6d>& rhs) const;

  /// Turns independent standard normal numbers into a sample of the normal distribution whose
  /// inverse covariance is the matrix.
  void colour(std::vector<Vector6d>& noise) const;

 private:
  struct Front {
    int first = 0, columns = 0;  ///< block columns of the factor, in elimination order
    int parent = -1;
    std::vector<int> rows;  ///< block rows below the columns, in elimination order
    std::vector<int> children;
    std::vector<int> parent_slot;  ///< per row: its block row in the parent's front
    /// Blocks of the matrix in its columns: index into the pattern, and block row in the front.
    std::vector<std::pair<int, int>> scatter;
    std::vector<double> factor;  ///< (columns + rows) x columns, column by column
    std::vector<double> update;  ///< Schur complement, until the parent has taken it
  };

  std::vector<double> permuted(const std::vector<Vector6d>& blocks) const;
  void unpermute(const std::vector<double>& x, std::vector<Vector6d>& blocks) const;
  void substitute_forward(std::vector<double>& x) const;
  void substitute_backward(std::vector<double>& x) const;
  bool process(Front& front, const BlockMatrix& matrix);

  int size_;
  int threads_;
  double flops_ = 0;          ///< multiplications and additions of one factorisation
  std::vector<int> order_;    ///< elimination position -> block
  std::vector<int> inverse_;  ///< block -> elimination position
  std::vector<std::pair<int, int>> pattern_;  ///< of the matrix, in elimination positions
  std::vector<Front> fronts_;                 ///< children before parents
};

}  // namespace gpureg::pose_graph
