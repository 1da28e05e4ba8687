// SPDX-License-Identifier: BSD-3-Clause
#include "io/ply_writer.hpp"

#include <cstring>

namespace gpureg::io {
namespace {

template <typename Bits, typename Number>
void append_number(std::string& bytes, Number value) {
  Bits bits;
  static_assert(sizeof(bits) == sizeof(value));
  std::memcpy(&bits, &value, sizeof(bits));
  for (std::size_t shift = 0; shift < 8 * sizeof(bits); shift += 8)
    bytes.push_back(static_cast<char>((bits >> shift) & 0xff));
}

}  // namespace

PlyWriter::PlyWriter(std::size_t vertices, const Eigen::Vector3d& origin,
                     const std::string& properties, std::size_t bytes_per_vertex)
    : origin_(origin),
      bytes_("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
             "\n") {
  const bool is_double = !origin.isZero(0);
  for (const char* axis : {"x", "y", "z"})
    bytes_ += std::string("property ") + (is_double ? "double " : "float ") + axis + "\n";
  bytes_ += properties + "end_header\n";
  bytes_.reserve(bytes_.size() + vertices * (bytes_per_vertex + (is_double ? 24 : 12)));
}

void PlyWriter::append_point(const Eigen::Vector3f& row) {
  if (origin_.isZero(0)) return append(row);
  const Eigen::Vector3d p = row.cast<double>() + origin_;
  for (int axis = 0; axis < 3; ++axis) append_number<std::uint64_t>(bytes_, p[axis]);
}

void PlyWriter::append(const Eigen::Vector3f& v) {
  for (int axis = 0; axis < 3; ++axis) append_number<std::uint32_t>(bytes_, v[axis]);
}

void PlyWriter::append(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  for (const std::uint8_t channel : {red, green, blue})
    bytes_.push_back(static_cast<char>(channel));
}

}  // namespace gpureg::io
