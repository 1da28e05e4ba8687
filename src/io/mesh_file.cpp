// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"

namespace gpureg::io {

namespace {

bool starts_as_ply(const std::string& path) {
  char start[3] = {};
  return std::ifstream(path, std::ios::binary).read(start, sizeof(start)) &&
         std::string_view(start, sizeof(start)) == "ply";
}

}  // namespace

SurfaceMesh read_mesh(const std::string& path) {
  // Assimp takes a truncated PLY file for one of fewer faces; the reader of points refuses it.
  if (starts_as_ply(path)) read_point_cloud(path);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Vertices of an STL are shared by position alone.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TEXCOORDS |
                                                          aiComponent_COLORS |
                                                          aiComponent_TANGENTS_AND_BITANGENTS);
  const aiScene* file = importer.ReadFile(
      path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices |
                aiProcess_RemoveComponent | aiProcess_JoinIdenticalVertices);
  if (file == nullptr)
    throw IoError(path + ": holds no readable face: " + importer.GetErrorString());
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (unsigned m = 0; m < file->mNumMeshes; ++m) {
    const aiMesh& part = *file->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (unsigned k = 0; k < part.mNumVertices; ++k) {
      const aiVector3D& v = part.mVertices[k];
      vertices.emplace_back(v.x, v.y, v.z);
    }
    for (unsigned k = 0; k < part.mNumFaces; ++k) {
      const aiFace& face = part.mFaces[k];
      if (face.mNumIndices == 3)
        faces.push_back(
            {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  try {
    return make_mesh(std::move(vertices), std::move(faces));
  } catch (const InvalidArgument& error) {
    throw IoError(path + ": " + error.what());
  }
}

}  // namespace gpureg::io
