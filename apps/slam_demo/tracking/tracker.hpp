// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <future>
#include <optional>
#include <string>

#include "tracking/dense_odometry.hpp"
#include "tracking/matching.hpp"

namespace slam_demo {

/// What is known of a frame's pose. It follows its keyframe when the map changes.
struct FramePose {
  double time = 0;
  int session = kNone;    ///< kNone: not tracked
  int reference = kNone;  ///< keyframe
  Eigen::Isometry3d reference_from_camera = Eigen::Isometry3d::Identity();
};
Eigen::Isometry3d world_from_camera(const Map& map, const FramePose& pose);

struct TrackerOptions {
  int min_inliers = 25;         ///< fewer: the frame is lost
  int max_frames = 25;          ///< between two keyframes
  double keyframe_ratio = 0.7;  ///< of the reference's points: fewer are a weak track
  std::size_t local_keyframes = 15;
  std::size_t bundle_keyframes = 8;
  int bundle_iterations = 6;
  bool sequential = false;  ///< local adjustment in the caller's thread: same bits every time
};

/// Follows the camera frame by frame. One session is a stretch without a loss; every session has a
/// world of its own until it is merged. Not thread-safe.
class Tracker {
 public:
  Tracker(Map& map, const Pinhole& camera, const TrackerOptions& options);
  ~Tracker();

  struct Outcome {
    FramePose pose;
    int inliers = 0;
    int new_keyframe = kNone;
    bool new_session = false;
    bool dense = false;  ///< by all pixels, for want of features
  };
  /// An image without features and depths is a lost frame.
  Outcome track(int frame, double time, Features features, const cv::Mat1b& grey,
                const cv::Mat1f& depth);

  /// Motion from the next frame's time on, by the motion of the last two frames. Identity where
  /// these are unknown.
  Eigen::Isometry3d motion_within(double seconds) const;

  /// Waits for the adjustment in the other thread and applies it; before anyone else changes the
  /// map.
  void settle();
  double bundle_milliseconds() const { return bundle_milliseconds_; }

 private:
  bool track_last(View& view) const;
  bool relocalise(View& view) const;
  bool plausible(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& last_from_now,
                 double metres, double radians) const;
  bool track_dense(View& view, const cv::Mat1b& grey, const cv::Mat1f& depth);
  bool track_local_map(View& view);
  bool needs_keyframe(const View& view) const;
  int make_keyframe(const View& view, int frame, double time, int session, bool linked);
  void start_bundle(int keyframe);
  void finish_bundle(bool wait);

  Map& map_;
  const Pinhole camera_;
  const TrackerOptions options_;
  int sessions_ = 0;
  bool lost_ = true;
  int reference_ = kNone;  // keyframe that shares most points with the last frame
  int last_keyframe_ = kNone;
  int since_keyframe_ = 0;
  std::vector<int> last_points_;
  FramePose last_;
  const DenseOdometry dense_;
  cv::Mat1b last_grey_;
  cv::Mat1f last_depth_;
  int reference_inliers_ = 0;  // of the frame after the newest keyframe
  Eigen::Isometry3d velocity_ = Eigen::Isometry3d::Identity();  // last_from_now
  double velocity_seconds_ = 0;                                 // from the last one to now
  struct Running {
    BundleProblem problem;
    double milliseconds = 0;
  };
  std::future<Running> running_;
  double bundle_milliseconds_ = 0;
};

}  // namespace slam_demo
