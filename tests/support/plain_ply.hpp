// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>

#include "gpureg/point_cloud.hpp"

namespace gpureg::test {

/// Reads binary little-endian PLY whose vertices are float32 only, x y z first, normals next where
/// there are six: enough for tests of the core, which has to build without the io component.
inline PointCloud read_plain_ply(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  std::size_t count = 0, properties = 0;
  while (std::getline(file, line) && line != "end_header") {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoul(line.substr(15));
    if (line.rfind("property float ", 0) == 0) ++properties;
  }
  if (!file || properties < 3) throw std::runtime_error(path + " is not a plain float32 PLY");
  std::vector<float> values(count * properties);
  if (!file.read(reinterpret_cast<char*>(values.data()),
                 static_cast<std::streamsize>(values.size() * sizeof(float))))
    throw std::runtime_error(path + " is truncated");
  PointCloud cloud;
  for (std::size_t k = 0; k < count; ++k) {
    const float* row = values.data() + k * properties;
    cloud.points.emplace_back(row[0], row[1], row[2]);
    if (properties == 6) cloud.normals.emplace_back(row[3], row[4], row[5]);
  }
  return cloud;
}

}  // namespace gpureg::test
