// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/building_file.hpp"

#include <assimp/DefaultIOSystem.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <filesystem>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/mesh.hpp"
#include "io/meshes/polygons.hpp"

namespace gpureg::synthetic {
namespace {

constexpr std::size_t kMostTriangles = 50'000'000;

/// Files that a building names, of materials for example, must not be pipes or devices.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    std::error_code error;
    return std::filesystem::is_regular_file(path, error) ? DefaultIOSystem::Open(path, mode)
                                                         : nullptr;
  }
};

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return extension;
}

/// Assimp turns files that say which axis is up so that it is y.
bool comes_with_y_up(const std::string& extension) {
  return extension == ".dae" || extension == ".gltf" || extension == ".glb";
}

Material painted(float red, float green, float blue) {
  Material material;
  material.base = material.second = {red, green, blue};
  return material;
}

/// A mesh where a node of the scene puts it.
struct Instance {
  const aiMesh* mesh;
  aiMatrix4x4 world_from_mesh;
};

/// Depth first, and by material: each becomes one part of the palette.
std::vector<Instance> instances_of(const aiScene& scene) {
  std::vector<Instance> out;
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> open{{scene.mRootNode, aiMatrix4x4()}};
  while (!open.empty()) {
    const auto [node, world_from_parent] = open.back();
    open.pop_back();
    if (node == nullptr) continue;
    const aiMatrix4x4 world_from_node = world_from_parent * node->mTransformation;
    for (unsigned k = 0; k < node->mNumMeshes; ++k)
      if (node->mMeshes[k] < scene.mNumMeshes)
        out.push_back({scene.mMeshes[node->mMeshes[k]], world_from_node});
    for (unsigned k = node->mNumChildren; k-- > 0;)
      open.emplace_back(node->mChildren[k], world_from_node);
  }
  std::stable_sort(out.begin(), out.end(), [](const Instance& a, const Instance& b) {
    return a.mesh->mMaterialIndex < b.mesh->mMaterialIndex;
  });
  return out;
}

/// Assimp's own triangulation and transformation trust the indices of the file.
io::Polygons polygons_of(const Instance& instance, bool y_up, const io::Source& source) {
  io::Polygons out;
  for (unsigned k = 0; k < instance.mesh->mNumVertices; ++k) {
    const aiVector3D v = instance.world_from_mesh * instance.mesh->mVertices[k];
    out.vertices.push_back(y_up ? Eigen::Vector3d(v.x, -v.z, v.y) : Eigen::Vector3d(v.x, v.y, v.z));
  }
  for (unsigned k = 0; k < instance.mesh->mNumFaces; ++k) {
    const aiFace& face = instance.mesh->mFaces[k];
    for (unsigned c = 0; c < face.mNumIndices; ++c) out.add_corner(face.mIndices[c], source);
    out.end_face();
  }
  io::check_corners(out, source, 0);
  return out;
}

Mesh read_by_assimp(const std::string& path, bool y_up) {
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer deletes it
  const aiScene* scene = importer.ReadFile(path, 0);
  if (scene == nullptr) throw IoError(path + ": " + importer.GetErrorString());
  const io::Source source(path, {});
  Mesh mesh;
  unsigned part = 0;
  for (const Instance& instance : instances_of(*scene)) {
    const io::Polygons polygons = polygons_of(instance, y_up, source);
    const auto faces = io::triangles_of(polygons, source);
    if (faces.empty()) continue;
    if (mesh.triangles.size() + faces.size() > kMostTriangles)
      throw IoError(path + ": has more than " + std::to_string(kMostTriangles) + " triangles");
    if (mesh.palette.empty() || instance.mesh->mMaterialIndex != part) {
      part = instance.mesh->mMaterialIndex;
      aiColor3D colour(0.7f, 0.7f, 0.7f);
      if (part < scene->mNumMaterials)
        scene->mMaterials[part]->Get(AI_MATKEY_COLOR_DIFFUSE, colour);
      mesh.palette.push_back(painted(colour.r, colour.g, colour.b));
    }
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Eigen::Vector3d& v : polygons.vertices) mesh.vertices.push_back(v.cast<float>());
    for (const auto& face : faces)
      mesh.triangles.push_back({first + face[0], first + face[1], first + face[2]});
    mesh.materials.resize(mesh.triangles.size(),
                          static_cast<std::uint16_t>(mesh.palette.size() - 1));
  }
  if (mesh.triangles.empty()) throw IoError(path + ": holds no triangle");
  if (mesh.palette.size() > 65535) throw IoError(path + ": has more than 65535 materials");
  return mesh;
}

/// Without colours.
Mesh read_plain(const std::string& path) {
  const io::SurfaceMesh surface = io::read_mesh(path);
  Mesh mesh;
  for (const Eigen::Vector3d& v : surface.vertices) mesh.vertices.push_back(v.cast<float>());
  mesh.triangles = surface.faces;
  mesh.palette = {painted(0.7f, 0.7f, 0.7f)};
  mesh.materials.resize(mesh.triangles.size(), 0);
  return mesh;
}

}  // namespace

Mesh read_building(const std::string& path) {
  const std::string extension = extension_of(path);
  if (extension == ".ply" || extension == ".stl") return read_plain(path);
  return read_by_assimp(path, comes_with_y_up(extension));
}

}  // namespace gpureg::synthetic
