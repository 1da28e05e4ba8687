// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "background.hpp"
#include "loops/loops.hpp"
#include "sequence.hpp"
#include "surfel/surfel_map.hpp"

namespace slam_demo {

struct SlamOptions {
  TrackerOptions tracker;
  LoopOptions loops;
  surfel::Options surfels;
  bool map = true;                    ///< fuse surfels
  bool keep_fragments = false;        ///< for tracking()
  int surfel_every = 2;               ///< frames between two that are fused
  std::size_t max_surfels = 5000000;  ///< >= 2; beyond, the map is thinned to half of them
  int features = 1000;
  int fragment_frames = 50;
  int final_iterations = 20;                                   ///< of the last bundle adjustment
  std::optional<DepthCalibration> calibration = std::nullopt;  ///< of the depth; none: all 0
};

/// What tracking found, before any loop.
struct Tracking {
  Map map;
  std::vector<FramePose> frames;
  std::vector<BuiltFragment> fragments;
  surfel::Cloud surfels;
  int lost = 0, dense = 0;
};

/// The whole system: frames in, trajectory and map out. Not thread-safe.
class Slam {
 public:
  Slam(const gpureg::Context& context, const Rig& rig, const SlamOptions& options);

  Tracker::Outcome frame(int index, double time, const Images& images);
  /// After the last frame: the last fragment, its loops, the last bundle adjustment.
  void finish();

  /// What was tracked so far; fragments only where the options keep them.
  Tracking tracking() const;
  /// Instead of the frames: closes the loops of what another run tracked without loops, until stop
  /// says so.
  void replay(const Tracking& tracking, const std::function<bool()>& stop = nullptr);

  /// Poses of the tracked frames in the largest world, of the camera that the truth speaks of.
  Trajectory trajectory() const;
  /// The same by tracking alone: without any loop.
  Trajectory odometry() const;

  const Map& map() const { return map_; }
  const LoopClosing& loops() const { return loops_; }
  /// The confirmed surfels of the largest world.
  surfel::Cloud surfels() const;
  std::size_t all_surfels() const { return all().size(); }
  const std::vector<FramePose>& frames() const { return frames_; }
  int lost() const { return lost_; }
  int dense() const { return dense_; }
  int fragments() const { return fragments_; }
  /// Milliseconds of each part, all frames together.
  std::map<std::string, double> milliseconds() const;
  /// Of each frame: how long it waited for loops, milliseconds.
  const std::vector<double>& waits() const { return waits_; }
  std::size_t worlds() const;  ///< parts of the trajectory that nothing connects

 private:
  Tracker::Outcome track(int index, double time, const Images& images);
  void set_image_size(const cv::Size& size);
  void end_fragment();
  void go_on();
  void fuse(int frame, const FramePose& pose, const Images& images);
  void with_correction(const std::function<void()>& work);
  Trajectory poses_of(const std::function<Eigen::Isometry3d(int)>& world_from_keyframe) const;
  int largest_world() const;
  surfel::Cloud all() const;

  const Rig rig_;
  const SlamOptions options_;
  Map map_;
  Extractor extractor_;
  Lens lens_{};  // of rectification_
  Rectification rectification_{rig_.colour, lens_, {}};
  Tracker tracker_;
  LoopClosing loops_;
  FragmentBuilder fragment_;
  std::unique_ptr<surfel::SurfelMap> surfels_;
  std::vector<FramePose> frames_;
  std::vector<BuiltFragment> kept_;
  int lost_ = 0, dense_ = 0, fragments_ = 0, session_ = kNone, session_start_ = 0;
  std::vector<double> waits_;
  double waited_ms_ = 0, extract_ms_ = 0, track_ms_ = 0, fragment_ms_ = 0, fuse_ms_ = 0,
         correct_ms_ = 0;
  mutable Background surfel_work_;  // surfels_, fuse_ms_ and correct_ms_ are its own
};

}  // namespace slam_demo
