// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Triangles of a file, and what is wrong with them.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::size_t flat_faces = 0;          ///< without area, dropped
  std::size_t flipped_faces = 0;       ///< turned to agree with their neighbours
  std::size_t non_manifold_edges = 0;  ///< of more than two faces
  std::size_t open_edges = 0;          ///< of one face

  bool closed() const { return open_edges == 0 && non_manifold_edges == 0; }
  double area() const;
};

/// True for STL and OBJ by their extension, and for PLY files with faces.
bool is_mesh(const std::string& path);

/// Reads a mesh through Assimp. Faces that are wound against their neighbours are turned, and all
/// faces of a closed mesh point outwards.
/// @throws IoError naming the file: unreadable, a vertex that is not finite, no face, or gpureg was
///   built without Assimp.
SurfaceMesh read_mesh(const std::string& path);

/// One sentence for each thing wrong with a mesh; empty where all is well.
std::string notes_of(const SurfaceMesh& mesh);

/// Points of the faces, uniform by area, with the normals of the faces. Deterministic.
/// @param spacing wanted mean distance of neighbours; between 20,000 and 2,000,000 points are made.
PointCloud sample_mesh(const SurfaceMesh& mesh, double spacing);

}  // namespace gpureg::cli
