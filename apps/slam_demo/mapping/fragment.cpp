// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/fragment.hpp"

#include <cmath>
#include <gpureg/reconstruction.hpp>

namespace slam_demo {
namespace {
constexpr int kStride = 3;      // pixels: 1 cm at 2 m
constexpr int kEvery = 2;       // of so many frames the depth is fused; neighbours add little
constexpr int kReach = 4;       // pixels to both sides from which a normal is taken
constexpr float kJump = 0.05f;  // of the depth: more is an edge
}  // namespace

void back_project(const Pinhole& camera, const cv::Mat1f& depth, int stride,
                  std::vector<Eigen::Vector3f>& points, std::vector<Eigen::Vector3f>& normals) {
  const auto point = [&](int u, int v) {
    return Eigen::Vector3f(camera.unproject(u, v, depth(v, u)).cast<float>());
  };
  for (int v = kReach; v + kReach < depth.rows; v += stride) {
    for (int u = kReach; u + kReach < depth.cols; u += stride) {
      const float z = depth(v, u);
      if (z <= 0) continue;
      bool edge = false;
      for (const auto& [x, y] : {std::pair{u - kReach, v}, std::pair{u + kReach, v},
                                 std::pair{u, v - kReach}, std::pair{u, v + kReach}})
        edge |= depth(y, x) <= 0 || std::abs(depth(y, x) - z) > kJump * z;
      if (edge) continue;
      const Eigen::Vector3f normal = (point(u, v + kReach) - point(u, v - kReach))
                                         .cross(point(u + kReach, v) - point(u - kReach, v));
      const float length = normal.norm();
      if (!(length > 0)) continue;
      points.push_back(point(u, v));
      normals.push_back(normal / length);
    }
  }
}

FragmentBuilder::FragmentBuilder(const Pinhole& camera, int frames, float voxel_size)
    : camera_(camera), frames_(frames), voxel_size_(voxel_size) {}

void FragmentBuilder::add(int frame, const FramePose& pose, const cv::Mat1f& depth) {
  Scan scan{frame, pose, {}, {}};
  if (scans_.size() % kEvery == 0) back_project(camera_, depth, kStride, scan.points, scan.normals);
  scans_.push_back(std::move(scan));
}

FragmentScans FragmentBuilder::take(const Map& map) {
  FragmentScans result;
  result.voxel_size = voxel_size_;
  BuiltFragment& fragment = result.fragment;
  fragment.first_frame = scans_.front().frame;
  fragment.last_frame = scans_.back().frame;
  const int middle = scans_[scans_.size() / 2].frame;
  for (const Scan& scan : scans_) {
    const auto distance = [&](int keyframe) {
      return std::abs(map.keyframes[static_cast<std::size_t>(keyframe)].frame - middle);
    };
    if (fragment.keyframe == kNone || distance(scan.pose.reference) < distance(fragment.keyframe))
      fragment.keyframe = scan.pose.reference;
  }
  const Keyframe& keyframe = map.keyframes[static_cast<std::size_t>(fragment.keyframe)];
  fragment.time = keyframe.time;
  for (Scan& scan : scans_)
    result.scans.push_back(
        {keyframe.world_from_camera.inverse() * world_from_camera(map, scan.pose),
         std::move(scan.points), std::move(scan.normals)});
  scans_.clear();
  return result;
}

gpureg::PointCloud fused(const FragmentScans& all) {
  gpureg::reconstruction::VoxelMap map(all.voxel_size);
  std::vector<Eigen::Vector3f> viewpoints;
  for (std::size_t k = 0; k < all.scans.size(); ++k) {
    const FragmentScans::Scan& scan = all.scans[k];
    if (k % 5 == 0) viewpoints.push_back(scan.fragment_from_camera.translation().cast<float>());
    if (scan.points.empty()) continue;
    gpureg::PointCloudView view(scan.points);
    view.normals = scan.normals.front().data();
    map.add(view, gpureg::UnalignedIsometry3d(scan.fragment_from_camera.matrix()));
  }
  gpureg::PointCloud cloud = map.cloud();
  cloud.viewpoints = std::move(viewpoints);
  return cloud;
}

}  // namespace slam_demo
