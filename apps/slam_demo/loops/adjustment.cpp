// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "loops/loops.hpp"
#include "stopwatch.hpp"

/// What loops do to the map: pose graph, full adjustment, retraction.
namespace slam_demo {
namespace {

namespace lc = gpureg::loop_closure;

// Metres that a loop must move a keyframe for a full adjustment; the last one is made anyway.
constexpr double kWorthBundle = 0.02;
// What a registered loop may differ from the adjusted poses of its keyframes: beyond, something is
// wrong with the fragments, and the pose that all else agrees on is the better one.
constexpr double kMisfitMetres = 0.1, kMisfitRadians = 0.05;

// With fewer keyframes the motion need not show the lens: a walk of ten seconds has twice as many.
constexpr std::size_t kLensKeyframes = 40;

}  // namespace

void LoopClosing::optimize() {
  steps_.beside(
      time_.graph, [graph = graph_.problem(map_)] { return KeyframeGraph::solve(graph); },
      [this](const gpureg::pose_graph::Result& result) {
        moved_ = true;
        if (!result.reason.empty()) notes.push_back("pose graph: " + result.reason);
        KeyframeGraph::apply(result, map_);
        give_poses_back();
      });
}

void LoopClosing::give_poses_back() {
  std::vector<lc::FragmentPose> poses;
  for (std::size_t k = 0; k < registered_; ++k) {
    if (!fragments_[k].kept) continue;
    lc::FragmentPose pose;
    pose.id = static_cast<lc::FragmentId>(k);
    pose.world_from_fragment =
        unaligned(map_.keyframes[at(fragments_[k].keyframe)].world_from_camera);
    poses.push_back(pose);
  }
  dense_.set_poses(poses);
}

void LoopClosing::adjust_if_moved() {
  if (options_.bundle && moved_since_bundle()) bundle_all(options_.bundle_iterations);
}

bool LoopClosing::moved_since_bundle() const {
  for (std::size_t k = 0; k < adjusted_.size(); ++k) {
    if ((map_.keyframes[k].world_from_camera.translation() - adjusted_[k].translation()).norm() >
        kWorthBundle)
      return true;
  }
  return adjusted_.empty();
}

/// Tracking and fragments need the calibration before the first loop. The more keyframes, the less
/// a new one changes: they double.
void LoopClosing::calibrate_early() {
  if (!options_.bundle || !options_.calibrate || map_.keyframes.size() < next_calibration_) return;
  next_calibration_ *= 2;
  steps_.then([this] { bundle_all(options_.bundle_iterations); });
  steps_.then([this] {
    // What tracking measured before had the wrong depths. With loops the map knows more than that.
    if (graph_.loops().empty()) record_all_odometry();
  });
}

BundleProblem LoopClosing::full_problem() {
  std::vector<int> free, fixed;
  const std::vector<int> world = graph_.world_of_session(map_);
  std::vector<bool> anchored(world.size(), false);
  for (std::size_t k = 0; k < map_.keyframes.size(); ++k) {
    const std::size_t w = at(world[at(map_.keyframes[k].session)]);
    (anchored[w] ? free : fixed).push_back(static_cast<int>(k));
    anchored[w] = true;
  }
  std::vector<RelativePose> relatives = graph_.loop_edges();
  for (const RelativePose& edge : graph_.weak_odometry(map_)) relatives.push_back(edge);
  BundleProblem problem = bundle_of(map_, free, fixed, relatives);
  if (!prior_) prior_ = map_.calibration;
  problem.calibrate = options_.calibrate;
  problem.calibrate_lens =
      options_.calibrate && options_.calibrate_lens && map_.keyframes.size() >= kLensKeyframes;
  problem.prior = *prior_;
  return problem;
}

void LoopClosing::bundle_all(int iterations) {
  if (map_.keyframes.size() < 2) return;
  steps_.beside(
      time_.bundle,
      [problem = full_problem(), camera = camera_, iterations,
       threads = options_.parallel ? 2 : 1]() mutable {
        adjust(camera, problem, iterations, threads);
        return std::move(problem);
      },
      [this](const BundleProblem& problem) {
        moved_ = true;
        apply_full(camera_, problem, map_);
        adjusted_.clear();
        for (const Keyframe& keyframe : map_.keyframes)
          adjusted_.push_back(keyframe.world_from_camera);
      });
}

void LoopClosing::retract(int number) {
  map_.remove_loop(number);
  graph_.remove(number);
  if (number >= kImageLoops) {
    image_records_[at(number - kImageLoops)].retracted = true;
    return;
  }
  LoopRecord& record = records_[at(number)];
  record.state = lc::to_string(lc::LoopState::retracted);
  record.reason = "misfit";
  record.image_loops = 0;
}

void LoopClosing::conclude(int iterations) {
  const auto adjust_all = [&] {
    if (options_.bundle) bundle_all(iterations);
    steps_.finish();
  };
  const auto misfits = [&] { return graph_.misfits(map_, kMisfitMetres, kMisfitRadians); };
  adjust_all();
  for (std::vector<int> all = misfits(); !all.empty(); all = misfits()) {
    // One at a time: a wrong loop bends the map, and then correct ones do not fit either.
    for (; !all.empty(); all = misfits()) {
      retract(all.front());
      optimize();
      steps_.finish();
    }
    adjust_all();
  }
}

}  // namespace slam_demo
