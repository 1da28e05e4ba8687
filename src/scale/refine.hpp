// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

#include "gpureg/result.hpp"
#include "math/vec3.hpp"

namespace gpureg::scale {

/// Points with normals of a cloud, for the closest within a distance.
class ClosestSurface {
 public:
  /// distance: largest one that is searched.
  ClosestSurface(std::vector<Vec3> points, std::vector<Vec3> normals, float distance);
  /// Index of the closest point within the distance, or -1; the first one of equals.
  int closest(Vec3 p) const { return closest(p, distance_); }
  /// Within a shorter distance.
  int closest(Vec3 p, float distance) const;
  float distance() const { return distance_; }
  std::size_t size() const { return points_.size(); }
  Vec3 point(int k) const { return points_[static_cast<std::size_t>(k)]; }
  Vec3 normal(int k) const { return normals_[static_cast<std::size_t>(k)]; }

 private:
  std::vector<Vec3> points_, normals_;
  float distance_, inverse_;
  std::unordered_map<std::uint64_t, std::vector<int>> cells_;
};

/// A similarity after refinement.
struct RefinedScale {
  double factor = 1;  ///< of the scale before
  /// Rotation, translation, logarithm of the scale, about `centre`: sum of J'J over the points in
  /// common.
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Zero();
  std::size_t points = 0;        ///< in common
  double rms = 0;                ///< distance from the planes
  double scale_information = 0;  ///< of the logarithm of the scale alone, once the pose is free
  /// RMS displacement along the normals, per unit of the logarithm of the scale, that no rigid
  /// motion undoes; as a fraction of the RMS distance of the points from their centre.
  double stiffness = 0;
};

/// Point-to-plane ICP with a free scale (Geman-McClure weights), from target_from_source of the
/// points. The closest points of both clouds count alike: those of one alone make it smaller.
/// @param kernel final width of the weights, in the unit of the target.
RefinedScale refine_scale(const ClosestSurface& source, const ClosestSurface& target,
                          const UnalignedIsometry3d& target_from_source, float kernel);

}  // namespace gpureg::scale
