// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>

#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "io/ply_writer.hpp"

namespace gpureg::io {

void PlyWriter::append(const Eigen::Vector3f& v) {
  for (int axis = 0; axis < 3; ++axis) {
    std::uint32_t bits;
    std::memcpy(&bits, v.data() + axis, 4);
    for (int shift = 0; shift < 32; shift += 8)
      bytes_.push_back(static_cast<char>((bits >> shift) & 0xff));
  }
}

void PlyWriter::append(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  for (const std::uint8_t channel : {red, green, blue})
    bytes_.push_back(static_cast<char>(channel));
}

void write_point_cloud(const std::string& path, const PointCloud& cloud) {
  const bool has_normals = !cloud.normals.empty();
  if (has_normals && cloud.normals.size() != cloud.points.size())
    throw InvalidArgument("cloud.normals has " + std::to_string(cloud.normals.size()) +
                          " entries, expected none or as many as points, " +
                          std::to_string(cloud.points.size()));
  std::string properties = "property float x\nproperty float y\nproperty float z\n";
  if (has_normals) properties += "property float nx\nproperty float ny\nproperty float nz\n";
  PlyWriter ply(cloud.points.size(), properties, has_normals ? 24 : 12);
  for (std::size_t k = 0; k < cloud.points.size(); ++k) {
    ply.append(cloud.points[k]);
    if (has_normals) ply.append(cloud.normals[k]);
  }
  files::write_atomically(path, ply.bytes());
}

}  // namespace gpureg::io
