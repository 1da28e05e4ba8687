// SPDX-License-Identifier: BSD-3-Clause
#include "scale/refine.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/scan.hpp"

namespace gpureg::scale {
namespace {

constexpr float kVoxel = 0.05f;

/// Points with normals of a room with a table and a pillar, from `low` to `high` metres of its
/// length.
struct Part {
  std::vector<Vec3> points, normals;

  Part(double low, double high, double noise, std::mt19937& random) {
    std::uniform_real_distribution<double> unit;
    std::normal_distribution<double> error(0, noise);
    const auto add_wall = [&](Eigen::Vector3d corner, Eigen::Vector3d a, Eigen::Vector3d b) {
      const Eigen::Vector3d n = a.cross(b).normalized();
      const int count = static_cast<int>(a.cross(b).norm() / (kVoxel * kVoxel));
      for (int k = 0; k < count; ++k) {
        const Eigen::Vector3d p = corner + unit(random) * a + unit(random) * b + error(random) * n;
        if (p.x() < low || p.x() > high) continue;
        points.push_back(vec(p));
        normals.push_back(vec(n));
      }
    };
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                          z = Eigen::Vector3d::UnitZ();
    add_wall({0, 0, 0}, 6 * x, 4 * y);
    add_wall({0, 0, 0}, 6 * x, 2.5 * z);
    add_wall({0, 4, 0}, 6 * x, 2.5 * z);
    for (const double at : {0.0, 2.4, 3.6, 6.0}) add_wall({at, 1, 0}, 1.5 * y, 1 * z);
    add_wall({2.4, 1, 1}, 1.2 * x, 1.5 * y);
  }
  static Vec3 vec(const Eigen::Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
  }
  ClosestSurface surface() const { return {points, normals, 0.225f}; }
};

/// Logarithm of the scale of two parts that lie on each other.
RefinedScale refined(const Part& source, const Part& target) {
  return refine_scale(source.surface(), target.surface(), UnalignedIsometry3d::Identity(),
                      kVoxel / 2);
}

double deviation(const RefinedScale& r) { return r.rms / std::sqrt(r.scale_information); }

// One cloud is no more the truth than the other: what the source sees beyond the target, and the
// unit of the residuals, must not make it smaller or larger.
TEST(RefineScale, IsTheInverseOfThatOfTheSwappedPair) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    const Part source(0, 4, 0.02, random), target(2, 6, 0.005, random);
    const double both = refined(source, target).factor * refined(target, source).factor;
    EXPECT_NEAR(both, 1, 1e-4) << seed;
  }
}

TEST(RefineScale, HasNoBiasAndTheDeviationThatItSays) {
  constexpr int kRuns = 40;
  double mean = 0, squares = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    std::mt19937 random(seed);
    const Part source(0, 4, 0.01, random), target(2, 6, 0.01, random);
    const RefinedScale r = refined(source, target);
    const double error = std::log(r.factor);
    EXPECT_LT(std::abs(error), 0.01);
    mean += error / deviation(r) / kRuns;
    squares += error / deviation(r) * error / deviation(r) / kRuns;
  }
  EXPECT_LT(std::abs(mean), 3 * std::sqrt(squares / kRuns)) << "the estimate is biased";
  EXPECT_GT(std::sqrt(squares), 0.5);
  EXPECT_LT(std::sqrt(squares), 1.5);
}

}  // namespace
}  // namespace gpureg::scale
