// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "gpureg/error.hpp"
#include "mesh.hpp"
#include "mesh_repair.hpp"

namespace gpureg::cli {

SurfaceMesh read_mesh(const std::string& path) {
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
  SurfaceMesh mesh;
  for (unsigned m = 0; m < file->mNumMeshes; ++m) {
    const aiMesh& part = *file->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (unsigned k = 0; k < part.mNumVertices; ++k) {
      const aiVector3D& v = part.mVertices[k];
      mesh.vertices.emplace_back(v.x, v.y, v.z);
      if (!mesh.vertices.back().allFinite())
        throw IoError(path + ": vertex " + std::to_string(mesh.vertices.size() - 1) +
                      " is not finite");
    }
    for (unsigned k = 0; k < part.mNumFaces; ++k) {
      const aiFace& face = part.mFaces[k];
      if (face.mNumIndices == 3)
        mesh.faces.push_back(
            {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  repair_mesh(mesh);
  if (mesh.faces.empty()) throw IoError(path + ": holds no face with an area");
  return mesh;
}

}  // namespace gpureg::cli
