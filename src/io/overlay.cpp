// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "gpureg/files.hpp"
#include "gpureg/overlay.hpp"
#include "io/ply_writer.hpp"

namespace gpureg::io {
namespace {

std::size_t finite_points(const PointCloud& cloud) {
  return static_cast<std::size_t>(
      std::count_if(cloud.points.begin(), cloud.points.end(),
                    [](const Eigen::Vector3f& p) { return p.allFinite(); }));
}

}  // namespace

void write_overlay(const std::string& path, const PointCloud& source, const PointCloud& target,
                   const Eigen::Isometry3d& target_from_source) {
  // Non-finite points are left out: viewers fail on NaN.
  PlyWriter ply(finite_points(source) + finite_points(target), target.origin,
                "property uchar red\nproperty uchar green\nproperty uchar blue\n", 3);
  for (const Eigen::Vector3f& p : source.points) {
    if (!p.allFinite()) continue;
    const Eigen::Vector3d moved = target_from_source * (p.cast<double>() + source.origin);
    ply.append_point((moved - target.origin).cast<float>());
    ply.append(255, 180, 0);
  }
  for (const Eigen::Vector3f& p : target.points) {
    if (!p.allFinite()) continue;
    ply.append_point(p);
    ply.append(0, 166, 237);
  }
  files::write_atomically(path, ply.bytes());
}

}  // namespace gpureg::io
