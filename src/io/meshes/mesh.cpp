// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <sstream>
#include <utility>

#include "common/float_origin.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "io/extension.hpp"
#include "io/limits.hpp"
#include "io/meshes/mesh_formats.hpp"
#include "io/meshes/one_view.hpp"
#include "io/ply.hpp"

namespace gpureg::io {
namespace {

constexpr double kFewestPoints = 2e4, kMostPoints = 2e6;

/// Of PLY and OFF.
bool header_has_faces(const std::string& path) try {
  const std::string start = files::read_start(path, kMostHeaderBytes);
  Source source(path, start);
  if (looks_like_off(start)) return off_has_faces(source);
  if (start.compare(0, 3, "ply") != 0) return false;
  const PlyHeader header = read_ply_header(source);
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& e) {
    return e.name == "face" && e.has_list() && e.count > 0;
  });
} catch (const IoError&) {
  return false;
}

Eigen::Vector3d doubled_area(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& face) {
  const Eigen::Vector3d& a = mesh.vertices[face[0]];
  return (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
}

void repair(SurfaceMesh& mesh) {
  const auto flat = [&](const std::array<std::uint32_t, 3>& face) {
    return !(doubled_area(mesh, face).norm() > 0);
  };
  const std::size_t before = mesh.faces.size();
  mesh.faces.erase(std::remove_if(mesh.faces.begin(), mesh.faces.end(), flat), mesh.faces.end());
  mesh.flat_faces = before - mesh.faces.size();

  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  struct Use {
    std::size_t face;
    bool ascending;  ///< the face runs from the lower to the higher vertex
  };
  std::map<Edge, std::vector<Use>> edges;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.faces[f][k], b = mesh.faces[f][(k + 1) % 3];
      edges[{std::min(a, b), std::max(a, b)}].push_back({f, a < b});
    }
  std::vector<std::vector<std::pair<std::size_t, bool>>> neighbors(mesh.faces.size());
  for (const auto& [edge, uses] : edges) {
    mesh.open_edges += uses.size() == 1;
    mesh.non_manifold_edges += uses.size() > 2;
    if (uses.size() != 2) continue;
    // Neighbours that agree run along their edge in opposite directions.
    const bool disagree = uses[0].ascending == uses[1].ascending;
    neighbors[uses[0].face].emplace_back(uses[1].face, disagree);
    neighbors[uses[1].face].emplace_back(uses[0].face, disagree);
  }
  std::vector<signed char> turned(mesh.faces.size(), -1);
  for (std::size_t start = 0; start < mesh.faces.size(); ++start) {
    if (turned[start] >= 0) continue;
    turned[start] = 0;
    std::vector<std::size_t> part{start};
    for (std::size_t next = 0; next < part.size(); ++next)
      for (const auto& [face, disagree] : neighbors[part[next]])
        if (turned[face] < 0) {
          turned[face] = static_cast<signed char>((turned[part[next]] != 0) != disagree);
          part.push_back(face);
        }
    std::size_t flips = 0;
    for (const std::size_t face : part) flips += turned[face] != 0;
    // The fewer ones are wrong.
    const bool others = 2 * flips > part.size();
    for (const std::size_t face : part) {
      if ((turned[face] != 0) == others) continue;
      std::swap(mesh.faces[face][1], mesh.faces[face][2]);
      ++mesh.flipped_faces;
    }
  }
  if (!mesh.closed()) return;
  double volume = 0;
  for (const auto& face : mesh.faces)
    volume += mesh.vertices[face[0]].dot(doubled_area(mesh, face));
  if (volume >= 0) return;
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
  mesh.flipped_faces = mesh.faces.size() - mesh.flipped_faces;
}

std::string number(const std::vector<Eigen::Vector3d>& vertices, std::size_t k) {
  std::ostringstream text;
  text << "vertices[" << k << "] is " << vertices[k].transpose();
  return text.str();
}

}  // namespace

double SurfaceMesh::area() const {
  double sum = 0;
  for (const auto& face : faces) sum += 0.5 * doubled_area(*this, face).norm();
  return sum;
}

bool is_mesh(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension == ".stl" || (extension == ".obj" && obj_has_faces(path)) ||
         header_has_faces(path);
}

std::string SurfaceMesh::notes() const {
  std::string text;
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(flat_faces, "faces without area were dropped");
  add(flipped_faces, "faces pointed the wrong way and were turned");
  add(non_manifold_edges, "edges belong to more than two faces");
  return text;
}

SurfaceMesh make_mesh(std::vector<Eigen::Vector3d> vertices,
                      std::vector<std::array<std::uint32_t, 3>> faces) {
  for (std::size_t k = 0; k < vertices.size(); ++k)
    if (!vertices[k].cast<float>().allFinite())
      throw InvalidArgument(number(vertices, k) + ", expected finite coordinates of float32");
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (const std::uint32_t vertex : faces[f])
      if (vertex >= vertices.size())
        throw InvalidArgument("faces[" + std::to_string(f) + "] refers to vertex " +
                              std::to_string(vertex) + ", but there are " +
                              std::to_string(vertices.size()));
  SurfaceMesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.faces = std::move(faces);
  repair(mesh);
  if (mesh.faces.empty())
    throw InvalidArgument("faces: none of " + std::to_string(mesh.flat_faces) + " has an area");
  return mesh;
}

PointCloud sample_mesh(const SurfaceMesh& mesh, double spacing) {
  if (!(spacing >= 0 && std::isfinite(spacing)))
    throw InvalidArgument("spacing is " + std::to_string(spacing) +
                          ", expected a finite distance, or 0");
  if (mesh.faces.empty()) throw InvalidArgument("mesh.faces is empty");
  std::vector<double> until;  // area up to and including each face
  for (const auto& face : mesh.faces)
    until.push_back((until.empty() ? 0 : until.back()) + 0.5 * doubled_area(mesh, face).norm());
  const double wanted = spacing > 0 ? until.back() / (spacing * spacing) : kFewestPoints;
  const auto count = static_cast<std::size_t>(std::clamp(wanted, kFewestPoints, kMostPoints));
  std::mt19937 random(1);
  const auto unit = [&] { return static_cast<double>(random()) / 4294967296.0; };
  PointCloud cloud;
  std::vector<Eigen::Vector3d> points;
  points.reserve(count);
  cloud.normals.reserve(count);
  std::size_t f = 0;
  for (std::size_t k = 0; k < count; ++k) {
    // Stratified by area: one point in each of `count` equal parts.
    const double at = (static_cast<double>(k) + unit()) / static_cast<double>(count) * until.back();
    while (f + 1 < until.size() && until[f] < at) ++f;
    const auto& face = mesh.faces[f];
    const double s = std::sqrt(unit()), u = unit();
    const Eigen::Vector3d p = (1 - s) * mesh.vertices[face[0]] +
                              s * (1 - u) * mesh.vertices[face[1]] + s * u * mesh.vertices[face[2]];
    points.push_back(p);
    cloud.normals.push_back(doubled_area(mesh, face).normalized().cast<float>());
  }
  set_points(cloud, points);
  cloud.model = !is_one_view(mesh, points, cloud.normals);
  if (!cloud.model) cloud.set_viewpoints({Eigen::Vector3d::Zero()});
  return cloud;
}

}  // namespace gpureg::io
