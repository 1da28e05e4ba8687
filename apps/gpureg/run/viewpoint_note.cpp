// SPDX-License-Identifier: BSD-3-Clause
#include "run/viewpoint_note.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <iostream>
#include <limits>

#include "text.hpp"

namespace gpureg::cli {

namespace {

/// Sensors see a small part of a scene, but not from ten times its extent.
constexpr double kFarViewpoint = 10;

/// Distance of the nearest viewpoint from the box around the points; 0 without any.
double distance_of(const PointCloud& cloud, double& extent) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.allFinite()) box.extend(p.cast<double>());
  if (box.isEmpty() || cloud.viewpoints.empty()) return 0;
  extent = box.sizes().maxCoeff();
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3f& v : cloud.viewpoints)
    nearest = std::min(nearest, box.exteriorDistance(v.cast<double>()));
  return nearest;
}

}  // namespace

void ViewpointNote::see(const PointCloud& cloud, const std::string& file) {
  double extent = 0;
  if (const double distance = distance_of(cloud, extent);
      distance > kFarViewpoint * extent && extent > 0) {
    ++far_clouds_;
    if (distance > farthest_) {
      farthest_ = distance;
      extent_of_farthest_ = extent;
      farthest_file_ = file;
    }
  }
  const double share = cloud.view().share_facing_away();
  if (share <= PointCloudView::kMaxFacingAway) return;
  ++clouds_;
  if (share > most_) {
    most_ = share;
    worst_ = file;
  }
}

void ViewpointNote::print() const {
  if (far_clouds_ > 0)
    std::cerr << "gpureg: note: the viewpoint of " << farthest_file_ << " is "
              << significant(farthest_, 3) << " away from its points, which extend over "
              << significant(extent_of_farthest_, 3)
              << (far_clouds_ > 1
                      ? ", and so it is with " + std::to_string(far_clouds_ - 1) + " more clouds"
                      : "")
              << ": is it in the frame of the cloud, and not in that of the world?" << std::endl;
  if (clouds_ == 0) return;
  std::cerr << "gpureg: note: " << percent(most_) << " % of the normals of " << worst_
            << " show all viewpoints their back"
            << (clouds_ > 1 ? ", and many of " + std::to_string(clouds_ - 1) + " more clouds" : "")
            << ": are the viewpoints in the frame of the cloud, and do the normals point to where "
               "it was seen from?"
            << std::endl;
}

}  // namespace gpureg::cli
