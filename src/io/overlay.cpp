// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
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
  PlyWriter ply(finite_points(source) + finite_points(target),
                "property float x\nproperty float y\nproperty float z\n"
                "property uchar red\nproperty uchar green\nproperty uchar blue\n",
                15);
  for (const Eigen::Vector3f& p : source.points) {
    if (!p.allFinite()) continue;
    ply.append((target_from_source * p.cast<double>()).cast<float>());
    ply.append(255, 180, 0);
  }
  for (const Eigen::Vector3f& p : target.points) {
    if (!p.allFinite()) continue;
    ply.append(p);
    ply.append(0, 166, 237);
  }
  files::write_atomically(path, ply.bytes());
}

}  // namespace gpureg::io
