// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/dense_kernels.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace gpureg::pose_graph {
namespace {

TEST(DenseKernels, ThreadsGiveTheSameBits) {
  // No multiple of a panel, of a strip or of a tile.
  constexpr int kSize = 607, kColumns = 301;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<double> matrix(kSize * kSize);
  for (double& x : matrix) x = number(random);
  for (int k = 0; k < kSize; ++k) matrix[static_cast<std::size_t>(k * (kSize + 1))] = 2.0 * kSize;
  std::vector<double> alone = matrix;
  ASSERT_TRUE(partial_cholesky(alone.data(), kSize, kColumns, 1));
  for (const int threads : {2, 5}) {
    std::vector<double> shared = matrix;
    ASSERT_TRUE(partial_cholesky(shared.data(), kSize, kColumns, threads));
    EXPECT_EQ(alone, shared) << threads;
  }
}

}  // namespace
}  // namespace gpureg::pose_graph
