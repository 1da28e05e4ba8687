// SPDX-License-Identifier: BSD-3-Clause
#include "flat/extruded.hpp"

#include <cmath>

#include "flat/scan_plane.hpp"

namespace gpureg {
namespace {

/// Distance of layers in voxels: a little more than one, so that no voxel takes two of them.
constexpr double kLayerDistance = 1.01;
/// Normals are given in the plane or across it, the latter by programs that know no 2-D scans:
/// these tell nothing. Squared cosine to the normal of the plane.
constexpr double kInPlane = 0.25;

double height_of(const ScanPlane& plane, const float* row) {
  double height = -plane.offset;
  for (int k = 0; k < 3; ++k) height += plane.normal[k] * static_cast<double>(row[k]);
  return height;
}

bool normals_in_plane(const RawCloud& raw, const ScanPlane& plane) {
  std::size_t in = 0, out = 0;
  for (std::size_t i = 0; i < raw.size; ++i) {
    const float* n = raw.normals + i * raw.normal_stride;
    double across = 0, squared = 0;
    for (int k = 0; k < 3; ++k) {
      across += plane.normal[k] * static_cast<double>(n[k]);
      squared += static_cast<double>(n[k]) * static_cast<double>(n[k]);
    }
    if (!(squared > 0)) continue;
    (across * across <= kInPlane * squared ? in : out) += 1;
  }
  return in > out;
}

}  // namespace

double layer_distance(const PrepareSettings& options) {
  const double voxel = options.voxel_size > 0 ? static_cast<double>(options.voxel_size)
                                              : 0.5 * static_cast<double>(options.normal_radius);
  return kLayerDistance * voxel;
}

Extruded::Extruded(const RawCloud& raw, bool model, const PrepareSettings& options) : cloud_(raw) {
  if (model) return;
  const auto plane = find_scan_plane(raw.points, raw.size, raw.point_stride);
  if (!plane) return;
  plane_ = *plane;
  plane_.layers = kLayers;
  const double distance = layer_distance(options);
  const bool with_normals = raw.normals && normals_in_plane(raw, plane_);
  for (std::uint32_t layer = 0; layer < kLayers; ++layer) {
    const double lift = distance * (static_cast<double>(layer) - (kLayers - 1) / 2);
    for (std::size_t i = 0; i < raw.size; ++i) {
      const float* p = raw.points + i * raw.point_stride;
      for (int k = 0; k < 3; ++k)
        points_.push_back(static_cast<float>(static_cast<double>(p[k]) + plane_.normal[k] * lift));
      if (with_normals)
        for (int k = 0; k < 3; ++k) normals_.push_back(raw.normals[i * raw.normal_stride + k]);
      if (raw.features) {
        const float* f = raw.features + i * raw.feature_stride;
        features_.insert(features_.end(), f, f + raw.feature_dimension);
      }
    }
  }
  // Rays of a 2-D scanner lie in its plane.
  const float origin[3] = {0, 0, 0};
  const bool given = raw.viewpoint_count > 0;
  for (std::size_t v = 0; v < (given ? raw.viewpoint_count : 1); ++v) {
    const float* row = given ? raw.viewpoints + 3 * v : origin;
    const double height = height_of(plane_, row);
    for (int k = 0; k < 3; ++k)
      viewpoints_.push_back(
          static_cast<float>(static_cast<double>(row[k]) - plane_.normal[k] * height));
  }
  cloud_.points = points_.data();
  cloud_.size = raw.size * kLayers;
  cloud_.point_stride = 3;
  cloud_.normals = with_normals ? normals_.data() : nullptr;
  cloud_.normal_stride = 3;
  cloud_.features = raw.features ? features_.data() : nullptr;
  cloud_.feature_stride = raw.feature_dimension;
  // With normals, a viewpoint that nobody gave would turn them.
  if (!given && with_normals) return;
  cloud_.viewpoints = viewpoints_.data();
  cloud_.viewpoint_count = viewpoints_.size() / 3;
}

void Extruded::count(PrepareStatistics& statistics) const {
  if (!plane_.exists()) return;
  statistics.flat = true;
  statistics.input_points /= plane_.layers;
  statistics.invalid_points /= plane_.layers;
  statistics.stray_points /= plane_.layers;
}

}  // namespace gpureg
