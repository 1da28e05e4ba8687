// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg::test {

/// Random rigid motion: any rotation, a translation of up to a few metres.
inline Eigen::Isometry3d random_pose(std::mt19937& random, double metres = 2) {
  std::normal_distribution<double> normal;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                      .normalized()
                      .matrix();
  pose.translation() = metres * Eigen::Vector3d(normal(random), normal(random), normal(random));
  return pose;
}

/// A corner of a room of about 3 x 2 x 2 m, with boxes and spheres of different sizes and nothing
/// symmetric about it, sampled at random with about 4,000 points per square metre and 1 mm of
/// noise: two scans of it share surfaces, not points.
inline std::vector<Eigen::Vector3f> scan_room(std::mt19937& random) {
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.001f);
  std::vector<Eigen::Vector3f> points;
  const auto add = [&](const Eigen::Vector3f& p) {
    points.push_back(p + Eigen::Vector3f(noise(random), noise(random), noise(random)));
  };
  const auto count = [](float area) { return static_cast<int>(4000 * area); };
  const auto rectangle = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& a,
                             const Eigen::Vector3f& b) {
    for (int k = count(a.cross(b).norm()); k > 0; --k)
      add(corner + unit(random) * a + unit(random) * b);
  };
  const auto box = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& size, float turn) {
    const Eigen::Matrix3f r = Eigen::AngleAxisf(turn, Eigen::Vector3f::UnitZ()).toRotationMatrix();
    const Eigen::Vector3f x = r.col(0) * size.x(), y = r.col(1) * size.y(), z = r.col(2) * size.z();
    rectangle(corner, x, z);
    rectangle(corner + y, x, z);
    rectangle(corner, y, z);
    rectangle(corner + x, y, z);
    rectangle(corner + z, x, y);
  };
  const auto sphere = [&](const Eigen::Vector3f& centre, float radius) {
    std::normal_distribution<float> normal;
    for (int k = count(4 * static_cast<float>(M_PI) * radius * radius); k > 0; --k)
      add(centre +
          radius * Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
  };
  rectangle({0, 0, 0}, {3, 0, 0}, {0, 2, 0});
  rectangle({0, 0, 0}, {3, 0, 0}, {0, 0, 2});
  rectangle({0, 0, 0}, {0, 1.4f, 0}, {0, 0, 1.7f});
  box({0.3f, 0.9f, 0}, {0.7f, 0.4f, 0.5f}, 0.3f);
  box({1.5f, 0.2f, 0}, {0.35f, 0.3f, 1.1f}, -0.2f);
  box({2.1f, 1.1f, 0}, {0.5f, 0.6f, 0.25f}, 0.8f);
  sphere({1.3f, 1.3f, 0.3f}, 0.3f);
  sphere({2.5f, 0.4f, 0.9f}, 0.22f);
  sphere({0.6f, 1.1f, 0.65f}, 0.15f);
  return points;
}

/// Where the sensor of scan_room() stood: normals are oriented towards it, so it must move along
/// with the points.
inline const Eigen::Vector3f kRoomSensor(2.0f, 1.6f, 1.8f);

inline std::vector<Eigen::Vector3f> moved(const Eigen::Isometry3d& pose,
                                          std::vector<Eigen::Vector3f> points) {
  for (Eigen::Vector3f& p : points) p = (pose * p.cast<double>()).cast<float>();
  return points;
}

inline double translation_error(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& found) {
  return (truth.inverse() * found).translation().norm();
}

inline double rotation_error_degrees(const Eigen::Isometry3d& truth,
                                     const Eigen::Isometry3d& found) {
  return Eigen::AngleAxisd((truth.inverse() * found).linear()).angle() * 180 / M_PI;
}

}  // namespace gpureg::test
