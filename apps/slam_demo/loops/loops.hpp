// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "loops/dense_loops.hpp"
#include "loops/image_loop.hpp"
#include "mapping/fragment.hpp"
#include "mapping/keyframe_graph.hpp"
#include "steps.hpp"

namespace slam_demo {

struct LoopOptions {
  bool dense = true;            ///< register fragments
  bool loopsmart = false;       ///< registration and verification of the paper
  bool images = false;          ///< also look for loops by images alone
  bool sessions = true;         ///< connect sessions by images
  bool bundle = true;           ///< full bundle adjustment after loops
  bool calibrate = true;        ///< every full adjustment estimates the calibration of the depth
  bool calibrate_lens = false;  ///< and that of the colour camera
  float voxel_size = 0.05f;     ///< metres, of the registration
  int bundle_iterations = 6;
  bool parallel = true;  ///< beside tracking: what is found when depends on threads
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

/// Closes loops: fragments go to gpureg (dense_loops.hpp); what it accepts moves keyframes, starts
/// the search for image loops, and ends in pose graph and bundle adjustment. The map belongs to the
/// caller's thread: what takes long works on copies, beside it. Not thread-safe.
class LoopClosing {
 public:
  LoopClosing(const gpureg::Context& context, Map& map, const Pinhole& camera,
              const LoopOptions& options);

  /// After every new keyframe: its odometry.
  void record_odometry() { graph_.record(map_); }
  /// The odometry of all keyframes at once.
  void record_all_odometry() { graph_.record(map_, 0); }
  /// After every new keyframe: an adjustment of all, where the depth is still to be calibrated.
  void calibrate_early();
  /// A keyframe that may see an old place: looks for it by its image.
  void search_images(int keyframe);
  /// make_cloud: called by another thread.
  void add_fragment(const BuiltFragment& fragment,
                    const std::function<gpureg::PointCloud()>& make_cloud);
  /// Goes on with the loops; with LoopOptions::parallel for a part of a frame's time only.
  void advance();
  bool busy() const { return !steps_.empty(); }
  /// All that is left.
  void finish() { steps_.finish(); }
  /// The last word: adjusts all keyframes and points, and takes back the loops that do not fit the
  /// result.
  void conclude(int iterations);
  /// Whether keyframes moved since the last call.
  bool take_moved() { return std::exchange(moved_, false); }

  const std::vector<LoopRecord>& records() const { return records_; }
  const std::vector<ImageLoopRecord>& image_records() const { return image_records_; }
  const KeyframeGraph& graph() const { return graph_; }
  /// Fragments that may still get loops.
  std::size_t fragments_kept() const { return dense_.size(); }
  std::vector<std::string> notes;  ///< what did not converge
  struct Milliseconds {
    double registration = 0, image = 0, graph = 0, bundle = 0;
  };
  const Milliseconds& milliseconds() const { return time_; }

 private:
  struct Fragment {
    int keyframe, first_frame, last_frame;
    double time;
    bool kept = true;  ///< may get loops
  };
  static constexpr int kImageLoops = 1 << 20;  // numbers of loops by images alone begin here

  void register_fragments();
  void take_up(const std::vector<gpureg::loop_closure::Loop>& changed);
  void update(const gpureg::loop_closure::Loop& loop);
  void connect_image_loops(int number, const LoopRecord& record);
  void connect_images(int keyframe, const ImageLoop& found);
  void add_observations(int keyframe, const ImageLoop& found, int number);
  std::vector<int> image_candidates(int keyframe) const;
  bool plausible(const RelativePose& loop) const;
  void limit_fragments();
  int number_of(int source, int target);
  std::vector<int> with_neighbours(int keyframe) const;
  bool shares_points(int keyframe, const Fragment& fragment) const;

  void optimize();
  void give_poses_back();
  BundleProblem full_problem();
  void bundle_all(int iterations);
  void adjust_if_moved();
  bool moved_since_bundle() const;
  void retract(int number);

  Map& map_;
  const Pinhole camera_;
  const LoopOptions options_;
  DenseLoops dense_;
  KeyframeGraph graph_;
  std::vector<Fragment> fragments_;
  std::size_t registered_ = 0;       // of these: the first ones, dense_ has them
  std::vector<LoopRecord> records_;  // by number of the loop
  std::vector<ImageLoopRecord> image_records_;
  std::optional<DepthCalibration> prior_;    // before the first full adjustment
  std::vector<Eigen::Isometry3d> adjusted_;  // poses after the last full adjustment
  std::size_t next_calibration_ = 20;        // keyframes: then enough see each part of the image
  bool moved_ = false, connected_ = false, searching_ = false;
  Milliseconds time_;
  Steps steps_;  // last: its threads end before what they use
};

}  // namespace slam_demo
