// SPDX-License-Identifier: BSD-3-Clause
#include "math/cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace gpureg {
namespace {

TEST(Cholesky, AgreesWithEigen) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 2000; ++trial) {
    Eigen::Matrix<double, 6, 6> b;
    Eigen::Matrix<double, 6, 1> y;
    for (int i = 0; i < 6; ++i) {
      y(i) = normal(random);
      for (int j = 0; j < 6; ++j) b(i, j) = normal(random);
    }
    const Eigen::Matrix<double, 6, 6> m =
        b * b.transpose() + 0.01 * Eigen::Matrix<double, 6, 6>::Identity();
    double a[6][6], rhs[6], x[6];
    for (int i = 0; i < 6; ++i) {
      rhs[i] = y(i);
      for (int j = 0; j < 6; ++j) a[i][j] = m(i, j);
    }
    ASSERT_TRUE(solve_cholesky6(a, rhs, x));
    const Eigen::Matrix<double, 6, 1> solved = Eigen::Map<Eigen::Matrix<double, 6, 1>>(x);
    EXPECT_LT((m * solved - y).norm(), 1e-9 * (1 + solved.norm() * m.norm()));
  }
}

TEST(Cholesky, RefusesIndefinite) {
  double a[6][6] = {}, b[6] = {1, 1, 1, 1, 1, 1}, x[6];
  for (int i = 0; i < 6; ++i) a[i][i] = i == 3 ? -1 : 1;
  EXPECT_FALSE(solve_cholesky6(a, b, x));
  a[3][3] = 0;
  EXPECT_FALSE(solve_cholesky6(a, b, x));
}

}  // namespace
}  // namespace gpureg
