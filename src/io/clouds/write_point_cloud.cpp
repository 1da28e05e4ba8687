// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "io/ply_writer.hpp"

namespace gpureg::io {

void write_point_cloud(const std::string& path, const PointCloud& cloud) {
  const bool has_normals = !cloud.normals.empty();
  if (has_normals && cloud.normals.size() != cloud.points.size())
    throw InvalidArgument("cloud.normals has " + std::to_string(cloud.normals.size()) +
                          " entries, expected none or as many as points, " +
                          std::to_string(cloud.points.size()));
  PlyWriter ply(cloud.points.size(), cloud.origin,
                has_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
                has_normals ? 12 : 0);
  for (std::size_t k = 0; k < cloud.points.size(); ++k) {
    ply.append_point(cloud.points[k]);
    if (has_normals) ply.append(cloud.normals[k]);
  }
  files::write_atomically(path, ply.bytes());
}

}  // namespace gpureg::io
