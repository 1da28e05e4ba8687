// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/cloud_file.hpp"

#include <algorithm>
#include <iostream>

#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "inputs/python_file.hpp"
#include "text.hpp"

namespace gpureg::cli {

double mesh_spacing(float voxel_size) { return 0.5 * static_cast<double>(voxel_size); }

namespace {

/// A folder has hundreds of files with the same to note.
void print_note(const std::string& path, const std::string& what, int& count) {
  constexpr int kShown = 2;
  if (what.empty() || ++count > kShown) return;
  std::cerr << "gpureg: note: " << path << ": " << what
            << (count == kShown ? "; further files are not named" : "") << std::endl;
}

/// Of organised clouds half of the points may be missing; where nearly all are, it is a mistake.
void note_not_finite(const PointCloud& cloud, const std::string& path) {
  static int count = 0;
  const auto missing = static_cast<std::size_t>(
      std::count_if(cloud.points.begin(), cloud.points.end(),
                    [](const Eigen::Vector3f& p) { return !p.allFinite(); }));
  if (10 * missing >= 9 * cloud.points.size() && missing > 0)
    print_note(
        path,
        grouped(missing) + " of its " + grouped(cloud.points.size()) + " points are not finite",
        count);
}

void note_strange(const std::string& what, const std::string& path) {
  static int count = 0;
  print_note(path, what, count);
}

}  // namespace

void note_coarse(const PointCloud& cloud, const std::string& path) {
  static int count = 0;
  print_note(path, io::coarse_coordinates(cloud), count);
}

PointCloud read_cloud(const std::string& path, double spacing, MeshNote note) {
  if (!io::is_mesh(path)) {
    std::string strange;
    PointCloud cloud =
        is_for_python(path) ? read_by_python(path) : io::read_point_cloud(path, 0, &strange);
    if (note == MeshNote::none) return cloud;
    note_coarse(cloud, path);
    note_strange(strange, path);
    note_not_finite(cloud, path);
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
