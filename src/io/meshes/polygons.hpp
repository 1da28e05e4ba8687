// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/source.hpp"

namespace gpureg::io {

/// Faces of a mesh file, of any number of corners.
struct Polygons {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> corners;  ///< indices into vertices, face after face
  std::vector<std::size_t> ends;       ///< of each face in corners

  /// Adds a corner to the face that is not ended. Throws IoError unless it is a whole number in
  /// [0, 2^32 - 1).
  void add_corner(double vertex, const Source& source);
  void end_face() { ends.push_back(corners.size()); }
};

/// Throws IoError naming a face with a vertex that is not there, or that is not finite.
/// @param first number of the first vertex in the file, for the message.
void check_corners(const Polygons& polygons, const Source& source, std::size_t first);

/// Triangles that wind as their polygons: a fan of a convex one, the ears of any other (Meisters
/// 1975). Faces of fewer than three corners have none. Throws IoError for a face of more than 500
/// corners that is not convex.
std::vector<std::array<std::uint32_t, 3>> triangles_of(const Polygons& polygons,
                                                       const Source& source);

}  // namespace gpureg::io
