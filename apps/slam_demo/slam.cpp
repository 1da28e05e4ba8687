// SPDX-License-Identifier: BSD-3-Clause
#include "slam.hpp"

#include <algorithm>
#include <cmath>
#include <gpureg/error.hpp>
#include <set>

#include "stopwatch.hpp"

namespace slam_demo {
namespace {

constexpr std::size_t kMinFragment = 20;  // frames of a fragment that a session ends with
constexpr double kSameTime = 0.001;       // seconds: a tenth of a degree at 100 degrees/s
constexpr float kFragmentVoxel = 0.4f;    // of the voxel size of the registration

surfel::Camera surfel_camera(const Pinhole& camera) {
  return {static_cast<float>(camera.fx), static_cast<float>(camera.fy),
          static_cast<float>(camera.cx), static_cast<float>(camera.cy)};
}

surfel::Pose surfel_pose(const Eigen::Isometry3d& pose) {
  surfel::Pose result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      result.r[3 * row + column] = static_cast<float>(pose.linear()(row, column));
    result.t[row] = static_cast<float>(pose.translation()[row]);
  }
  return result;
}

}  // namespace

Slam::Slam(const gpureg::Context& context, const Rig& rig, const SlamOptions& options)
    : rig_(rig),
      options_(options),
      extractor_(options.features),
      tracker_(map_, rig.colour, options.tracker),
      loops_(context, map_, rig.colour, options.loops),
      fragment_(rig.colour, options.fragment_frames, kFragmentVoxel * options.loops.voxel_size),
      surfels_(context.backend() == gpureg::Backend::cuda && surfel::cuda_available()
                   ? surfel::make_cuda_map(options.surfels)
                   : surfel::make_cpu_map(options.surfels)),
      surfel_work_(options.loops.parallel) {
  if (options.calibration) map_.calibration = *options.calibration;
}

void Slam::set_image_size(const cv::Size& size) {
  DepthCalibration& c = map_.calibration;
  if (size.empty() || (c.width == size.width && c.height == size.height)) return;
  if (options_.calibration)
    throw gpureg::InvalidArgument("the depth calibration is of another size than the images");
  c.width = size.width;
  c.height = size.height;
}

Tracker::Outcome Slam::frame(int index, double time, const Images& images) {
  const Tracker::Outcome outcome = track(index, time, images);
  waits_.push_back(std::exchange(waited_ms_, 0));
  return outcome;
}

Tracker::Outcome Slam::track(int index, double time, const Images& images) {
  set_image_size(images.depth.size());
  Features features;
  Images corrected = images;
  {
    const Stopwatch watch(extract_ms_);
    const Lens& lens = map_.calibration.lens;
    if (lens != lens_)
      rectification_ = Rectification(rig_.colour, lens_ = lens, images.grey.size());
    corrected.grey = rectification_(images.grey, cv::INTER_LINEAR);
    corrected.colour = rectification_(images.colour, cv::INTER_LINEAR);
    // A depth image that is not registered is projected into the pinhole already.
    if (rig_.registered) corrected.depth = rectification_(images.depth, cv::INTER_NEAREST);
    if (std::abs(images.depth_delay) > kSameTime && !images.depth.empty())
      corrected.depth = seen_from(rig_.colour, tracker_.motion_within(images.depth_delay),
                                  rig_.colour, corrected.depth);
    features = extractor_(images.grey, corrected.depth, [&](const cv::Point2f& at) {
      const Eigen::Vector2d pixel = in_pinhole(rig_.colour, lens, {at.x, at.y});
      return cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    });
    corrected.depth = map_.calibration.corrected(corrected.depth);
  }
  Tracker::Outcome outcome;
  {
    const Stopwatch watch(track_ms_);
    outcome = tracker_.track(index, time, std::move(features), corrected.grey, corrected.depth);
  }
  if (outcome.pose.session == kNone) {
    ++lost_;
    return outcome;
  }
  dense_ += outcome.dense;
  if (outcome.pose.session != session_) {
    end_fragment();
    session_start_ = index;
  }
  session_ = outcome.pose.session;
  frames_.push_back(outcome.pose);
  if (outcome.new_keyframe != kNone) {
    tracker_.settle();
    loops_.record_odometry();
    loops_.search_images(outcome.new_keyframe);
    loops_.calibrate_early();
  }
  go_on();
  {
    const Stopwatch watch(fragment_ms_);
    fragment_.add(index, outcome.pose, corrected.depth);
  }
  if (options_.map && index % options_.surfel_every == 0) fuse(index, outcome.pose, corrected);
  if (fragment_.full()) end_fragment();
  return outcome;
}

void Slam::fuse(int index, const FramePose& pose, const Images& images) {
  surfel_work_.post([this, index, images, camera = surfel_camera(rig_.colour),
                     world_from_surfels = surfel_pose(world_from_camera(map_, pose)),
                     since = session_start_] {
    const Stopwatch watch(fuse_ms_);
    surfels_->fuse({images.depth.cols, images.depth.rows, images.depth.ptr<float>(),
                    images.colour.ptr<std::uint8_t>()},
                   camera, world_from_surfels, index, since);
    if (surfels_->size() > options_.max_surfels)
      surfels_->upload(surfel::thinned(surfels_->download(), options_.max_surfels / 2));
  });
}

/// The loops' share of a frame.
void Slam::go_on() {
  if (loops_.busy()) with_correction([&] { loops_.advance(); });
}

/// Runs what may move keyframes; the surfels follow.
void Slam::with_correction(const std::function<void()>& work) {
  const Stopwatch waiting(waited_ms_);
  std::vector<Eigen::Isometry3d> before;
  for (const Keyframe& keyframe : map_.keyframes) before.push_back(keyframe.world_from_camera);
  work();
  if (!loops_.take_moved() || !options_.map) return;
  std::vector<surfel::Correction> corrections;
  for (std::size_t k = 0; k < before.size(); ++k) {
    const Keyframe& keyframe = map_.keyframes[k];
    corrections.push_back({keyframe.frame,
                           surfel_pose(keyframe.world_from_camera * before[k].inverse()),
                           keyframe.session});
  }
  surfel_work_.post([this, corrections = std::move(corrections)] {
    const Stopwatch watch(correct_ms_);
    surfels_->correct(corrections);
  });
}

void Slam::end_fragment() {
  if (fragment_.size() < kMinFragment) {
    fragment_.clear();
    return;
  }
  {
    const Stopwatch waiting(waited_ms_);
    tracker_.settle();
    ++fragments_;
    const auto scans = std::make_shared<const FragmentScans>(fragment_.take(map_));
    loops_.add_fragment(scans->fragment, [scans] { return fused(*scans); });
    if (options_.keep_fragments) {
      kept_.push_back(scans->fragment);
      kept_.back().cloud = fused(*scans);
    }
  }
  go_on();
}

Tracking Slam::tracking() const { return {map_, frames_, kept_, all(), lost_, dense_}; }

void Slam::replay(const Tracking& tracking, const std::function<bool()>& stop) {
  map_ = tracking.map;
  frames_ = tracking.frames;
  lost_ = tracking.lost;
  dense_ = tracking.dense;
  surfels_->upload(tracking.surfels);
  loops_.record_all_odometry();
  std::size_t next = 0;
  for (const BuiltFragment& fragment : tracking.fragments) {
    if (stop && stop()) return;
    for (; next < map_.keyframes.size() && map_.keyframes[next].frame <= fragment.last_frame;
         ++next)
      with_correction([&] {
        loops_.search_images(static_cast<int>(next));
        loops_.finish();
      });
    ++fragments_;
    with_correction([&] {
      loops_.add_fragment(fragment, [&] { return fragment.cloud; });
      loops_.finish();
    });
  }
}

void Slam::finish() {
  end_fragment();
  tracker_.settle();
  with_correction([&] { loops_.finish(); });
  with_correction([&] { loops_.conclude(options_.final_iterations); });
}

surfel::Cloud Slam::all() const {
  surfel_work_.drain();
  return surfels_->download();
}

surfel::Cloud Slam::surfels() const {
  surfel::Cloud result;
  const std::vector<int> world = loops_.graph().world_of_session(map_);
  const int largest = largest_world();
  for (const surfel::Surfel& s : all()) {
    if (s.confidence < options_.surfels.min_confidence) continue;
    // The session of a surfel is that of the frame that made it.
    const auto after = std::upper_bound(
        map_.keyframes.begin(), map_.keyframes.end(), s.first,
        [](int frame, const Keyframe& keyframe) { return frame < keyframe.frame; });
    if (after != map_.keyframes.begin() && world[at(std::prev(after)->session)] == largest)
      result.push_back(s);
  }
  return result;
}

std::size_t Slam::worlds() const {
  const std::vector<int> world = loops_.graph().world_of_session(map_);
  return std::set<int>(world.begin(), world.end()).size();
}

int Slam::largest_world() const {
  const std::vector<int> world = loops_.graph().world_of_session(map_);
  std::map<int, int> frames;
  for (const FramePose& frame : frames_) ++frames[world[at(frame.session)]];
  int best = 0;
  for (const auto& [w, count] : frames) {
    if (count > frames[best]) best = w;
  }
  return best;
}

Trajectory Slam::poses_of(const std::function<Eigen::Isometry3d(int)>& world_from_keyframe) const {
  const std::vector<int> world = loops_.graph().world_of_session(map_);
  const int largest = largest_world();
  Trajectory result;
  for (const FramePose& frame : frames_) {
    if (world[at(frame.session)] != largest) continue;
    Eigen::Isometry3d pose = world_from_keyframe(frame.reference) * frame.reference_from_camera;
    if (rig_.truth_of_depth) pose = pose * rig_.colour_from_depth;
    result.push_back({frame.time, pose.matrix()});
  }
  return result;
}

Trajectory Slam::trajectory() const {
  return poses_of([&](int k) { return map_.keyframes[at(k)].world_from_camera; });
}

Trajectory Slam::odometry() const {
  const std::vector<Eigen::Isometry3d> poses = loops_.graph().odometry_poses(map_);
  return poses_of([&](int k) { return poses[at(k)]; });
}

std::map<std::string, double> Slam::milliseconds() const {
  surfel_work_.drain();
  const LoopClosing::Milliseconds& l = loops_.milliseconds();
  return {{"features", extract_ms_},
          {"tracking", track_ms_},
          {"local bundle adjustment", tracker_.bundle_milliseconds()},
          {"points of fragments", fragment_ms_},
          {"fragments, registration and verification", l.registration},
          {"image loops", l.image},
          {"pose graph", l.graph},
          {"full bundle adjustment", l.bundle},
          {"surfel fusion", fuse_ms_},
          {"surfel correction", correct_ms_}};
}

}  // namespace slam_demo
