// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace gpureg {

/// Numbers of the voxels of prepare().
class VoxelKeys {
 public:
  /// low: least coordinates of the cloud.
  VoxelKeys(const Eigen::Vector3d& low, double size)
      : size_(size), first_((low.array() / size).floor()) {}
  std::uint64_t operator()(const Eigen::Vector3f& p) const {
    const Eigen::Array3d cell = (p.cast<double>().array() / size_).floor() - first_;
    return static_cast<std::uint64_t>(cell.x()) << 42 | static_cast<std::uint64_t>(cell.y()) << 21 |
           static_cast<std::uint64_t>(cell.z());
  }

 private:
  double size_;
  Eigen::Array3d first_;
};

}  // namespace gpureg
