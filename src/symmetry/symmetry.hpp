// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <utility>
#include <vector>

#include "math/vec3.hpp"

namespace gpureg {

/// The rigid motions that map a cloud onto itself. Host only; deterministic.
class CloudSymmetry {
 public:
  /// @param points, normals of a prepared cloud, normals of the same side.
  /// @param distance within which a moved point lies on the cloud, in the unit of the points.
  CloudSymmetry(std::vector<Vec3> points, std::vector<Vec3> normals, float distance);

  /// True if a motion close to this one maps the cloud onto itself and is not the identity.
  /// @param motion of the points.
  /// @param slack largest RMS displacement between the motion and the symmetry that it stands for,
  ///   and the smallest one between a symmetry and the identity.
  bool has(const Eigen::Isometry3d& motion, double slack);

 private:
  struct Bucket {
    std::uint64_t key;
    std::uint32_t begin, end;  ///< places in indexed_
  };
  struct OrientedPoint {
    Eigen::Vector3d point, normal;
  };
  /// Place in indexed_ of the nearest point with a similar normal within the search radius, the
  /// first one of equals; its size for none.
  std::size_t nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                      float min_cosine) const;
  void build_index();
  bool refine(Eigen::Isometry3d& motion) const;
  double share(const Eigen::Isometry3d& motion) const;
  double displacement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const;

  std::vector<Vec3> points_, normals_;
  float distance_;
  std::vector<Bucket> cells_;           ///< ascending keys
  std::vector<OrientedPoint> indexed_;  ///< by cell, then in the order of the cloud
  std::vector<std::uint32_t> sample_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread_ = Eigen::Matrix3d::Zero();  ///< covariance about middle_
};

}  // namespace gpureg
