// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/cloud_file.hpp"

#include <iostream>

#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "text.hpp"

namespace gpureg::cli {

double mesh_spacing(float voxel_size) { return 0.5 * static_cast<double>(voxel_size); }

PointCloud read_cloud(const std::string& path, double spacing, MeshNote note) {
  if (!io::is_mesh(path)) return io::read_point_cloud(path);
  const io::SurfaceMesh mesh = io::read_mesh(path);
  PointCloud cloud = io::sample_mesh(mesh, spacing);
  if (note == MeshNote::none) return cloud;
  const std::string notes = mesh.notes();
  std::cerr << "gpureg: note: " << path << ": " << grouped(mesh.faces.size())
            << " faces were sampled by " << grouped(cloud.points.size()) << " points"
            << (mesh.closed() ? ", normals outwards" : "; the surface is not closed")
            << (notes.empty() ? "" : "; " + notes) << std::endl;
  return cloud;
}

}  // namespace gpureg::cli
