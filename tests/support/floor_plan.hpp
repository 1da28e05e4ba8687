// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace gpureg::test {

/// A flat of 10 x 6 m with two walls inside and two pieces of furniture, as the segments that a 2-D
/// scanner meets.
class FloorPlan2d {
 public:
  FloorPlan2d() {
    box(0, 0, 10, 6, 0);
    box(1, 1.6f, 0.1f, 2.8f, 0);
    box(-2, -2, 0.1f, 2, 0);
    box(3, -2, 0.8f, 0.6f, 0.4f);
    box(-3.5f, 2, 1.4f, 0.7f, 0);
    box(-0.5f, 0.3f, 0.4f, 0.3f, 0.7f);
  }

  /// Points in the frame of the scanner, z = 0. noise: sigma of the ranges, metres.
  std::vector<Eigen::Vector3f> scan(const Eigen::Isometry3d& world_from_scanner, unsigned seed,
                                    float noise = 0.006f, int readings = 1440) const {
    std::mt19937 random(seed);
    std::normal_distribution<float> error(0, noise);
    std::vector<Eigen::Vector3f> points;
    const Eigen::Vector2d from = world_from_scanner.translation().head<2>();
    for (int k = 0; k < readings; ++k) {
      const double angle = 2 * 3.14159265358979 * k / readings - 3.14159265358979;
      const Eigen::Vector3d ray(std::cos(angle), std::sin(angle), 0);
      const Eigen::Vector2d turned = (world_from_scanner.linear() * ray).head<2>();
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& [a, b] : segments_) {
        const Eigen::Vector2d along = b - a, to = a - from;
        const double cross = turned.x() * along.y() - turned.y() * along.x();
        if (std::abs(cross) < 1e-12) continue;
        const double range = (to.x() * along.y() - to.y() * along.x()) / cross,
                     at = (to.x() * turned.y() - to.y() * turned.x()) / cross;
        if (range > 0.05 && at >= 0 && at <= 1 && range < nearest) nearest = range;
      }
      if (std::isfinite(nearest))
        points.push_back(((nearest + static_cast<double>(error(random))) * ray).cast<float>());
    }
    return points;
  }

 private:
  void box(float x, float y, float width, float depth, float turn) {
    const Eigen::Rotation2Dd r(static_cast<double>(turn));
    std::vector<Eigen::Vector2d> corners;
    for (const auto& [sx, sy] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      corners.push_back(Eigen::Vector2d(static_cast<double>(x), static_cast<double>(y)) +
                        r * Eigen::Vector2d(0.5 * sx * static_cast<double>(width),
                                            0.5 * sy * static_cast<double>(depth)));
    for (std::size_t k = 0; k < 4; ++k) segments_.emplace_back(corners[k], corners[(k + 1) % 4]);
  }

  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> segments_;
};

inline Eigen::Isometry3d pose_in_plan(double x, double y, double turn) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() << x, y, 0;
  return pose;
}

}  // namespace gpureg::test
