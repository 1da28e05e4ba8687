// SPDX-License-Identifier: BSD-3-Clause
#include "data/surface.hpp"

#include <cmath>

#include "data/scene_files.hpp"
#include "data/sensor/camera.hpp"

namespace gpureg::synthetic {
namespace {

constexpr float kCell = 0.01f;  // metres
constexpr int kPixelStep = 4;   // of so many pixels in a row one is cast

/// 21 bits per axis: 10 km around the origin.
std::uint64_t cell_of(const Eigen::Vector3f& p) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::int64_t>(std::floor(p[axis] / kCell));
    key = (key << 21) | (static_cast<std::uint64_t>(at) & 0x1FFFFFu);
  }
  return key;
}

}  // namespace

void VisibleSurface::look(const RayScene& scene, const Eigen::Isometry3d& world_from_camera,
                          double min_depth, double max_depth) {
  const Eigen::Matrix3f rotation = world_from_camera.rotation().cast<float>();
  const Eigen::Vector3f origin = world_from_camera.translation().cast<float>();
  for (int y = 0; y < camera::kHeight; y += kPixelStep) {
    for (int x = 0; x < camera::kWidth; x += kPixelStep) {
      const Eigen::Vector3f ray =
          rotation * camera::ray(static_cast<float>(x), static_cast<float>(y));
      const RayHit hit = scene.cast(origin, ray);
      if (!hit.hit || hit.t < static_cast<float>(min_depth) ||
          hit.t > static_cast<float>(max_depth))
        continue;
      const Eigen::Vector3f point = origin + hit.t * ray;
      const std::uint64_t cell = cell_of(point);
      if (cells_.insert(cell).second) points_.push_back({cell, point, hit.normal});
    }
  }
}

void write_surface(const std::string& path, const std::vector<VisibleSurface>& surfaces) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<Eigen::Vector3f> points, normals;
  for (const VisibleSurface& surface : surfaces) {
    for (const VisibleSurface::Point& point : surface.points()) {
      if (!seen.insert(point.cell).second) continue;
      points.push_back(point.position);
      normals.push_back(point.normal);
    }
  }
  write_cloud(path, points, normals);
}

}  // namespace gpureg::synthetic
