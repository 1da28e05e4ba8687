// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gpureg::io {

/// Bytes of a binary little-endian PLY file whose vertices are appended one by one.
class PlyWriter {
 public:
  /// Vertices begin with their coordinates: float, or double where there is an origin to add.
  /// properties: lines of what follows, like "property float nx\n", in the order in which the
  /// values are appended.
  PlyWriter(std::size_t vertices, const Eigen::Vector3d& origin, const std::string& properties,
            std::size_t bytes_per_vertex);

  void append_point(const Eigen::Vector3f& row);  ///< relative to the origin
  void append(const Eigen::Vector3f& v);
  void append(std::uint8_t red, std::uint8_t green, std::uint8_t blue);

  const std::string& bytes() const { return bytes_; }

 private:
  Eigen::Vector3d origin_;
  std::string bytes_;
};

}  // namespace gpureg::io
