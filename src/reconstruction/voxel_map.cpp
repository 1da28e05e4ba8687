// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/float_origin.hpp"
#include "common/rigid.hpp"
#include "common/validate.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {
namespace {

/// Voxels beyond this number from the origin are not kept: integers would overflow.
constexpr double kFarthestVoxel = 4e18;

}  // namespace

VoxelMap::VoxelMap(float voxel_size) : voxel_size_(static_cast<double>(voxel_size)) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a finite number > 0");
}

std::size_t VoxelMap::Hash::operator()(const Key& key) const {
  std::uint64_t hash = 0;
  for (const std::int64_t axis : {key.x, key.y, key.z}) {
    hash = (hash ^ static_cast<std::uint64_t>(axis)) * 0x9E3779B97F4A7C15ull;
    hash ^= hash >> 32;
  }
  return static_cast<std::size_t>(hash);
}

void VoxelMap::add(const PointCloudView& scan, const UnalignedIsometry3d& map_from_scan) {
  scan.validate();
  require_rigid(map_from_scan, "map_from_scan");
  has_normals_ |= scan.normals != nullptr;
  const Eigen::Vector3d origin(scan.origin[0], scan.origin[1], scan.origin[2]);
  for (std::size_t k = 0; k < scan.size; ++k) {
    const Eigen::Map<const Eigen::Vector3f> row(scan.points + k * scan.point_stride);
    if (!row.allFinite()) continue;
    const Eigen::Vector3d p = map_from_scan * (row.cast<double>() + origin);
    const Eigen::Array3d voxel = (p / voxel_size_).array().floor();
    if (!(voxel.abs() < kFarthestVoxel).all()) continue;
    Cell& cell = cells_[{static_cast<std::int64_t>(voxel.x()), static_cast<std::int64_t>(voxel.y()),
                         static_cast<std::int64_t>(voxel.z())}];
    cell.point += p;
    ++cell.count;
    if (scan.normals == nullptr) continue;
    const Eigen::Map<const Eigen::Vector3f> normal(scan.normals + k * scan.normal_stride);
    if (normal.allFinite() && normal.squaredNorm() > 0)
      cell.normal += map_from_scan.linear() * normal.cast<double>().normalized();
  }
}

PointCloud VoxelMap::cloud() const {
  std::vector<const std::pair<const Key, Cell>*> ordered;
  ordered.reserve(cells_.size());
  for (const auto& entry : cells_) ordered.push_back(&entry);
  std::sort(ordered.begin(), ordered.end(),
            [](const auto* a, const auto* b) { return a->first < b->first; });
  PointCloud out;
  std::vector<Eigen::Vector3d> means;
  means.reserve(ordered.size());
  if (has_normals_) out.normals.reserve(ordered.size());
  for (const auto* entry : ordered) {
    const Cell& cell = entry->second;
    means.push_back(cell.point / static_cast<double>(cell.count));
    if (!has_normals_) continue;
    const double length = cell.normal.norm();
    // Below, the normals of the voxel's points cancel out: both sides of a thin wall.
    constexpr double kLeastLength = 1e-6;
    out.normals.push_back(length > kLeastLength
                              ? Eigen::Vector3f((cell.normal / length).cast<float>())
                              : Eigen::Vector3f(Eigen::Vector3f::Zero()));
  }
  set_points(out, means);
  return out;
}

}  // namespace gpureg::reconstruction
