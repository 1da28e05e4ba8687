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

BuiltFragment FragmentBuilder::build(const Map& map) {
  BuiltFragment result;
  result.first_frame = scans_.front().frame;
  result.last_frame = scans_.back().frame;
  const int middle = scans_[scans_.size() / 2].frame;
  for (const Scan& scan : scans_) {
    const auto distance = [&](int keyframe) {
      return std::abs(map.keyframes[static_cast<std::size_t>(keyframe)].frame - middle);
    };
    if (result.keyframe == kNone || distance(scan.pose.reference) < distance(result.keyframe))
      result.keyframe = scan.pose.reference;
  }
  const Keyframe& keyframe = map.keyframes[static_cast<std::size_t>(result.keyframe)];
  result.time = keyframe.time;
  gpureg::reconstruction::VoxelMap fused(voxel_size_);
  std::vector<Eigen::Vector3f> viewpoints;
  for (std::size_t k = 0; k < scans_.size(); ++k) {
    const Eigen::Isometry3d fragment_from_camera =
        keyframe.world_from_camera.inverse() * world_from_camera(map, scans_[k].pose);
    if (k % 5 == 0) viewpoints.push_back(fragment_from_camera.translation().cast<float>());
    if (scans_[k].points.empty()) continue;
    gpureg::PointCloudView view(scans_[k].points);
    view.normals = scans_[k].normals.front().data();
    fused.add(view, gpureg::UnalignedIsometry3d(fragment_from_camera.matrix()));
  }
  result.cloud = fused.cloud();
  result.cloud.viewpoints = std::move(viewpoints);
  scans_.clear();
  return result;
}

}  // namespace slam_demo
