// SPDX-License-Identifier: BSD-3-Clause
#include "scale/ladder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithm/cell.hpp"

namespace gpureg::scale {
namespace {

/// Share of the points that stand alone in their voxels, from which on there are no surfaces.
constexpr double kAlone = 0.9;
/// The smallest rung: diagonal of the cloud in voxels.
constexpr double kLeastDiagonal = 8;
/// Voxels of a coordinate: three fit a key.
constexpr double kMostVoxels = 1 << 20;

struct FiniteRows {
  std::vector<float> rows;
  double low[3], extent = 0;

  explicit FiniteRows(const PointCloudView& cloud) {
    float least[3], most[3];
    std::fill(least, least + 3, std::numeric_limits<float>::infinity());
    std::fill(most, most + 3, -std::numeric_limits<float>::infinity());
    rows.reserve(3 * cloud.size);
    for (std::size_t k = 0; k < cloud.size; ++k) {
      const float* row = cloud.points + k * cloud.point_stride;
      if (!std::isfinite(row[0]) || !std::isfinite(row[1]) || !std::isfinite(row[2])) continue;
      rows.insert(rows.end(), row, row + 3);
      for (int a = 0; a < 3; ++a) {
        least[a] = std::min(least[a], row[a]);
        most[a] = std::max(most[a], row[a]);
      }
    }
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<double>(least[a]);
      if (!rows.empty())
        extent = std::max(extent, static_cast<double>(most[a]) - static_cast<double>(least[a]));
    }
  }
  std::size_t size() const { return rows.size() / 3; }

  std::size_t voxels(double voxel) const {
    std::size_t slots = 16;
    while (slots < 2 * size()) slots *= 2;
    std::vector<std::uint64_t> table(slots, kEmptyKey);  // open addressing
    std::size_t count = 0;
    const double inverse = 1 / voxel;
    for (std::size_t k = 0; k < size(); ++k) {
      std::uint64_t key = 0;
      for (std::size_t a = 0; a < 3; ++a)
        key = key << 21 |
              static_cast<std::uint64_t>((static_cast<double>(rows[3 * k + a]) - low[a]) * inverse);
      std::size_t slot = cell_slot(key, static_cast<std::uint32_t>(slots - 1));
      while (table[slot] != kEmptyKey && table[slot] != key) slot = (slot + 1) & (slots - 1);
      count += table[slot] == kEmptyKey;
      table[slot] = key;
    }
    return count;
  }
};

}  // namespace

std::vector<double> ladder_of(const PointCloudView& source, const ScaleRange& range, float voxel) {
  std::vector<double> out;
  const FiniteRows cloud(source);
  if (cloud.size() == 0 || !(cloud.extent > 0)) return out;
  const double size = static_cast<double>(voxel);
  const double first = std::max(kLeastDiagonal * size / cloud.extent,
                                range.is_free() ? 0.0 : range.least / std::sqrt(kStep));
  const double last = std::min(
      kMostVoxels * size / cloud.extent,
      range.is_free() ? std::numeric_limits<double>::infinity() : range.most * std::sqrt(kStep));
  // A product, not a power: libraries differ in the last bit of pow().
  double scale = 1;
  while (scale > first) scale /= kStep;
  while (scale < first) scale *= kStep;
  for (; scale <= last; scale *= kStep) {
    const std::size_t voxels = cloud.voxels(size / scale);
    if (voxels > kMostPoints ||
        static_cast<double>(voxels) > kAlone * static_cast<double>(cloud.size()))
      break;
    if (voxels >= kLeastPoints) out.push_back(scale);
  }
  return out;
}

ScaledCloud::ScaledCloud(const PointCloudView& cloud, double scale) : view_(cloud) {
  const auto scaled = [scale](float x) {
    return static_cast<float>(static_cast<double>(x) * scale);
  };
  points_.reserve(3 * cloud.size);
  for (std::size_t k = 0; k < cloud.size; ++k)
    for (std::size_t a = 0; a < 3; ++a)
      points_.push_back(scaled(cloud.points[k * cloud.point_stride + a]));
  for (std::size_t k = 0; k < 3 * cloud.viewpoint_count; ++k)
    viewpoints_.push_back(scaled(cloud.viewpoints[k]));
  view_.points = points_.data();
  view_.point_stride = 3;
  if (cloud.viewpoint_count > 0) view_.viewpoints = viewpoints_.data();
  for (double& x : view_.origin) x *= scale;
}

}  // namespace gpureg::scale
