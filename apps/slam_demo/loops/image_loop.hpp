// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "tracking/matching.hpp"

/// Loops by features, where something else says where to look.
namespace slam_demo {

/// A keyframe that sees points of another part of the map.
struct ImageLoop {
  RelativePose edge;  ///< a: the keyframe of the other part that shares most points
  int inliers = 0;
  std::vector<std::pair<int, int>> matches;  ///< feature of edge.b, point
};

/// Looks from a keyframe, put to a predicted pose in the world of the targets, at the points that
/// the targets see. The pose found must be near the predicted one.
std::optional<ImageLoop> image_loop_near(const Map& map, const Pinhole& camera, int keyframe,
                                         const Eigen::Isometry3d& predicted,
                                         const std::vector<int>& targets);

/// Without a prediction: the features of the keyframe against those of each candidate, by
/// descriptors. The best one, with at least min_inliers.
std::optional<ImageLoop> image_loop_anywhere(const Map& map, const Pinhole& camera, int keyframe,
                                             const std::vector<int>& candidates, int min_inliers);

}  // namespace slam_demo
