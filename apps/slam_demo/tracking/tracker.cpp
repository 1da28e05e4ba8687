// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/tracker.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

namespace slam_demo {
namespace {

constexpr int kMinStart = 150;                      // features with depth that start a session
constexpr int kFewInliers = 150, kManyFresh = 100;  // a new keyframe makes the track stronger
constexpr int kWellLinked = 60;  // shared points that hold two keyframes together
// Noise of the pose of a keyframe with few points, relative to its reference.
constexpr double kLinkMetres = 0.01, kLinkRadians = 0.005;
// What the motion may differ from that of the last frame, for each frame in between.
constexpr double kFrameRate = 30, kSurpriseMetres = 0.03, kSurpriseRadians = 0.08;
constexpr double kFastMetres = 0.06;  // a frame: 1.8 m/s, faster than anybody walks with a camera
constexpr int kMinRelocalised = 40;   // inliers that prove a place without a prediction

}  // namespace

Eigen::Isometry3d world_from_camera(const Map& map, const FramePose& pose) {
  return map.keyframes[at(pose.reference)].world_from_camera * pose.reference_from_camera;
}

Tracker::Tracker(Map& map, const Pinhole& camera, const TrackerOptions& options)
    : map_(map), camera_(camera), options_(options), dense_(camera) {}

Tracker::~Tracker() {
  if (running_.valid()) running_.wait();
}

/// By the motion of the last frames, then, in a wider radius, by the last pose.
bool Tracker::track_last(View& view) const {
  const Eigen::Isometry3d last = world_from_camera(map_, last_);
  for (const double radius : {12.0, 30.0}) {
    view.pose = radius < 20 ? last * velocity_ : last;
    view.points.assign(view.features->size(), kNone);
    match_by_projection(map_, camera_, last_points_, radius, kMaxDistance, 0.9, view);
    if (solve_pnp(map_, camera_, view) && refine(map_, camera_, view) >= options_.min_inliers / 2)
      return true;
  }
  return false;
}

/// Without a prediction: the features of the newest keyframes against all of this frame.
bool Tracker::relocalise(View& view) const {
  std::vector<int> candidates = map_.covisible(last_keyframe_, 6);
  candidates.insert(candidates.begin(), last_keyframe_);
  for (const int k : candidates) {
    match_by_descriptor(map_, map_.keyframes[at(k)], view);
    if (solve_pnp(map_, camera_, view) && refine(map_, camera_, view) >= options_.min_inliers)
      return true;
  }
  return false;
}

bool Tracker::track_local_map(View& view) {
  std::map<int, int> votes;
  for (const int p : view.points) {
    if (p == kNone) continue;
    for (const Observation& o : map_.points[at(p)].observations) ++votes[o.keyframe];
  }
  std::vector<int> order = by_count(votes);
  if (order.empty()) return false;
  reference_ = order.front();
  order.resize(std::min(order.size(), options_.local_keyframes));
  std::set<int> local(order.begin(), order.end());
  for (const int k : map_.covisible(reference_, 5)) local.insert(k);
  std::set<int> points;
  for (const int k : local) {
    for (const int p : map_.keyframes[at(k)].points) {
      if (p != kNone) points.insert(p);
    }
  }
  match_by_projection(map_, camera_, {points.begin(), points.end()}, 5, kMaxDistance + 16, 0.85,
                      view);
  return refine(map_, camera_, view) >= options_.min_inliers;
}

bool Tracker::needs_keyframe(const View& view) const {
  int fresh = 0;  // features that would become points
  for (std::size_t k = 0; k < view.points.size(); ++k)
    fresh += view.points[k] == kNone && view.features->depth[k] > 0;
  const bool weak = view.inliers < options_.keyframe_ratio * reference_inliers_ ||
                    (view.inliers < kFewInliers && fresh > kManyFresh);
  return since_keyframe_ >= options_.max_frames || (weak && since_keyframe_ >= 3) ||
         view.inliers < 2 * options_.min_inliers;
}

int Tracker::make_keyframe(const View& view, int frame, double time, int session, bool linked) {
  Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.time = time;
  keyframe.session = session;
  keyframe.world_from_camera = view.pose;
  keyframe.features = view.features;
  const int index = map_.add_keyframe(std::move(keyframe));
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    if (view.points[k] != kNone && !map_.points[at(view.points[k])].bad)
      map_.add_observation(view.points[k], {index, static_cast<int>(k)});
  }
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    const Features& f = *view.features;
    if (map_.keyframes[at(index)].points[k] != kNone || f.depth[k] <= 0) continue;
    const Measurement m = measurement(f, static_cast<int>(k), map_.calibration);
    map_.add_point(index, static_cast<int>(k), view.pose * camera_.unproject(m.u, m.v, m.depth));
  }
  if (linked && view.inliers < kWellLinked) {
    map_.links.push_back({reference_, index,
                          map_.keyframes[at(reference_)].world_from_camera.inverse() * view.pose,
                          information_of(kLinkRadians, kLinkMetres)});
  }
  map_.cull(index);
  last_keyframe_ = reference_ = index;
  since_keyframe_ = 0;
  return index;
}

void Tracker::start_bundle(int keyframe) {
  finish_bundle(true);
  if (map_.keyframes[at(keyframe)].covisible.empty()) return;
  const auto work = [camera = camera_, iterations = options_.bundle_iterations,
                     problem = local_bundle(map_, keyframe, options_.bundle_keyframes)]() mutable {
    const auto start = std::chrono::steady_clock::now();
    adjust(camera, problem, iterations, 1);
    return Running{std::move(problem), std::chrono::duration<double, std::milli>(
                                           std::chrono::steady_clock::now() - start)
                                           .count()};
  };
  running_ = std::async(options_.sequential ? std::launch::deferred : std::launch::async, work);
  if (options_.sequential) finish_bundle(true);
}

void Tracker::finish_bundle(bool wait) {
  if (!running_.valid()) return;
  if (!wait && running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const Running done = running_.get();
  bundle_milliseconds_ += done.milliseconds;
  const int newest =
      *std::max_element(done.problem.keyframes.begin(), done.problem.keyframes.end());
  const Eigen::Isometry3d old_from_world = map_.keyframes[at(newest)].world_from_camera.inverse();
  apply(camera_, done.problem, map_);
  // Keyframes that were made meanwhile follow the newest of those that were adjusted.
  const Eigen::Isometry3d correction =
      map_.keyframes[at(newest)].world_from_camera * old_from_world;
  for (std::size_t k = at(newest) + 1; k < map_.keyframes.size(); ++k) {
    if (map_.keyframes[k].session == map_.keyframes[at(newest)].session)
      map_.keyframes[k].world_from_camera = correction * map_.keyframes[k].world_from_camera;
  }
}

Eigen::Isometry3d Tracker::motion_within(double seconds) const {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (lost_ || velocity_seconds_ <= 0) return motion;
  const double share = seconds / velocity_seconds_;
  const Eigen::AngleAxisd turn(velocity_.linear());
  motion.linear() = Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix();
  motion.translation() = share * velocity_.translation();
  return motion;
}

void Tracker::settle() { finish_bundle(true); }

/// Repeated texture can match with a shift: a pose that no motion from the last one explains is
/// none. last_from_now: the motion to expect.
bool Tracker::plausible(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& last_from_now,
                        double metres, double radians) const {
  const Eigen::Isometry3d surprise =
      (world_from_camera(map_, last_) * last_from_now).inverse() * pose;
  return surprise.translation().norm() <= metres &&
         Eigen::AngleAxisd(surprise.linear()).angle() <= radians;
}

/// All pixels and depths, where the features do not suffice.
bool Tracker::track_dense(View& view, const cv::Mat1b& grey, const cv::Mat1f& depth) {
  const auto motion = dense_.motion(last_grey_, last_depth_, grey, depth, velocity_);
  if (!motion) return false;
  view.points.assign(view.features->size(), kNone);
  const Eigen::Isometry3d pose = world_from_camera(map_, last_) * *motion;
  view.pose = pose;
  reference_ = last_.reference;
  match_by_projection(map_, camera_, last_points_, 8, kMaxDistance, 0.9, view);
  if (refine(map_, camera_, view) < options_.min_inliers) view.pose = pose;
  return true;
}

Tracker::Outcome Tracker::track(int frame, double time, Features features, const cv::Mat1b& grey,
                                const cv::Mat1f& depth) {
  finish_bundle(false);
  View view;
  view.features = std::make_shared<const Features>(std::move(features));
  view.points.assign(view.features->size(), kNone);
  Outcome outcome;
  outcome.pose.time = time;
  ++since_keyframe_;
  bool found = false;
  if (last_.session != kNone) {
    const double frames = std::max(1.0, kFrameRate * (time - last_.time));
    found = !lost_ && track_last(view) && track_local_map(view) &&
            plausible(view.pose, velocity_, frames * kSurpriseMetres, frames * kSurpriseRadians);
    if (!found && !lost_) found = outcome.dense = track_dense(view, grey, depth);
    if (!found && view.features->size() >= at(options_.min_inliers))
      found = relocalise(view) && track_local_map(view) && view.inliers >= kMinRelocalised &&
              plausible(view.pose, Eigen::Isometry3d::Identity(), frames * kFastMetres, M_PI);
  }
  int session = last_.session;
  if (!found) {
    lost_ = true;
    const auto with_depth = std::count_if(view.features->depth.begin(), view.features->depth.end(),
                                          [](float z) { return z > 0; });
    if (with_depth < kMinStart) return outcome;
    finish_bundle(true);
    view.pose = Eigen::Isometry3d::Identity();
    view.points.assign(view.features->size(), kNone);
    session = sessions_++;
    outcome.new_session = true;
  }
  velocity_ = found && !lost_ ? world_from_camera(map_, last_).inverse() * view.pose
                              : Eigen::Isometry3d::Identity();
  velocity_seconds_ = found && !lost_ ? time - last_.time : 0;
  lost_ = false;
  if (since_keyframe_ == 1) reference_inliers_ = view.inliers;
  if (outcome.new_session || needs_keyframe(view)) {
    // The adjustment may move the keyframes under the pose.
    const Eigen::Isometry3d before =
        found ? map_.keyframes[at(reference_)].world_from_camera : Eigen::Isometry3d::Identity();
    finish_bundle(true);
    if (found)
      view.pose = map_.keyframes[at(reference_)].world_from_camera * before.inverse() * view.pose;
    if (found && !outcome.dense) refine(map_, camera_, view);
    outcome.new_keyframe = make_keyframe(view, frame, time, session, found);
  }
  outcome.inliers = view.inliers;
  outcome.pose.session = session;
  outcome.pose.reference = reference_;
  outcome.pose.reference_from_camera =
      map_.keyframes[at(reference_)].world_from_camera.inverse() * view.pose;
  last_ = outcome.pose;
  last_grey_ = grey;
  last_depth_ = depth;
  last_points_.clear();
  const std::vector<int>& seen =
      outcome.new_keyframe != kNone ? map_.keyframes[at(outcome.new_keyframe)].points : view.points;
  for (const int p : seen) {
    if (p != kNone) last_points_.push_back(p);
  }
  if (outcome.new_keyframe != kNone) start_bundle(outcome.new_keyframe);
  return outcome;
}

}  // namespace slam_demo
