// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "data/generate.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::synthetic {

/// A 2-D scanner on a robot: one horizontal ring of ranges. Frame of a scan: the scanner, x
/// forward, z up, so that all points have z = 0.
class PlanarScanner {
 public:
  PlanarScanner(const RayScene& scene, const PlanarScannerOptions& options, std::uint64_t seed)
      : scene_(scene), options_(options), seed_(seed) {}

  /// Under the camera of a walk, in its direction.
  Eigen::Isometry3d pose_under(const Eigen::Isometry3d& world_from_camera) const;
  /// Readings that hit something within the range.
  std::vector<Eigen::Vector3f> scan(const Eigen::Isometry3d& world_from_scanner, int frame) const;

 private:
  const RayScene& scene_;
  const PlanarScannerOptions& options_;
  const std::uint64_t seed_;
};

}  // namespace gpureg::synthetic
