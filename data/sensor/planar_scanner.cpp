// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/planar_scanner.hpp"

#include <cmath>

#include "data/random.hpp"

namespace gpureg::synthetic {
namespace {

constexpr double kHeight = 0.3;      // metres above the floor: at the legs of furniture
constexpr double kLeastRange = 0.1;  // metres
constexpr double kDegree = 0.017453292519943295;

}  // namespace

Eigen::Isometry3d PlanarScanner::pose_under(const Eigen::Isometry3d& world_from_camera) const {
  const Eigen::Vector3d forward = world_from_camera.linear().col(2);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  const double length = std::hypot(forward.x(), forward.y());
  if (length > 0) {
    const double c = forward.x() / length, s = forward.y() / length;
    out.linear() << c, -s, 0, s, c, 0, 0, 0, 1;
  }
  out.translation() = world_from_camera.translation();
  out.translation().z() = kHeight;
  return out;
}

std::vector<Eigen::Vector3f> PlanarScanner::scan(const Eigen::Isometry3d& world_from_scanner,
                                                 int frame) const {
  const int readings = static_cast<int>(options_.field / options_.step + 0.5);
  Random random(hash_key(seed_, Purpose::pixel, static_cast<std::uint64_t>(frame)));
  const Eigen::Vector3f origin = world_from_scanner.translation().cast<float>();
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < readings; ++k) {
    const double angle = (k * options_.step - 0.5 * options_.field) * kDegree;
    const Eigen::Vector3d ray(std::cos(angle), std::sin(angle), 0);
    const float error = random.normal();
    const RayHit hit = scene_.cast(origin, (world_from_scanner.linear() * ray).cast<float>());
    if (!hit.hit) continue;
    const double range = static_cast<double>(hit.t) + options_.noise * static_cast<double>(error);
    if (range < kLeastRange || range > options_.range) continue;
    points.push_back((range * ray).cast<float>());
  }
  return points;
}

}  // namespace gpureg::synthetic
