// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <string>

#include "common/float_origin.hpp"
#include "files/text_file.hpp"
#include "io/decode.hpp"
#include "io/meshes/mesh_formats.hpp"
#include "io/table.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;

struct OffHeader {
  std::size_t vertices = 0, faces = 0;
  bool normals = false;  ///< behind the coordinates of a vertex
};

constexpr char kComment = '#';

/// The word that begins the file, up to OFF: "CN" of CNOFF.
std::string_view prefix_of(std::string_view word) { return word.substr(0, word.find("OFF")); }

OffHeader read_off_header(Source& source) {
  Fields fields;
  next_fields(source, fields, kComment);
  OffHeader header;
  const std::string_view prefix = prefix_of(fields[0]);
  if (prefix.find_first_of("4n") != prefix.npos)
    source.fail_line("vertices of another dimension than three are not read");
  header.normals = prefix.find('N') != prefix.npos;
  // Some files have the counts right behind the word, even without a blank.
  fields[0].remove_prefix(prefix.size() + 3);
  if (fields[0].empty()) fields.erase(fields.begin());
  if (!fields.empty() && fields[0] == "BINARY") source.fail_line("binary OFF is not read");
  if (fields.empty() && !next_fields(source, fields, kComment))
    source.fail("truncated: the numbers of vertices and faces are missing");
  if (fields.size() < 2 || !parse_count(fields[0], header.vertices) ||
      !parse_count(fields[1], header.faces))
    source.fail_line("expected the numbers of vertices, faces and edges");
  check_rows(header.vertices, source);
  return header;
}

/// take(coordinates, normal), the normal only where the file has them.
template <typename Take>
void read_vertices(const OffHeader& header, Source& source, Take&& take) {
  const std::size_t numbers = header.normals ? 6 : 3;
  check_text_size(header.vertices, numbers, source);
  Fields fields;
  std::array<double, 6> p{};
  for (std::size_t vertex = 0; vertex < header.vertices; ++vertex) {
    if (!next_fields(source, fields, kComment))
      source.fail("truncated: " + std::to_string(header.vertices) +
                  " vertices are announced, the file ends after " + std::to_string(vertex));
    if (fields.size() < numbers)
      source.fail_line("vertex " + std::to_string(vertex + 1) + " has " +
                       std::to_string(fields.size()) + " values, expected " +
                       std::to_string(numbers));
    for (std::size_t k = 0; k < numbers; ++k)
      if (!parse_coordinate(fields[k], p[k]))
        source.fail_line("a coordinate is " + files::in_quotes(fields[k]) + ", expected a number");
    take(Eigen::Vector3d(p[0], p[1], p[2]), Eigen::Vector3d(p[3], p[4], p[5]));
  }
}

}  // namespace

bool looks_like_off(std::string_view start) {
  Source source("", start);
  Fields fields;
  if (!next_fields(source, fields, kComment)) return false;
  const std::string_view word = fields[0], prefix = prefix_of(word);
  if (prefix.size() == word.size() || prefix.find_first_not_of("STCN4n") != prefix.npos)
    return false;
  const std::string_view behind = word.substr(prefix.size() + 3);
  std::size_t count = 0;
  return behind.empty() || parse_count(behind, count);
}

bool off_has_faces(Source& source) { return read_off_header(source).faces > 0; }

Polygons read_off(Source& source) {
  const OffHeader header = read_off_header(source);
  Polygons out;
  read_vertices(header, source, [&](const Eigen::Vector3d& p, const Eigen::Vector3d&) {
    out.vertices.push_back(p);
  });
  check_text_size(header.faces, 1, source);
  Fields fields;
  for (std::size_t face = 0; face < header.faces; ++face) {
    if (!next_fields(source, fields, kComment))
      source.fail("truncated: " + std::to_string(header.faces) +
                  " faces are announced, the file ends after " + std::to_string(face));
    std::size_t corners = 0;
    if (!parse_count(fields[0], corners) || corners > fields.size() - 1)
      source.fail_line("expected a face: the number of its corners, and their vertices");
    for (std::size_t k = 1; k <= corners; ++k) {
      double vertex = 0;
      if (!parse_coordinate(fields[k], vertex))
        source.fail_line("a vertex of a face is " + files::in_quotes(fields[k]) +
                         ", expected a number");
      out.add_corner(vertex, source);
    }
    out.end_face();
  }
  if (out.ends.empty()) source.fail("it has no face");
  check_corners(out, source, 0);
  return out;
}

PointCloud read_off_points(Source& source) {
  const OffHeader header = read_off_header(source);
  PointCloud cloud;
  std::vector<Eigen::Vector3d> points;
  read_vertices(header, source, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    points.push_back(p);
    if (header.normals) cloud.normals.push_back(n.cast<float>());
  });
  set_points(cloud, points);
  return cloud;
}

}  // namespace gpureg::io
