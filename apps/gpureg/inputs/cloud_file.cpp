// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/cloud_file.hpp"

#include <iostream>

#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "text.hpp"

namespace gpureg::cli {

double mesh_spacing(float voxel_size) { return 0.5 * static_cast<double>(voxel_size); }

void note_coarse(const PointCloud& cloud, const std::string& path) {
  const std::string what = io::coarse_coordinates(cloud);
  static int count = 0;  // a folder has hundreds of them
  constexpr int kShown = 2;
  if (what.empty() || ++count > kShown) return;
  std::cerr << "gpureg: note: " << path << ": " << what
            << (count == kShown ? "; further files are not named" : "") << std::endl;
}

PointCloud read_cloud(const std::string& path, double spacing, MeshNote note) {
  if (!io::is_mesh(path)) {
    PointCloud cloud = io::read_point_cloud(path);
    if (note == MeshNote::print) note_coarse(cloud, path);
    return cloud;
  }
  const io::SurfaceMesh mesh = io::read_mesh(path);
  PointCloud cloud = io::sample_mesh(mesh, spacing);
  if (note == MeshNote::none) return cloud;
  note_coarse(cloud, path);
  const std::string notes = mesh.notes();
  std::cerr << "gpureg: note: " << path << ": " << grouped(mesh.faces.size())
            << " faces were sampled by " << grouped(cloud.points.size()) << " points"
            << (mesh.closed() ? ", normals outwards"
                : cloud.model ? "; the surface is not closed"
                              : "; the surface is open and seen from the origin: a scan, no model")
            << (notes.empty() ? "" : "; " + notes) << std::endl;
  return cloud;
}

}  // namespace gpureg::cli
