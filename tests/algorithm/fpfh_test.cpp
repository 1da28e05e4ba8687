// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fpfh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "algorithm/to_vec3.hpp"

namespace gpureg {
namespace {

Eigen::Vector3d random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}
/// Rusu et al. 2009, eq. 1, in double, with the source chosen by the smaller angle to the
/// connecting line.
bool reference(Eigen::Vector3d p1, Eigen::Vector3d n1, Eigen::Vector3d p2, Eigen::Vector3d n2,
               double unit[3]) {
  const double l = (p2 - p1).norm();
  if (std::acos(std::fabs(n1.dot(p2 - p1) / l)) > std::acos(std::fabs(n2.dot(p2 - p1) / l))) {
    std::swap(p1, p2);
    std::swap(n1, n2);
  }
  const Eigen::Vector3d d = (p2 - p1) / l, v = d.cross(n1).normalized(), w = n1.cross(v);
  unit[0] = (std::atan2(w.dot(n2), n1.dot(n2)) + M_PI) / (2 * M_PI);
  unit[1] = (v.dot(n2) + 1) / 2;
  unit[2] = (n1.dot(d) + 1) / 2;
  return true;
}

TEST(PairFeature, BinsAgreeWithDouble) {
  std::mt19937 random(4);
  int at_edge = 0;
  for (int k = 0; k < 50000; ++k) {
    const Eigen::Vector3d p1 = random_unit(random), p2 = random_unit(random),
                          n1 = random_unit(random), n2 = random_unit(random);
    double unit[3];
    reference(p1, n1, p2, n2, unit);
    const PairFeature f = pair_feature(to_vec3(p1), to_vec3(n1), to_vec3(p2), to_vec3(n2));
    ASSERT_TRUE(f.valid);
    for (int b = 0; b < 3; ++b) {
      const double place = unit[b] * kFpfhBins;
      const int expected =
          std::min(kFpfhBins - 1, std::max(0, static_cast<int>(std::floor(place))));
      // Within float rounding of a bin's edge either bin is right.
      if (f.bins[b] != expected) {
        EXPECT_LT(std::fabs(place - std::round(place)), 1e-4);
        ++at_edge;
      }
    }
  }
  EXPECT_LT(at_edge, 50);
}

TEST(PairFeature, IsSymmetric) {
  std::mt19937 random(5);
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p1 = to_vec3(random_unit(random)), p2 = to_vec3(random_unit(random)),
               n1 = to_vec3(random_unit(random)), n2 = to_vec3(random_unit(random));
    const PairFeature a = pair_feature(p1, n1, p2, n2), b = pair_feature(p2, n2, p1, n1);
    for (int d = 0; d < 3; ++d) EXPECT_EQ(a.bins[d], b.bins[d]);
  }
}

TEST(PairFeature, CoincidentPointsAndParallelNormalsHaveNone) {
  EXPECT_FALSE(pair_feature({1, 1, 1}, {0, 0, 1}, {1, 1, 1}, {0, 1, 0}).valid);
  EXPECT_FALSE(pair_feature({0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}).valid);
}

}  // namespace
}  // namespace gpureg
