// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <random>

#include "algorithm/to_vec3.hpp"

namespace gpureg {
namespace {

TEST(Fit, AgreesWithUmeyama) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5000; ++trial) {
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    const Eigen::Vector3d shift(normal(random), normal(random), normal(random));
    Eigen::Matrix<double, 3, 4> p, q;
    Vec3 source[4], target[4];
    for (int k = 0; k < 4; ++k) {
      p.col(k) = Eigen::Vector3d(normal(random), normal(random), normal(random));
      q.col(k) = turn * p.col(k) + shift +
                 0.03 * Eigen::Vector3d(normal(random), normal(random), normal(random));
      source[k] = to_vec3(p.col(k));
      target[k] = to_vec3(q.col(k));
    }
    Pose<float> pose;
    ASSERT_TRUE(fit_rigid(source, target, pose));
    const Eigen::Matrix4d expected = Eigen::umeyama(p, q, false);
    const Pose<double> wide = widen(pose);
    const Eigen::Quaterniond found(wide.w, wide.x, wide.y, wide.z);
    // The rotation is as well conditioned as the second eigenvalue gap: nearly flat or slim
    // quadruples lose digits of float.
    Eigen::Matrix<double, 3, 4> centred = p.colwise() - p.rowwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(centred * centred.transpose(),
                                                                Eigen::EigenvaluesOnly);
    const double tolerance = 1e-5 / std::min(1.0, spread.eigenvalues()(1));
    EXPECT_LT(
        found.angularDistance(Eigen::Quaterniond(Eigen::Matrix3d(expected.topLeftCorner<3, 3>()))),
        tolerance)
        << trial;
  }
}

TEST(Fit, ExactMotionIsFound) {
  const Vec3 p[4] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  // a quarter turn about z, then a shift
  const Vec3 q[4] = {{1, 2, 3}, {1, 3, 3}, {-1, 2, 3}, {1, 2, 6}};
  Pose<float> pose;
  ASSERT_TRUE(fit_rigid(p, q, pose));
  for (int k = 0; k < 4; ++k) {
    const Vec3 moved = apply(to_rigid(pose), p[k]);
    EXPECT_NEAR(moved.x, q[k].x, 1e-5);
    EXPECT_NEAR(moved.y, q[k].y, 1e-5);
    EXPECT_NEAR(moved.z, q[k].z, 1e-5);
  }
}

TEST(Fit, RefusesUndeterminedRotations) {
  Pose<float> pose;
  const Vec3 line[4] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3.5f, 3.5f, 3.5f}};
  const Vec3 spread[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Vec3 same[4] = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  EXPECT_FALSE(fit_rigid(line, line, pose));
  EXPECT_FALSE(fit_rigid(line, spread, pose));
  EXPECT_FALSE(fit_rigid(same, spread, pose));
  EXPECT_FALSE(fit_rigid(same, same, pose));
}

}  // namespace
}  // namespace gpureg
