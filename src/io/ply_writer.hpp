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
  /// properties: lines like "property float x\n", in the order in which the values are appended.
  PlyWriter(std::size_t vertices, const std::string& properties, std::size_t bytes_per_vertex)
      : bytes_("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
               "\n" + properties + "end_header\n") {
    bytes_.reserve(bytes_.size() + vertices * bytes_per_vertex);
  }

  void append(const Eigen::Vector3f& v);
  void append(std::uint8_t red, std::uint8_t green, std::uint8_t blue);

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace gpureg::io
