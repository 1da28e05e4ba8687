// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gpureg {

/// Non-owning view of a point cloud in host memory. Whatever it points at must outlive the call
/// that it is given to.
///
/// Rows may be strided (in floats), so a view fits std::vector<Eigen::Vector3f>, pcl::PointXYZ
/// (stride 4) and numpy rows alike. Points with a NaN or infinite coordinate are allowed: prepare()
/// drops and counts them.
struct PointCloudView {
  const float* points = nullptr;  ///< size rows of x, y, z; metres
  std::size_t size = 0;           ///< number of points
  std::size_t point_stride = 3;   ///< floats from one point to the next, >= 3
  /// optional: size rows of nx, ny, nz; any length, (0,0,0) and NaN mean unknown
  const float* normals = nullptr;
  std::size_t normal_stride = 3;  ///< floats from one normal to the next, >= 3
  /// optional: size rows of feature_dimension floats, used instead of FPFH
  const float* features = nullptr;
  std::size_t feature_dimension = 0;  ///< floats per feature, >= 1 where features are given
  /// floats from one feature to the next; 0: feature_dimension
  std::size_t feature_stride = 0;
  /// Optional: viewpoint_count rows of x, y, z (tight): sensor positions in the cloud's frame.
  /// Normals of the cloud's own that face away from all of them are turned round, unless more than
  /// an eighth of the points have such: then the viewpoints are not what it was seen from. With
  /// PrepareOptions::depth_maps 0 they keep their side, too.
  const float* viewpoints = nullptr;
  /// 0: normals are turned towards the origin, which also counts as the place that the cloud was
  /// seen from, unless the cloud brings normals of its own: then nothing is known about free space,
  /// and no pose is judged by it.
  std::size_t viewpoint_count = 0;
  /// Added to every point and viewpoint: coordinates in the cloud's frame = origin + row. For large
  /// coordinates (UTM, maps), which float rows cannot hold. Poses and moments of results are in the
  /// cloud's frame; PreparedCloud::points() are rows, relative to this.
  double origin[3] = {0, 0, 0};

  PointCloudView() = default;
  PointCloudView(const float* xyz, std::size_t count) : points(xyz), size(count) {}
  explicit PointCloudView(const std::vector<Eigen::Vector3f>& xyz)
      : points(xyz.empty() ? nullptr : xyz.front().data()), size(xyz.size()) {}

  /// Throws InvalidArgument where pointers, counts and strides contradict each other or sizes
  /// exceed 2^31 - 1 points.
  void validate() const;

  /// Share of the points, in [0, 1], whose normal shows its back to every viewpoint; 0 where there
  /// are no normals, no viewpoints or no points. In a scan with the places that it was seen from it
  /// is a few per cent, along the edges of surfaces. Above kMaxFacingAway either the viewpoints
  /// are in another frame than the points, and free space will speak against right poses, or the
  /// normals point to any side. Reads every point once, in host memory; throws as validate() does.
  double share_facing_away() const;
  static constexpr double kMaxFacingAway = 0.125;
};

/// Owning cloud, for readers and generators; view() is what the library takes. Empty
/// normals/viewpoints mean "not known".
struct PointCloud {
  std::vector<Eigen::Vector3f> points;      ///< metres
  std::vector<Eigen::Vector3f> normals;     ///< empty or one per point
  std::vector<Eigen::Vector3f> viewpoints;  ///< sensor positions in the cloud's frame, may be empty

  /// View of this cloud, valid as long as its vectors do not change.
  PointCloudView view() const;
};

}  // namespace gpureg
