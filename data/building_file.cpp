// SPDX-License-Identifier: BSD-3-Clause
#include "data/building_file.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <filesystem>

#include "gpureg/error.hpp"

namespace gpureg::synthetic {
namespace {

/// Assimp turns files that say which axis is up so that it is y.
bool comes_with_y_up(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return extension == ".dae" || extension == ".gltf" || extension == ".glb";
}

}  // namespace

Mesh read_building(const std::string& path) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* file =
      importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType |
                                  aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (file == nullptr) throw IoError(path + ": " + importer.GetErrorString());
  const bool y_up = comes_with_y_up(path);
  Mesh mesh;
  for (unsigned m = 0; m < file->mNumMeshes; ++m) {
    const aiMesh& part = *file->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (unsigned k = 0; k < part.mNumVertices; ++k) {
      const aiVector3D& v = part.mVertices[k];
      const Eigen::Vector3f p =
          y_up ? Eigen::Vector3f(v.x, -v.z, v.y) : Eigen::Vector3f(v.x, v.y, v.z);
      if (!p.allFinite()) throw IoError(path + ": a vertex is not a number");
      mesh.vertices.push_back(p);
    }
    Material material;
    aiColor3D colour(0.7f, 0.7f, 0.7f);
    if (part.mMaterialIndex < file->mNumMaterials)
      file->mMaterials[part.mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    material.base = material.second = {colour.r, colour.g, colour.b};
    mesh.palette.push_back(material);
    for (unsigned k = 0; k < part.mNumFaces; ++k) {
      const aiFace& face = part.mFaces[k];
      if (face.mNumIndices != 3) continue;
      mesh.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
      mesh.materials.push_back(static_cast<std::uint16_t>(mesh.palette.size() - 1));
    }
  }
  if (mesh.triangles.empty()) throw IoError(path + ": holds no triangle");
  if (mesh.palette.size() > 65535) throw IoError(path + ": has more than 65535 materials");
  return mesh;
}

}  // namespace gpureg::synthetic
