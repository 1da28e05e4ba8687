// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <vector>

#include "depth_calibration.hpp"
#include "tracking/features.hpp"

namespace slam_demo {

constexpr int kNone = -1;

/// Place in a vector of what is counted by int, as -1 means none.
inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// A keyframe sees a point at one of its features.
struct Observation {
  int keyframe, key;
  int loop = kNone;  ///< the loop that added it, so that a retraction can take it back
};

/// A measured relative pose of two keyframes.
struct RelativePose {
  int a, b;  ///< keyframes
  Eigen::Isometry3d a_from_b;
  /// Inverse covariance of (rotation in radians, translation in metres) in b's frame.
  Eigen::Matrix<double, 6, 6> information;
};

/// The keys with at least min_count, those with the highest counts first.
std::vector<int> by_count(const std::map<int, int>& counts, int min_count = 1);

/// Independent noise, as the inverse covariance of (rotation, translation).
Eigen::Matrix<double, 6, 6> information_of(double radians, double metres);

struct MapPoint {
  Eigen::Vector3d position{0, 0, 0};  ///< world of its session, metres
  Descriptor descriptor{};            ///< of the latest observation
  int first_keyframe = kNone;
  double octave_zero_distance = 0;  ///< metres at which it would be seen in octave 0
  std::vector<Observation> observations;
  bool bad = false;
};

struct Keyframe {
  int frame = 0;
  double time = 0;
  int session = 0;
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  std::shared_ptr<const Features> features;
  std::vector<int> points;       ///< of each feature the point that it sees, or kNone
  std::map<int, int> covisible;  ///< keyframes and the number of shared points, > 0
};

/// Keyframes and points, by index; nothing is moved or renumbered. Not thread-safe.
class Map {
 public:
  std::vector<Keyframe> keyframes;
  std::vector<MapPoint> points;
  /// Motions between keyframes that share few points: adjustments keep them.
  std::vector<RelativePose> links;
  /// Of the depth camera; features have the depths as they were measured.
  DepthCalibration calibration;

  int add_keyframe(Keyframe keyframe);  ///< without observations
  /// A new point at a feature with depth. Returns its index.
  int add_point(int keyframe, int key, const Eigen::Vector3d& position);
  /// Loops add observations of points that the feature does not see otherwise; keyframe.points
  /// stays as it is then.
  void add_observation(int point, const Observation& observation);
  void remove_observation(int point, int keyframe, int key);
  void remove_point(int point);
  void remove_loop(int loop);  ///< every observation that the loop added
  /// Removes points that few keyframes confirmed since they were made.
  void cull(int newest_keyframe);

  /// A copy for another thread: all keyframes with pose and features, the points only of some.
  Map excerpt(const std::vector<int>& keyframes_with_points) const;

  /// At most count keyframes that share at least min_shared points, most first.
  std::vector<int> covisible(int keyframe, std::size_t count, int min_shared = 1) const;

  /// Keyframes and the number of points that they share without loops.
  std::map<int, int> tracked_covisible(int keyframe) const;

  const Observation* find(int point, int keyframe) const;

 private:
  void count_shared(int keyframe, int point, int change);
  std::size_t culled_ = 0;  // points before are settled
};

}  // namespace slam_demo
