// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "mapping/bundle.hpp"

/// From features to the pose of one image: matches with points of the map, PnP, refinement.
namespace slam_demo {

/// An image whose pose is looked for.
struct View {
  std::shared_ptr<const Features> features;
  std::vector<int> points;  ///< of each feature the point of the map, or kNone
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< world_from_camera
  int inliers = 0;                                         ///< after refine()
};

constexpr int kMaxDistance = 64;  ///< bits of 256 between descriptors of one point

/// Projects points into the view and gives each the most similar feature near by: radius in pixels
/// of octave 0, ratio to the second most similar feature. Matches that the view has stay.
void match_by_projection(const Map& map, const Pinhole& camera, const std::vector<int>& points,
                         double radius, int max_distance, double ratio, View& view);

/// Matches all features with those of a keyframe, by descriptors alone.
void match_by_descriptor(const Map& map, const Keyframe& keyframe, View& view);

/// PnP with RANSAC (OpenCV). Keeps the inliers; false where there are too few.
bool solve_pnp(const Map& map, const Pinhole& camera, View& view);

/// Refines the pose and drops the points that do not fit. Returns the inliers.
int refine(const Map& map, const Pinhole& camera, View& view);

}  // namespace slam_demo
