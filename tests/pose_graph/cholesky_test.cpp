// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <random>

#include "pose_graph/solver/block_cholesky.hpp"

namespace gpureg::pose_graph {
namespace {

/// A random symmetric matrix whose diagonal dominates, and the same dense.
BlockMatrix random_matrix(int size, int extra, unsigned seed, Eigen::MatrixXd& dense) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  BlockMatrix out;
  for (int k = 0; k + 1 < size; ++k) out.pattern.push_back({k, k + 1});
  for (int k = 0; k < extra; ++k) {
    const int a = static_cast<int>(random() % size), b = static_cast<int>(random() % size);
    if (a != b) out.pattern.push_back({std::min(a, b), std::max(a, b)});
  }
  std::sort(out.pattern.begin(), out.pattern.end());
  out.pattern.erase(std::unique(out.pattern.begin(), out.pattern.end()), out.pattern.end());
  dense = Eigen::MatrixXd::Zero(6 * size, 6 * size);
  for (const auto& [column, row] : out.pattern) {
    const Matrix6d block = Matrix6d::NullaryExpr([&] { return normal(random); });
    out.blocks.push_back(block);
    dense.block<6, 6>(6 * row, 6 * column) = block;
    dense.block<6, 6>(6 * column, 6 * row) = block.transpose();
  }
  const double dominant = 1 + dense.cwiseAbs().rowwise().sum().maxCoeff();
  for (int k = 0; k < size; ++k) {
    out.diagonal.push_back(dominant * Matrix6d::Identity());
    dense.block<6, 6>(6 * k, 6 * k) = out.diagonal.back();
  }
  return out;
}

std::vector<Vector6d> right_side(int size) {
  std::vector<Vector6d> b(size);
  for (int k = 0; k < size; ++k) b[k] = Vector6d::LinSpaced(k, 2.0 * k + 1);
  return b;
}

TEST(BlockCholesky, SolvesAsTheDenseFactorisationDoes) {
  for (const auto& [size, extra] : {std::pair{1, 0}, {2, 0}, {7, 3}, {40, 30}, {90, 400}}) {
    SCOPED_TRACE(size);
    Eigen::MatrixXd dense;
    const BlockMatrix matrix = random_matrix(size, extra, size, dense);
    BlockCholesky cholesky(size, matrix.pattern, 1);
    ASSERT_TRUE(cholesky.factorise(matrix));
    std::vector<Vector6d> x = right_side(size);
    Eigen::VectorXd b(6 * size);
    for (int k = 0; k < size; ++k) b.segment<6>(6 * k) = x[k];
    cholesky.solve(x);
    const Eigen::VectorXd expected = dense.llt().solve(b);
    for (int k = 0; k < size; ++k)
      // The matrix is well conditioned: a few units of the last digit.
      EXPECT_LE((x[k] - expected.segment<6>(6 * k)).norm(), 1e-12 * (1 + expected.norm()));
  }
}

TEST(BlockCholesky, ThreadsDoNotChangeABit) {
  const int size = 700;
  Eigen::MatrixXd unused;
  const BlockMatrix matrix = random_matrix(size, 900, 5, unused);
  std::vector<Vector6d> first;
  for (const int threads : {1, 2, 5}) {
    BlockCholesky cholesky(size, matrix.pattern, threads);
    ASSERT_TRUE(cholesky.factorise(matrix));
    std::vector<Vector6d> x = right_side(size);
    cholesky.solve(x);
    if (first.empty()) first = x;
    EXPECT_EQ(std::memcmp(x.data(), first.data(), x.size() * sizeof(Vector6d)), 0) << threads;
  }
}

TEST(BlockCholesky, SaysThatAMatrixIsNotPositiveDefinite) {
  Eigen::MatrixXd unused;
  BlockMatrix matrix = random_matrix(20, 20, 3, unused);
  matrix.diagonal[11](2, 2) = -1;
  BlockCholesky cholesky(20, matrix.pattern, 2);
  EXPECT_FALSE(cholesky.factorise(matrix));
  matrix.diagonal[11](2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky.factorise(matrix));
}

TEST(BlockCholesky, ColouredNoiseHasTheInverseAsCovariance) {
  const int size = 3;
  Eigen::MatrixXd dense;
  const BlockMatrix matrix = random_matrix(size, 0, 9, dense);
  BlockCholesky cholesky(size, matrix.pattern, 1);
  ASSERT_TRUE(cholesky.factorise(matrix));
  // The images of the unit vectors are the columns of a square root of the inverse.
  Eigen::MatrixXd root(6 * size, 6 * size);
  for (int c = 0; c < 6 * size; ++c) {
    std::vector<Vector6d> unit(size, Vector6d::Zero());
    unit[c / 6][c % 6] = 1;
    cholesky.colour(unit);
    for (int k = 0; k < size; ++k) root.block<6, 1>(6 * k, c) = unit[k];
  }
  EXPECT_LE((root * root.transpose() - dense.inverse()).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace gpureg::pose_graph
