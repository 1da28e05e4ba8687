// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/matching.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <set>

namespace slam_demo {
namespace {

/// The most similar of the features offered, and how similar the second one is.
struct Similar {
  int key = kNone, first = 257, second = 257;
  void offer(int candidate, int distance) {
    second = std::min(second, std::max(first, distance));
    if (distance >= first) return;
    first = distance;
    key = candidate;
  }
};

}  // namespace
void match_by_projection(const Map& map, const Pinhole& camera, const std::vector<int>& points,
                         double radius, int max_distance, double ratio, View& view) {
  const Eigen::Isometry3d camera_from_world = view.pose.inverse();
  const Features& features = *view.features;
  std::vector<int> distance(features.size(), 257);
  std::set<int> matched;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    if (view.points[k] == kNone) continue;
    matched.insert(view.points[k]);
    distance[k] = -1;  // stays
  }
  for (const int index : points) {
    const MapPoint& point = map.points[at(index)];
    if (point.bad || matched.count(index) != 0) continue;
    const Eigen::Vector3d p = camera_from_world * point.position;
    if (p.z() < 0.1) continue;
    const Eigen::Vector2d pixel = camera.project(p);
    if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > 2 * camera.cx + 1 ||
        pixel.y() > 2 * camera.cy + 1)
      continue;
    const double level = std::log(point.octave_zero_distance / p.norm()) / std::log(kScaleFactor);
    const int octave = std::clamp(static_cast<int>(std::lround(level)), 0, kLevels - 1);
    Similar best;
    for (const int k : features.near(pixel.x(), pixel.y(), radius * scale_of(octave))) {
      if (distance[at(k)] < 0 || std::abs(features.keys[at(k)].octave - octave) > 1) continue;
      best.offer(k, hamming(point.descriptor, features.descriptors[at(k)]));
    }
    if (best.key == kNone || best.first > max_distance || best.first > ratio * best.second)
      continue;
    if (best.first >= distance[at(best.key)]) continue;  // another point is more similar
    distance[at(best.key)] = best.first;
    view.points[at(best.key)] = index;
  }
}

bool solve_pnp(const Map& map, const Pinhole& camera, View& view) {
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;
  std::vector<std::size_t> keys;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    if (view.points[k] == kNone) continue;
    const Eigen::Vector3d& p = map.points[at(view.points[k])].position;
    world.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(view.features->keys[k].pt);
    keys.push_back(k);
  }
  if (world.size() < 12) return false;
  const cv::Matx33d intrinsics(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Mat rotation_vector, translation, rotation, inliers;
  // OpenCV seeds its own generator with a constant: the same matches give the same pose.
  if (!cv::solvePnPRansac(world, pixels, intrinsics, cv::noArray(), rotation_vector, translation,
                          false, 150, 4.0f, 0.999, inliers, cv::SOLVEPNP_EPNP) ||
      inliers.total() < 10)
    return false;
  cv::Rodrigues(rotation_vector, rotation);
  Eigen::Matrix3d r;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, r);
  cv::cv2eigen(translation, t);
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
  camera_from_world.linear() = r;
  camera_from_world.translation() = t;
  if (!camera_from_world.matrix().allFinite()) return false;
  view.pose = camera_from_world.inverse();
  std::vector<int> kept(view.points.size(), kNone);
  for (int i = 0; i < static_cast<int>(inliers.total()); ++i) {
    const std::size_t k = keys[at(inliers.at<int>(i))];
    kept[k] = view.points[k];
  }
  view.points = kept;
  return true;
}

int refine(const Map& map, const Pinhole& camera, View& view) {
  std::vector<PointMatch> matches;
  std::vector<std::size_t> keys;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    if (view.points[k] == kNone) continue;
    matches.push_back({map.points[at(view.points[k])].position,
                       measurement(*view.features, static_cast<int>(k), map.calibration)});
    keys.push_back(k);
  }
  std::vector<bool> inliers;
  view.pose = refine_pose(camera, matches, view.pose, inliers);
  view.inliers = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (inliers[i])
      ++view.inliers;
    else
      view.points[keys[i]] = kNone;
  }
  return view.inliers;
}

void match_by_descriptor(const Map& map, const Keyframe& keyframe, View& view) {
  view.points.assign(view.features->size(), kNone);
  std::vector<int> distance(view.features->size(), 257);
  for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
    const int point = keyframe.points[i];
    if (point == kNone || map.points[at(point)].bad) continue;
    Similar best;
    for (std::size_t j = 0; j < view.features->size(); ++j)
      best.offer(static_cast<int>(j),
                 hamming(keyframe.features->descriptors[i], view.features->descriptors[j]));
    if (best.key == kNone || best.first >= kMaxDistance || best.first >= 0.75 * best.second ||
        best.first >= distance[at(best.key)])
      continue;
    distance[at(best.key)] = best.first;
    view.points[at(best.key)] = point;
  }
}

}  // namespace slam_demo
