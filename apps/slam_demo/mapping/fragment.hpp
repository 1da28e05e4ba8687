// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/point_cloud.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "camera.hpp"
#include "tracking/tracker.hpp"

namespace slam_demo {

/// Points and normals of a depth image in the camera, one per stride x stride pixels. Pixels at
/// depth edges have no normal and are left out. Metres.
void back_project(const Pinhole& camera, const cv::Mat1f& depth, int stride,
                  std::vector<Eigen::Vector3f>& points, std::vector<Eigen::Vector3f>& normals);

/// The surfaces of some seconds in the frame of the keyframe nearest to their middle.
struct BuiltFragment {
  int keyframe = kNone;
  int first_frame = 0, last_frame = 0;
  double time = 0;           ///< of the keyframe
  gpureg::PointCloud cloud;  ///< with normals and camera positions
};

/// The same, not fused yet.
struct FragmentScans {
  struct Scan {
    Eigen::Isometry3d fragment_from_camera;
    std::vector<Eigen::Vector3f> points, normals;
  };
  BuiltFragment fragment;  ///< its cloud is empty
  std::vector<Scan> scans;
  float voxel_size = 0;  ///< metres; the cloud has one point per voxel
};

/// Takes long; needs no map.
gpureg::PointCloud fused(const FragmentScans& scans);

/// Collects the frames of one session until there are enough.
class FragmentBuilder {
 public:
  /// voxel_size: metres; the cloud has one point per voxel.
  FragmentBuilder(const Pinhole& camera, int frames, float voxel_size);

  void add(int frame, const FramePose& pose, const cv::Mat1f& depth);
  bool full() const { return static_cast<int>(scans_.size()) >= frames_; }
  std::size_t size() const { return scans_.size(); }
  /// Hands the frames over, by the poses that the map has now.
  FragmentScans take(const Map& map);
  void clear() { scans_.clear(); }

 private:
  struct Scan {
    int frame;
    FramePose pose;
    std::vector<Eigen::Vector3f> points, normals;
  };
  const Pinhole camera_;
  const int frames_;
  const float voxel_size_;
  std::vector<Scan> scans_;
};

}  // namespace slam_demo
