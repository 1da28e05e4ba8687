// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg::localization {

/// Directions from which a part is looked at: those of a cube's faces, edges and corners, and the
/// 24 between them.
const std::vector<Eigen::Vector3f>& look_directions();

/// For each point the directions from which it is seen, a bit each: nothing of the part is in front
/// of it.
/// @param normals empty, or one per point, outwards.
/// @param spacing of the points.
std::vector<std::uint64_t> directions_that_see(const std::vector<Eigen::Vector3f>& points,
                                               const std::vector<Eigen::Vector3f>& normals,
                                               float spacing, unsigned threads);

/// The finite points of a part that can be seen from outside. Faces inside a solid, as of
/// overlapping bodies in a CAD file, no sensor sees.
PointCloud outer_surface(const PointCloudView& part, unsigned threads);

/// The surface of a part as small discs.
struct PartSurface {
  std::vector<Eigen::Vector3f> points, normals;
  bool oriented = false;                 ///< normals point outwards; otherwise either way
  std::vector<std::uint64_t> seen_from;  ///< see directions_that_see
  float spacing = 0;                     ///< of the points
  Eigen::Vector3d middle{0, 0, 0};       ///< of the box
  float radius = 0;                      ///< around the middle
  float diameter = 0;                    ///< diagonal of the box
};

}  // namespace gpureg::localization
