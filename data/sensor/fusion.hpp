// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "data/sensor/depth_sensor.hpp"

namespace gpureg::synthetic {

/// A truncated signed distance function in blocks of 8^3 voxels that are made where surfaces are
/// (Curless & Levoy 1996; Niessner et al. 2013). Not thread-safe; the same images in the same order
/// give the same bytes.
class FusionVolume {
 public:
  explicit FusionVolume(float voxel_size = 0.01f) : voxel_(voxel_size), slots_(1u << 12, Slot{}) {}

  void integrate(const DepthQuarter& image, const Eigen::Isometry3d& fragment_from_camera);

  /// Zero crossings of voxels seen with at least min_weight, averaged in cells of cell_size;
  /// ordered by cell. Metres, fragment's frame.
  std::vector<Eigen::Vector3f> extract(float min_weight, float cell_size) const;

 private:
  static constexpr int kSide = 8;
  struct Voxel {
    float distance = 0, weight = 0;  // distance: mean, metres, positive before the surface
  };
  struct Block {
    Eigen::Vector3i coordinate;
    std::array<Voxel, kSide * kSide * kSide> voxels;
  };
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t block = kEmpty;
  };
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;

  static std::uint64_t pack(const Eigen::Vector3i& block);
  std::uint32_t find(std::uint64_t key) const;
  std::uint32_t find_or_make(const Eigen::Vector3i& block);
  void grow();
  const Voxel* voxel(const Eigen::Vector3i& v) const;

  float voxel_;
  std::vector<Slot> slots_;
  std::vector<Block> blocks_;
};

}  // namespace gpureg::synthetic
