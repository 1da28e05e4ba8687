// SPDX-License-Identifier: BSD-3-Clause
#include "math/rigid.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace gpureg {
namespace {

Eigen::Quaterniond random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized();
}

TEST(Rigid, AppliesLikeEigen) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Quaterniond q = random_rotation(random);
    const Eigen::Vector3d t(normal(random), normal(random), normal(random)),
        p(normal(random), normal(random), normal(random));
    const Rigid m = to_rigid(Pose<double>{q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()});
    const Vec3 moved =
        apply(m, {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
    const Eigen::Vector3d expected = q * p + t;
    // Coordinates of a few metres in float: 1e-6.
    EXPECT_NEAR(moved.x, expected.x(), 3e-6);
    EXPECT_NEAR(moved.y, expected.y(), 3e-6);
    EXPECT_NEAR(moved.z, expected.z(), 3e-6);
  }
}

TEST(Rigid, ComposeSmallTurnsAboutTheTranslatedOrigin) {
  std::mt19937 random(6);
  const Eigen::Quaterniond q = random_rotation(random);
  const Pose<double> p{q.w(), q.x(), q.y(), q.z(), 1, 2, 3};
  const double omega[3] = {2e-4, -1e-4, 3e-4}, v[3] = {0.1, 0.2, -0.3};
  const Pose<double> r = compose_small(omega, v, p);
  const Eigen::Vector3d w(omega[0], omega[1], omega[2]);
  const Eigen::Quaterniond expected =
      Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())) * q;
  // (1, omega / 2) normalised turns by omega up to |omega|^3 / 12.
  EXPECT_LT(expected.angularDistance(Eigen::Quaterniond(r.w, r.x, r.y, r.z)), 1e-10);
  EXPECT_DOUBLE_EQ(r.tx, 1.1);
  EXPECT_DOUBLE_EQ(r.ty, 2.2);
  EXPECT_DOUBLE_EQ(r.tz, 2.7);
}

}  // namespace
}  // namespace gpureg
