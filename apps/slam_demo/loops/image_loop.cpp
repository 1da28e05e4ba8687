// SPDX-License-Identifier: BSD-3-Clause
#include "loops/image_loop.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "mapping/keyframe_graph.hpp"

namespace slam_demo {
namespace {

constexpr int kMinInliers = 25;
// A registered fragment is good to some centimetres; a pose beyond is another match.
constexpr double kMaxShift = 0.25, kMaxTurn = 0.1;  // metres, radians
// Noise of a pose from PnP with some dozen points and depth.
constexpr double kMetres = 0.01, kRadians = 0.004;

ImageLoop loop_of(const Map& map, int keyframe, int target, const View& view) {
  ImageLoop loop;
  loop.inliers = view.inliers;
  std::map<int, int> votes;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    if (view.points[k] == kNone) continue;
    loop.matches.emplace_back(static_cast<int>(k), view.points[k]);
    // The pose of a keyframe that sees the point by another loop need not agree with the point.
    for (const Observation& o : map.points[at(view.points[k])].observations) {
      if (o.loop == kNone) ++votes[o.keyframe];
    }
  }
  votes.erase(keyframe);
  for (const auto& [other, count] : votes) {
    if (map.keyframes[at(other)].session == map.keyframes[at(target)].session &&
        (count > votes[target] || (count == votes[target] && other < target)))
      target = other;
  }
  loop.edge = {target, keyframe, map.keyframes[at(target)].world_from_camera.inverse() * view.pose,
               information_of(kRadians, kMetres)};
  return loop;
}

}  // namespace

std::optional<ImageLoop> image_loop_near(const Map& map, const Pinhole& camera, int keyframe,
                                         const Eigen::Isometry3d& predicted,
                                         const std::vector<int>& targets) {
  std::set<int> points;
  for (const int target : targets) {
    for (const int p : map.keyframes[at(target)].points) {
      if (p != kNone && map.find(p, keyframe) == nullptr) points.insert(p);
    }
  }
  View view;
  view.features = map.keyframes[at(keyframe)].features;
  view.pose = predicted;
  for (const double radius : {40.0, 8.0}) {
    view.points.assign(view.features->size(), kNone);
    match_by_projection(map, camera, {points.begin(), points.end()}, radius, kMaxDistance, 0.8,
                        view);
    if (radius > 10 && !solve_pnp(map, camera, view)) return std::nullopt;
    if (refine(map, camera, view) < kMinInliers / 2) return std::nullopt;
  }
  const Eigen::Isometry3d change = predicted.inverse() * view.pose;
  if (view.inliers < kMinInliers || change.translation().norm() > kMaxShift ||
      Eigen::AngleAxisd(change.linear()).angle() > kMaxTurn)
    return std::nullopt;
  return loop_of(map, keyframe, targets.front(), view);
}

std::optional<ImageLoop> image_loop_anywhere(const Map& map, const Pinhole& camera, int keyframe,
                                             const std::vector<int>& candidates, int min_inliers) {
  std::optional<ImageLoop> best;
  View view;
  view.features = map.keyframes[at(keyframe)].features;
  for (const int candidate : candidates) {
    match_by_descriptor(map, map.keyframes[at(candidate)], view);
    if (!solve_pnp(map, camera, view) || refine(map, camera, view) < min_inliers) continue;
    if (!best || view.inliers > best->inliers) best = loop_of(map, keyframe, candidate, view);
  }
  return best;
}

}  // namespace slam_demo
