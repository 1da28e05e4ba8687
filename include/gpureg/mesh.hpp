// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg::io {

/// Triangles with consistent winding, and what was wrong with them. Every function of this header
/// is thread-safe.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> vertices;            ///< finite
  std::vector<std::array<std::uint32_t, 3>> faces;  ///< indices into vertices; each has an area
  std::size_t flat_faces = 0;                       ///< without area, dropped
  std::size_t flipped_faces = 0;                    ///< turned to agree with their neighbours
  std::size_t non_manifold_edges = 0;               ///< of more than two faces
  std::size_t open_edges = 0;                       ///< of one face

  bool closed() const { return open_edges == 0 && non_manifold_edges == 0; }
  double area() const;
  /// The counts above that are not 0, as one English phrase; empty if nothing is wrong. Open
  /// edges are not wrong.
  std::string notes() const;
};

/// True for STL and OBJ by their extension, and for PLY files with faces. False if path cannot
/// be read.
bool is_mesh(const std::string& path);

/// Reads STL, OBJ or PLY. Polygons become triangles, vertices at the same place become one, and
/// make_mesh repairs the faces. Those of fewer than three corners count as flat. Opens no other
/// file: materials of OBJ are not looked at.
/// @throws IoError naming the file: unreadable, not a regular file, truncated; a face with a vertex
///   that is not there or not finite (with its number); a face of more than 500 corners that is not
///   convex; no face with an area.
SurfaceMesh read_mesh(const std::string& path);

/// Drops faces without area, turns faces that are wound against most of their neighbours, and turns
/// a closed mesh outwards.
/// @throws InvalidArgument naming the vertex that is not finite, or the face with a vertex that is
///   not there; or if no face has an area.
SurfaceMesh make_mesh(std::vector<Eigen::Vector3d> vertices,
                      std::vector<std::array<std::uint32_t, 3>> faces);

/// Points of the faces, uniform by area, with the normals of the faces. Same mesh, same bits. The
/// cloud is a model, unless the mesh is open and what a sensor at the origin sees, one surface in
/// each direction, from the front: then it is a scan with the origin as its viewpoint.
/// @param spacing wanted mean distance of neighbours, in the unit of the vertices; between 20,000
///   and 2,000,000 points are made. 0: 20,000 points.
/// @throws InvalidArgument if spacing is negative or not finite, or the mesh has no face.
PointCloud sample_mesh(const SurfaceMesh& mesh, double spacing = 0);

}  // namespace gpureg::io
