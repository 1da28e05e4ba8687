// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/fusion.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace gpureg::test {
namespace {

using synthetic::DepthQuarter;

/// A noise-free image of the sphere of this radius at (0, 0, distance).
DepthQuarter sphere(float radius, float distance) {
  DepthQuarter image;
  image.depth.assign(static_cast<std::size_t>(DepthQuarter::kWidth) * DepthQuarter::kHeight, 0.0f);
  for (int row = 0; row < DepthQuarter::kHeight; ++row) {
    for (int column = 0; column < DepthQuarter::kWidth; ++column) {
      const Eigen::Vector3f ray = synthetic::camera::ray(image.pixel_x(column), image.pixel_y(row));
      const float a = ray.squaredNorm(), b = -distance, c = distance * distance - radius * radius,
                  d = b * b - a * c;
      if (d > 0)
        image.depth[static_cast<std::size_t>(row * DepthQuarter::kWidth + column)] =
            (-b - std::sqrt(d)) / a;
    }
  }
  return image;
}

TEST(Fusion, PointsLieOnTheSurface) {
  synthetic::FusionVolume volume;
  volume.integrate(sphere(0.5f, 1.5f), Eigen::Isometry3d::Identity());
  const auto points = volume.extract(0, 0.02f);
  // Half a sphere of 1.57 m^2, 2 cm cells: a surface crosses about 1.5 cells per 4 cm^2.
  EXPECT_GT(points.size(), 2500u);
  EXPECT_LT(points.size(), 8000u);
  double squares = 0;
  int facing = 0;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3f out = p - Eigen::Vector3f(0, 0, 1.5f);
    const double error = out.norm() - 0.5;
    EXPECT_LT(std::abs(error), 0.03)
        << "towards the rim, distances along the ray are longer than those to the surface";
    if (-out.normalized().dot(p.normalized()) < 0.7f) continue;
    squares += error * error;
    ++facing;
  }
  EXPECT_GT(facing, 400);
  EXPECT_LT(std::sqrt(squares / facing), 0.003)
      << "a third of a voxel where the surface faces the camera";
}

TEST(Fusion, PoseMovesThePoints) {
  const Eigen::Isometry3d pose = Eigen::Translation3d(1, -2, 0.5) *
                                 Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 1, 0).normalized());
  synthetic::FusionVolume volume;
  volume.integrate(sphere(0.5f, 1.5f), pose);
  const Eigen::Vector3f centre = pose.cast<float>() * Eigen::Vector3f(0, 0, 1.5f);
  for (const Eigen::Vector3f& p : volume.extract(0, 0.02f))
    ASSERT_NEAR((p - centre).norm(), 0.5f, 0.03f);
}

TEST(Fusion, NothingSeenGivesNothing) {
  synthetic::FusionVolume volume;
  EXPECT_TRUE(volume.extract(0, 0.02f).empty());
  DepthQuarter image = sphere(0.5f, 1.5f);
  std::fill(image.depth.begin(), image.depth.end(), 0.0f);
  volume.integrate(image, Eigen::Isometry3d::Identity());
  EXPECT_TRUE(volume.extract(0, 0.02f).empty());
}

TEST(Fusion, WeightIsDemanded) {
  synthetic::FusionVolume volume;
  volume.integrate(sphere(0.5f, 1.5f), Eigen::Isometry3d::Identity());
  EXPECT_TRUE(volume.extract(1000, 0.02f).empty());
}

}  // namespace
}  // namespace gpureg::test
