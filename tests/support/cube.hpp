// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace gpureg::test {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// A cube of edge 1 at the origin; its 12 faces point outwards.
inline std::vector<Eigen::Vector3d> cube_vertices() {
  std::vector<Eigen::Vector3d> out;
  for (int k = 0; k < 8; ++k) out.emplace_back(k & 1, (k >> 1) & 1, (k >> 2) & 1);
  return out;
}

inline Triangles cube_faces() {
  return {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
}

inline std::string obj_text(const std::vector<Eigen::Vector3d>& vertices, const Triangles& faces) {
  std::ostringstream text;
  for (const auto& v : vertices) text << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& f : faces)
    text << "f " << f[0] + 1 << ' ' << f[1] + 1 << ' ' << f[2] + 1 << '\n';
  return text.str();
}

inline std::string ply_text(const std::vector<Eigen::Vector3d>& vertices, const Triangles& faces) {
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << vertices.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << faces.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : vertices) text << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& f : faces) text << "3 " << f[0] << ' ' << f[1] << ' ' << f[2] << '\n';
  return text.str();
}

inline std::string stl_text(const std::vector<Eigen::Vector3d>& vertices, const Triangles& faces) {
  std::ostringstream text;
  text << "solid part\n";
  for (const auto& f : faces) {
    text << " facet normal 0 0 0\n  outer loop\n";
    for (const std::uint32_t k : f)
      text << "   vertex " << vertices[k].x() << ' ' << vertices[k].y() << ' ' << vertices[k].z()
           << '\n';
    text << "  endloop\n endfacet\n";
  }
  text << "endsolid part\n";
  return text.str();
}

}  // namespace gpureg::test
