// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <fstream>

#include "fuzz/targets.hpp"
#include "gpureg/error.hpp"
#include "gpureg/mesh.hpp"

namespace gpureg::fuzz {
namespace {

void check(const io::SurfaceMesh& mesh) {
  if (mesh.faces.empty()) broken("a mesh has a face");
  for (const auto& face : mesh.faces)
    for (const std::uint32_t vertex : face)
      if (vertex >= mesh.vertices.size()) broken("a face has its vertices");
  if (!(mesh.area() > 0)) broken("faces have an area");
  io::sample_mesh(mesh);
}

/// PLY is known by its content, OBJ by its name; anything else is STL.
void read_mesh(std::string_view bytes) {
  static const std::string name = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid());
  for (const char* extension : {".stl", ".obj"}) {
    const std::string path = name + extension;
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<long>(bytes.size()));
    io::is_mesh(path);
    try {
      check(io::read_mesh(path));
    } catch (const IoError& error) {
      if (std::string_view(error.what()).find(path) == std::string_view::npos)
        broken("an error names its file");
    }
    ::unlink(path.c_str());
  }
}

}  // namespace

std::vector<Target> mesh_targets() { return {{"mesh", read_mesh}}; }

}  // namespace gpureg::fuzz
