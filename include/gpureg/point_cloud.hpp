// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gpureg {

/// Non-owning view of a point cloud in host memory. The memory must stay valid and unchanged during
/// each call that takes the view.
///
/// Strides count floats, so a view fits std::vector<Eigen::Vector3f>, pcl::PointXYZ (stride 4) and
/// numpy rows alike. Points with a NaN or infinite coordinate are allowed: prepare() drops and
/// counts them.
struct PointCloudView {
  const float* points = nullptr;  ///< size rows of x, y, z; metres
  std::size_t size = 0;           ///< number of points
  std::size_t point_stride = 3;   ///< floats from one point to the next, >= 3
  /// Optional, size rows of nx, ny, nz of any length; (0,0,0) and NaN mean unknown.
  const float* normals = nullptr;
  std::size_t normal_stride = 3;  ///< floats from one normal to the next, >= 3
  /// Optional, size rows of feature_dimension floats, used instead of FPFH.
  const float* features = nullptr;
  std::size_t feature_dimension = 0;  ///< floats per feature, >= 1 if features are given
  /// Floats from one feature to the next; 0: feature_dimension.
  std::size_t feature_stride = 0;
  /// Optional, viewpoint_count rows of x, y, z without gaps: sensor positions in the frame of the
  /// cloud. Input normals that face away from all viewpoints are flipped, because no sensor
  /// observes the back of a surface. None is flipped if more than one eighth of the points face
  /// away (the viewpoints then belong to another frame), nor with PrepareOptions::depth_maps 0.
  /// prepare() refuses viewpoints whose coordinates are more than 2^23 normal radii from the
  /// cloud's.
  const float* viewpoints = nullptr;
  /// 0: with input normals free space is unknown, and no pose is verified by it. Without normals
  /// see infer_viewpoint.
  std::size_t viewpoint_count = 0;
  /// For a cloud without viewpoints and normals. true: the surfaces decide whether the origin of
  /// the frame is the viewpoint. false: the viewpoint is unknown. If it is unknown, no free
  /// space is known, and alignments try both sides of the surfaces. PrepareStatistics::viewpoint
  /// has the decision. No effect if PrepareOptions::depth_maps is 0: the origin then orients the
  /// normals.
  bool infer_viewpoint = true;
  /// The cloud is a model: seen from everywhere, with normals that point outwards, as of a sampled
  /// mesh. A scan should lie on it as a whole. Asks for normals and for no viewpoint. Clouds with
  /// closed surfaces are recognised as models without it.
  bool model = false;
  /// Added to every point and viewpoint: coordinates in the cloud's frame = origin + row. For large
  /// coordinates (UTM, maps), which float rows cannot hold. Poses and moments of results are in the
  /// cloud's frame; PreparedCloud::points() are rows, relative to this.
  double origin[3] = {0, 0, 0};

  PointCloudView() = default;
  PointCloudView(const float* xyz, std::size_t count) : points(xyz), size(count) {}
  explicit PointCloudView(const std::vector<Eigen::Vector3f>& xyz)
      : points(xyz.empty() ? nullptr : xyz.front().data()), size(xyz.size()) {}

  /// Checks pointers, counts, strides and viewpoints; reads no point.
  /// @throws InvalidArgument if they contradict each other, for a viewpoint that is not finite,
  ///   or for more than 2^31 - 1 points.
  void validate() const;

  /// Share of the points whose normal faces away from every viewpoint; 0 without normals,
  /// viewpoints or points. A scan with correct viewpoints has a few per cent, along the edges of
  /// surfaces. Above kMaxFacingAway the viewpoints are in another frame than the points, or the
  /// normals have arbitrary signs; free space then contradicts correct poses. Reads every point
  /// once. Thread-safe.
  /// @return share in [0, 1].
  /// @throws InvalidArgument as validate() does.
  double share_facing_away() const;
  static constexpr double kMaxFacingAway = 0.125;
};

/// Owning point cloud in host memory, made by readers and generators. Empty normals and viewpoints
/// mean unknown.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;      ///< metres, relative to origin
  std::vector<Eigen::Vector3f> normals;     ///< empty, or one per point
  std::vector<Eigen::Vector3f> viewpoints;  ///< sensor positions relative to origin, may be empty
  bool model = false;                       ///< see PointCloudView::model
  Eigen::Vector3d origin{0, 0, 0};          ///< see PointCloudView::origin

  /// Replaces the viewpoints.
  /// @param positions of the sensor in the cloud's frame, metres.
  void set_viewpoints(const std::vector<Eigen::Vector3d>& positions) {
    viewpoints.clear();
    for (const Eigen::Vector3d& p : positions) viewpoints.push_back((p - origin).cast<float>());
  }

  /// @return a view, valid as long as the vectors do not change.
  /// @throws InvalidArgument if the number of normals is neither 0 nor that of the points.
  PointCloudView view() const;
};

}  // namespace gpureg
