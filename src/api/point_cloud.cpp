// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/point_cloud.hpp"

#include "algorithm/normal.hpp"
#include "api/raw_cloud.hpp"
#include "common/coordinates.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"
#include "sensor_fixed/known.hpp"
#include "sensor_fixed/range_shells.hpp"

namespace gpureg {

void PointCloudView::validate() const {
  require(size <= limits::kMaxPoints, "cloud.size", size, "at most 2^31 - 1 points");
  require(points != nullptr || size == 0, "cloud.points", "null", "a pointer, as size is not 0");
  require(point_stride >= 3, "cloud.point_stride", point_stride, "at least 3 floats");
  require(normals == nullptr || normal_stride >= 3, "cloud.normal_stride", normal_stride,
          "at least 3 floats");
  require(features == nullptr ||
              (feature_dimension >= 1 && feature_dimension <= limits::kMaxFeatureDimension),
          "cloud.feature_dimension", feature_dimension, "1 to 4096, as features are given");
  require(features != nullptr || feature_dimension == 0, "cloud.features", "null",
          "a pointer, as feature_dimension is not 0");
  require(feature_stride == 0 || feature_stride >= feature_dimension, "cloud.feature_stride",
          feature_stride, "0 or at least feature_dimension");
  require(viewpoints != nullptr || viewpoint_count == 0, "cloud.viewpoints", "null",
          "a pointer, as viewpoint_count is not 0");
  for (std::size_t k = 0; k < 3 * viewpoint_count; ++k)
    require(std::isfinite(viewpoints[k]), "cloud.viewpoints", viewpoints[k], "finite coordinates");
  require(viewpoint_count == 0 || infer_viewpoint, "cloud.infer_viewpoint", "false",
          "true, as viewpoints are given");
  require(!model || normals != nullptr, "cloud.model", "true",
          "false, or normals that point outwards");
  require(!model || viewpoint_count == 0, "cloud.model", "true", "false, as viewpoints are given");
  for (const double coordinate : origin)
    require(std::abs(coordinate) <= limits::kMaxCoordinate, "cloud.origin", coordinate,
            "finite coordinates of at most 1e12");
}

double PointCloudView::share_facing_away() const {
  validate();
  if (!normals || viewpoint_count == 0 || size == 0) return 0;
  std::vector<Vec3> places(viewpoint_count);
  for (std::size_t k = 0; k < viewpoint_count; ++k)
    places[k] = {viewpoints[3 * k], viewpoints[3 * k + 1], viewpoints[3 * k + 2]};
  std::size_t away = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const float *n = normals + i * normal_stride, *p = points + i * point_stride;
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    // Comparisons with NaN are false: unknown normals and points do not count as facing away.
    if (length > 0)
      away +=
          faces_away(Vec3{n[0], n[1], n[2]} * (1.0f / length), {p[0], p[1], p[2]}, span_of(places));
  }
  return static_cast<double>(away) / static_cast<double>(size);
}

PointCloudView PointCloud::view() const {
  PointCloudView v(points);
  require(normals.empty() || normals.size() == points.size(), "cloud.normals", normals.size(),
          "none or as many as points");
  if (!normals.empty()) v.normals = normals.front().data();
  if (!viewpoints.empty()) {
    v.viewpoints = viewpoints.front().data();
    v.viewpoint_count = viewpoints.size();
  }
  v.model = model && v.normals && v.viewpoint_count == 0;
  for (int k = 0; k < 3; ++k) v.origin[k] = origin[k];
  return v;
}

RangeLimits range_limits(const PointCloudView& cloud) {
  RawCloud raw = raw_cloud(cloud);
  FrameOrigin origin;
  view_from_frame_origin(cloud.origin, origin, raw);
  return has_sensor_frame(cloud) ? range_shells(raw).limits : RangeLimits{};
}

}  // namespace gpureg
