// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include "files/text_file.hpp"
#include "io/decode.hpp"
#include "io/meshes/mesh_formats.hpp"

namespace gpureg::io {
namespace {

constexpr std::size_t kHeader = 84;   ///< a comment of 80 bytes, then the number of faces
constexpr std::size_t kRecord = 50;   ///< normal, three corners, two bytes
constexpr std::size_t kCorners = 12;  ///< where they start in a record

Polygons read_binary(const Source& source, std::size_t faces) {
  const std::string_view bytes = source.rest();
  if (faces > (bytes.size() - kHeader) / kRecord)
    source.fail("truncated: the header announces " + std::to_string(faces) + " faces of " +
                std::to_string(kRecord) + " bytes, but only " +
                std::to_string(bytes.size() - kHeader) + " bytes follow");
  const bool swap = host_order() != ByteOrder::little;
  Polygons out;
  for (std::size_t face = 0; face < faces; ++face) {
    const char* at = bytes.data() + kHeader + face * kRecord + kCorners;
    for (int corner = 0; corner < 3; ++corner) {
      out.add_corner(static_cast<double>(out.vertices.size()), source);
      Eigen::Vector3d& p = out.vertices.emplace_back();
      for (int axis = 0; axis < 3; ++axis, at += sizeof(float))
        p[axis] = load(Scalar::float32, at, swap);
    }
    out.end_face();
  }
  return out;
}

Polygons read_text(Source& source) {
  Polygons out;
  std::string_view line;
  std::vector<std::string_view> fields;
  bool in_face = false;
  while (source.next_line(line)) {
    split(line, fields);
    if (fields.empty()) continue;
    if (fields[0] == "outer") in_face = true;
    if (fields[0] == "endloop" && in_face) {
      out.end_face();
      in_face = false;
    }
    if (fields[0] != "vertex") continue;
    if (fields.size() != 4 || !in_face) source.fail_line("expected: vertex x y z, in a loop");
    out.add_corner(static_cast<double>(out.vertices.size()), source);
    Eigen::Vector3d& p = out.vertices.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!parse_coordinate(fields[axis + 1], p[static_cast<Eigen::Index>(axis)]))
        source.fail_line("a coordinate is " + files::in_quotes(fields[axis + 1]) +
                         ", expected a number");
  }
  if (in_face) source.fail("truncated: the file ends within a face");
  return out;
}

}  // namespace

// Binary files may start with the word of text files: their size decides.
Polygons read_stl(Source& source) {
  const std::string_view bytes = source.rest();
  const bool has_header = bytes.size() >= kHeader;
  const auto faces = has_header ? static_cast<std::size_t>(load(Scalar::uint32, bytes.data() + 80,
                                                                host_order() != ByteOrder::little))
                                : 0;
  const std::size_t start = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const bool text = bytes.compare(start, 5, "solid") == 0;
  if (!text && !has_header) source.fail("neither a text nor a binary STL: it has no face");
  Polygons out = text && !(has_header && bytes.size() == kHeader + faces * kRecord)
                     ? read_text(source)
                     : read_binary(source, faces);
  if (out.ends.empty()) source.fail("it has no face");
  check_corners(out, source, 1);
  return out;
}

}  // namespace gpureg::io
