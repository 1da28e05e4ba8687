// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <fstream>
#include <string>

#include "common/float_origin.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "io/decode.hpp"
#include "io/meshes/mesh_formats.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;

/// The next line with its continuations: a backslash ends a line that goes on.
bool next_statement(Source& source, std::string& text, Fields& fields) {
  text.clear();
  std::string_view line;
  bool found = false;
  while (source.next_line(line)) {
    found = true;
    text += line;
    if (text.empty() || text.back() != '\\') break;
    text.back() = ' ';
  }
  split(std::string_view(text).substr(0, text.find('#')), fields);
  return found;
}

Eigen::Vector3d vertex_of(const Fields& fields, const Source& source) {
  Eigen::Vector3d p;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (fields.size() < 4) source.fail_line("expected: v x y z");
    if (!parse_coordinate(fields[axis + 1], p[static_cast<Eigen::Index>(axis)]))
      source.fail_line("a coordinate is " + files::in_quotes(fields[axis + 1]) +
                       ", expected a number");
  }
  return p;
}

/// From 0. Corners are vertex, vertex/texture, vertex//normal or vertex/texture/normal; negative
/// numbers count back from the last vertex.
double corner_of(std::string_view field, std::size_t vertices, const Source& source) {
  const std::string_view text = field.substr(0, field.find('/'));
  std::int64_t number = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::int64_t vertex =
      number < 0 ? static_cast<std::int64_t>(vertices) + number : number - 1;
  if (error != std::errc() || stop != text.data() + text.size() || vertex < 0)
    source.fail_line("a corner of a face is " + files::in_quotes(field) +
                     ", expected the number of a vertex");
  return static_cast<double>(vertex);
}

}  // namespace

bool obj_has_faces(const std::string& path) try {
  files::read_start(path, 0);  // refuses what is not a regular file
  std::ifstream file(path, std::ios::binary);
  std::string piece(std::size_t{1} << 16, '\0');
  // The first bytes of a line, of which no more is kept.
  char first = '\0', second = '\0';
  std::size_t column = 0;
  while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0)
    for (std::streamsize k = 0; k < file.gcount(); ++k) {
      const char c = piece[static_cast<std::size_t>(k)];
      if (c == '\n') {
        column = 0;
        continue;
      }
      if (column == 0 && (c == ' ' || c == '\t')) continue;
      if (column == 0) first = c;
      if (column == 1) second = c;
      if (++column == 2 && first == 'f' && (second == ' ' || second == '\t')) return true;
    }
  return false;
} catch (const IoError&) {
  return false;
}

PointCloud read_obj_points(Source& source) {
  PointCloud cloud;
  std::vector<Eigen::Vector3d> points;
  std::string text;
  Fields fields;
  while (next_statement(source, text, fields)) {
    if (fields.empty()) continue;
    if (fields[0] == "v") points.push_back(vertex_of(fields, source));
    if (fields[0] == "vn") cloud.normals.push_back(vertex_of(fields, source).cast<float>());
  }
  if (points.empty()) source.fail("it has neither a face nor a vertex");
  if (cloud.normals.size() != points.size()) cloud.normals.clear();
  set_points(cloud, points);
  return cloud;
}

Polygons read_obj(Source& source) {
  Polygons out;
  std::string text;
  Fields fields;
  while (next_statement(source, text, fields)) {
    if (fields.empty()) continue;
    if (fields[0] == "v") out.vertices.push_back(vertex_of(fields, source));
    if (fields[0] != "f") continue;
    for (std::size_t k = 1; k < fields.size(); ++k)
      out.add_corner(corner_of(fields[k], out.vertices.size(), source), source);
    out.end_face();
  }
  if (out.ends.empty()) source.fail("it has no face");
  check_corners(out, source, 1);
  return out;
}

}  // namespace gpureg::io
