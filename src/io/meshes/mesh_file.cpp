// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/mesh.hpp"
#include "io/clouds/foreign.hpp"
#include "io/extension.hpp"
#include "io/limits.hpp"
#include "io/meshes/mesh_formats.hpp"
#include "io/ply.hpp"

namespace gpureg::io {
namespace {

struct Hash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t hash = 0;
    for (const double axis : p) {
      std::uint64_t bits;
      std::memcpy(&bits, &axis, sizeof(bits));
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15ull;
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

/// Vertices of faces at the same place become one, which STL has no other way to say.
std::vector<Eigen::Vector3d> merge_vertices(const std::vector<Eigen::Vector3d>& vertices,
                                            std::vector<std::array<std::uint32_t, 3>>& faces) {
  std::vector<Eigen::Vector3d> out;
  std::unordered_map<std::array<double, 3>, std::uint32_t, Hash> known;
  for (auto& face : faces)
    for (std::uint32_t& vertex : face) {
      const Eigen::Vector3d p = vertices[vertex].array() + 0.0;  // -0 is 0
      const auto [at, is_new] =
          known.emplace(std::array{p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(out.size()));
      if (is_new) out.push_back(p);
      vertex = at->second;
    }
  return out;
}

Polygons read_polygons(const std::string& path, Source& source) {
  const std::string_view bytes = source.rest();
  if (bytes.empty()) source.fail("the file is empty: it has no face");
  if (bytes.compare(0, 3, "ply") == 0) return read_ply_mesh(source);
  if (looks_like_off(bytes)) return read_off(source);
  const std::string extension = extension_of(path);
  const std::string foreign = foreign_format(path, bytes.substr(0, kMostHeaderBytes));
  if (!foreign.empty()) source.fail(foreign);
  return extension == ".obj" ? read_obj(source) : read_stl(source);
}

}  // namespace

// Assimp, which reads buildings, crashes on damaged files; these formats are simple.
SurfaceMesh read_mesh(const std::string& path) {
  files::read_start(path, 0);  // refuses what is not a regular file
  const std::string bytes = files::read_file(path, kMostDataBytes);
  Source source(path, bytes);
  const Polygons polygons = read_polygons(path, source);
  std::size_t flat = 0, begin = 0;
  for (const std::size_t end : polygons.ends) flat += end - std::exchange(begin, end) < 3;
  auto faces = triangles_of(polygons, source);
  auto vertices = merge_vertices(polygons.vertices, faces);
  try {
    SurfaceMesh mesh = make_mesh(std::move(vertices), std::move(faces));
    mesh.flat_faces += flat;
    return mesh;
  } catch (const InvalidArgument& error) {
    source.fail(error.what());
  }
}

}  // namespace gpureg::io
