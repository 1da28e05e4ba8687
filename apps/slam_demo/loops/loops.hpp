// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/loop_closure.hpp>
#include <string>
#include <vector>

#include "loops/image_loop.hpp"
#include "mapping/fragment.hpp"
#include "mapping/keyframe_graph.hpp"

namespace slam_demo {

struct LoopOptions {
  bool dense = true;         ///< register fragments
  bool images = false;       ///< also look for loops by images alone
  bool sessions = true;      ///< connect sessions by images
  bool bundle = true;        ///< full bundle adjustment after loops
  bool calibrate = true;     ///< every full adjustment estimates the calibration of the depth
  float voxel_size = 0.05f;  ///< metres, of the registration
  int bundle_iterations = 6;
  int threads = 0;
  std::size_t max_fragments =
      100;                 ///< kept for loops, >= 2; beyond, one of a place seen twice goes
  std::uint64_t seed = 1;  ///< of the registration
};

/// What became of a pair of fragments, for the report.
struct LoopRecord {
  int source = 0, target = 0;  ///< fragments
  int source_keyframe = 0, target_keyframe = 0;
  double source_time = 0, target_time = 0;  ///< seconds
  std::string state, reason;
  double confidence = 0, drift_ratio = 0;
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< of the keyframes
  int image_loops = 0;  ///< keyframes that image loops connected as a consequence
};

/// A loop that was found by an image alone.
struct ImageLoopRecord {
  int keyframe = 0, target = 0, inliers = 0;
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< of the keyframes
  bool retracted = false;
};

/// Closes loops: fragments go to gpureg's LoopCloser; what it accepts moves keyframes, starts the
/// search for image loops, and ends in pose graph and bundle adjustment. Not thread-safe.
class LoopClosing {
 public:
  LoopClosing(const gpureg::Context& context, Map& map, const Pinhole& camera,
              const LoopOptions& options);

  /// After every new keyframe: its odometry.
  void record_odometry() { graph_.record(map_); }
  /// The odometry of all keyframes at once.
  void record_all_odometry() { graph_.record(map_, 0); }
  /// Looks for loops of a keyframe by its image. Returns whether keyframes moved.
  bool search_images(int keyframe);
  void add_fragment(const BuiltFragment& fragment);
  /// Registers what is due. Returns whether keyframes moved.
  bool process();
  /// The last word: adjusts all keyframes and points, and takes back the loops that do not fit the
  /// result. Returns whether keyframes moved.
  bool conclude(int iterations);

  const std::vector<LoopRecord>& records() const { return records_; }
  const std::vector<ImageLoopRecord>& image_records() const { return image_records_; }
  const KeyframeGraph& graph() const { return graph_; }
  /// Fragments that may still get loops.
  std::size_t fragments_kept() const { return closer_.size(); }
  std::vector<std::string> notes;  ///< what did not converge
  struct Milliseconds {
    double prepare = 0, registration = 0, image = 0, graph = 0, bundle = 0;
  };
  const Milliseconds& milliseconds() const { return time_; }

 private:
  struct Fragment {
    int keyframe, first_frame, last_frame;
    double time;
    bool kept = true;  ///< closer_ has it
  };
  void connect_image_loops(int number, const gpureg::loop_closure::Loop& loop, LoopRecord& record);
  std::vector<int> image_candidates(int keyframe) const;
  bool plausible(const RelativePose& loop) const;
  void limit_fragments();
  void optimize();
  void bundle_all(int iterations);
  void retract(int number);
  void adjust_if_moved();
  bool moved_since_bundle() const;
  int number_of(int source, int target);
  std::vector<int> with_neighbours(int keyframe) const;
  bool shares_points(int keyframe, const Fragment& fragment) const;

  const gpureg::Context context_;
  Map& map_;
  const Pinhole camera_;
  const LoopOptions options_;
  gpureg::loop_closure::Options closer_options_;
  gpureg::loop_closure::LoopCloser closer_;
  KeyframeGraph graph_;
  std::vector<Fragment> fragments_;
  std::vector<LoopRecord> records_;  // by number of the loop
  std::vector<ImageLoopRecord> image_records_;
  int image_loops_ = 0;
  std::optional<DepthCalibration> prior_;    // before the first full adjustment
  std::vector<Eigen::Isometry3d> adjusted_;  // poses after the last full adjustment
  Milliseconds time_;
};

}  // namespace slam_demo
