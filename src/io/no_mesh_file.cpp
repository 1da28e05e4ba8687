// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/error.hpp"
#include "gpureg/mesh.hpp"

namespace gpureg::io {

SurfaceMesh read_mesh(const std::string& path) {
  throw IoError(path + ": is a mesh, and this gpureg was built without Assimp, which reads them");
}

}  // namespace gpureg::io
