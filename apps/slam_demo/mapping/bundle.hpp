// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "camera.hpp"
#include "mapping/map.hpp"

/// Bundle adjustment by Ceres: the paper's equation with Huber's kernel, and the measured depth
/// beside the pixel.
namespace slam_demo {

/// A feature as a measurement: pixel and, where there is one, inverse depth.
struct Measurement {
  double u = 0, v = 0, depth = 0;  ///< pixels; metres, 0: none
  double sigma = 1;                ///< pixels
};
/// Its depth is corrected.
Measurement measurement(const Features& features, int key, const DepthCalibration& calibration);

/// Squared error of a point in the camera, in units of its variance. Behind the camera: 1e9.
double squared_error(const Pinhole& camera, const Measurement& m, const Eigen::Vector3d& point);

/// Largest squared error of an inlier: 95 % of the chi-square distribution of 2 or 3 numbers.
double inlier_threshold(const Measurement& m);

/// A known point and where the camera sees it.
struct PointMatch {
  Eigen::Vector3d world;
  Measurement seen;
};

/// Refines a pose by its matches, robustly. inliers: one flag per match, by the refined pose.
Eigen::Isometry3d refine_pose(const Pinhole& camera, const std::vector<PointMatch>& matches,
                              const Eigen::Isometry3d& world_from_camera,
                              std::vector<bool>& inliers);

/// A copy of a part of the map, so that it can be adjusted in another thread.
struct BundleProblem {
  using Pose = std::array<double, 7>;  ///< camera_from_world: quaternion x y z w, translation
  struct Sight {
    int pose, point;  ///< indices into poses and points
    int key, loop;
    Measurement seen;
  };
  std::vector<int> keyframes, point_ids;  ///< of the poses and points
  std::vector<Pose> poses;
  std::vector<bool> fixed;
  std::vector<Eigen::Vector3d> points;
  std::vector<Sight> sights;
  std::vector<RelativePose> relatives;  ///< a, b: indices into poses
  DepthCalibration calibration;         ///< by which the depths of the sights are corrected
  bool calibrate = false;               ///< estimate its offsets too
  bool calibrate_lens = false;          ///< and its lens
  DepthCalibration prior;               ///< expected calibration
};

/// Keyframes (those in fixed keep their poses) with all points that they see, the links of the map
/// between them, and further relative poses.
BundleProblem bundle_of(const Map& map, const std::vector<int>& keyframes,
                        const std::vector<int>& fixed, const std::vector<RelativePose>& relatives);

/// The newest keyframe, those that share points with it, their points, and all other keyframes
/// that see these, fixed.
BundleProblem local_bundle(const Map& map, int keyframe, std::size_t size);

struct BundleReport {
  double initial_cost = 0, final_cost = 0;
};

BundleReport adjust(const Pinhole& camera, BundleProblem& problem, int iterations, int threads);

/// Writes poses and points back, and drops the observations that do not fit.
void apply(const Pinhole& camera, const BundleProblem& problem, Map& map);

}  // namespace slam_demo
