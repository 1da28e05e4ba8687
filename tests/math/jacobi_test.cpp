// SPDX-License-Identifier: BSD-3-Clause
#include "math/jacobi.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "math/jacobi_lanes.hpp"

namespace gpureg {
namespace {

template <int N, int Sweeps>
void compare_with_eigen(double spread) {
  std::mt19937 random(N);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5000; ++trial) {
    Eigen::Matrix<double, N, N> b;
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) b(i, j) = normal(random) * std::pow(spread, i);
    const Eigen::Matrix<double, N, N> m = b * b.transpose();
    float a[N][N], v[N][N];
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) a[i][j] = static_cast<float>(m(i, j));
    Eigen::Matrix<double, N, N> rounded;
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) rounded(i, j) = a[i][j];
    jacobi_eigen<N, Sweeps>(a, v);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(rounded);
    const double scale = solver.eigenvalues().cwiseAbs().maxCoeff();
    for (int k = 0; k < N; ++k) {
      Eigen::Matrix<double, N, 1> x;
      for (int i = 0; i < N; ++i) x(i) = v[i][k];
      EXPECT_NEAR(x.norm(), 1, 1e-5);
      // A residual of some float roundings of the largest eigenvalue: about 60 rotations of 6e-8
      // each.
      EXPECT_LT((rounded * x - static_cast<double>(a[k][k]) * x).norm(), 8e-6 * scale);
    }
  }
}

TEST(Jacobi, ThreeByThree) { compare_with_eigen<3, 5>(1.0); }
TEST(Jacobi, ThreeByThreeIllConditioned) { compare_with_eigen<3, 5>(0.03); }
TEST(Jacobi, FourByFour) { compare_with_eigen<4, 6>(1.0); }
TEST(Jacobi, FourByFourIllConditioned) { compare_with_eigen<4, 6>(0.03); }

TEST(Jacobi, LanesHaveTheBitsOfOneByOne) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  constexpr int kLanes = Matrices6::kLanes, kSweeps = 12;
  for (int trial = 0; trial < 500; ++trial) {
    Matrices6 a, v;
    double expected[kLanes][6][6], vectors[kLanes][6][6];
    for (int l = 0; l < kLanes; ++l) {
      Eigen::Matrix<double, 6, 6> b;
      const double spread = std::pow(10.0, -l);
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) b(i, j) = normal(random) * std::pow(spread, i);
      Eigen::Matrix<double, 6, 6> m = b * b.transpose();
      if (l == 5) m.setZero();
      if (l == 6) m = m.diagonal().asDiagonal();
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) a.at[i][j][l] = expected[l][i][j] = m(i, j);
      jacobi_eigen<6, kSweeps>(expected[l], vectors[l]);
    }
    jacobi_eigen(kSweeps, a, v);
    for (int l = 0; l < kLanes; ++l)
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
          EXPECT_EQ(a.at[i][j][l], expected[l][i][j]);
          EXPECT_EQ(v.at[i][j][l], vectors[l][i][j]);
        }
  }
}

TEST(Jacobi, ZeroAndDiagonal) {
  float a[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, v[3][3];
  jacobi_eigen<3, 5>(a, v);
  EXPECT_EQ(a[0][0], 0);
  EXPECT_EQ(v[0][0], 1);
  float d[3][3] = {{3, 0, 0}, {0, 1, 0}, {0, 0, 2}};
  jacobi_eigen<3, 5>(d, v);
  EXPECT_EQ(d[0][0], 3);
  EXPECT_EQ(d[1][1], 1);
  EXPECT_EQ(d[2][2], 2);
}

}  // namespace
}  // namespace gpureg
