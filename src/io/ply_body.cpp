// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "files/text_file.hpp"
#include "io/decode.hpp"
#include "io/meshes/mesh_formats.hpp"
#include "io/ply.hpp"

namespace gpureg::io {
namespace {

[[noreturn]] void fail_truncated(const PlyElement& element, const Source& source) {
  source.fail("truncated: the header announces " + std::to_string(element.count) + " of element " +
              element.name + ", but the file ends before");
}

// Bytes of an element without lists, which the rest of the file must have.
std::size_t checked_bytes(const PlyElement& element, const Source& source) {
  const std::size_t row = element.table().bytes_per_row();
  if (row != 0 && element.count > source.rest().size() / row)
    source.fail("truncated: the header announces " + std::to_string(element.count) +
                " of element " + element.name + ", " + std::to_string(row) +
                " bytes each, but only " + std::to_string(source.rest().size()) + " bytes follow");
  return row * element.count;
}

// Lists have a size of their own in every row, so rows are walked one by one. Each takes at least a
// byte: no count can make it hang. take(property, count, first) sees every property.
template <typename Take>
void walk_binary_lists(const PlyElement& element, Source& source, bool swap, Take&& take) {
  const std::string_view bytes = source.rest();
  std::size_t at = 0;
  const auto pass = [&](std::size_t size) {
    if (size > bytes.size() - at) fail_truncated(element, source);
    at += size;
  };
  for (std::size_t row = 0; row < element.count; ++row)
    for (const PlyProperty& property : element.properties) {
      const std::size_t size = size_of(property.column.type);
      if (!property.list_count) {
        pass(size);
        take(property, std::size_t{1}, bytes.data() + at - size);
        continue;
      }
      const std::size_t before = at;
      pass(size_of(*property.list_count));
      const double number = load(*property.list_count, bytes.data() + before,
                                 swap);  // integers of at most 32 bits: exact
      if (number < 0) source.fail("a list of element " + element.name + " has a negative count");
      const auto count = static_cast<std::size_t>(number);
      pass(count * size);
      take(property, count, bytes.data() + at - count * size);
    }
  source.skip(at);
}

void skip_binary(const PlyElement& element, Source& source, bool swap) {
  if (element.has_list()) return walk_binary_lists(element, source, swap, [](auto&&...) {});
  source.skip(checked_bytes(element, source));
}

void skip_text(const PlyElement& element, Source& source) {
  check_text_size(element.count, element.properties.size(), source);
  if (element.properties.empty()) return;
  std::string_view line;
  for (std::size_t row = 0; row < element.count;) {
    if (!source.next_line(line)) fail_truncated(element, source);
    row += line.find_first_not_of(" \t") != line.npos;
  }
}

bool lists_corners(const PlyProperty& property) {
  return property.list_count &&
         (property.column.name == "vertex_indices" || property.column.name == "vertex_index");
}

void read_binary_faces(const PlyElement& element, Source& source, bool swap, Polygons& faces) {
  walk_binary_lists(element, source, swap,
                    [&](const PlyProperty& property, std::size_t count, const char* first) {
                      if (!lists_corners(property)) return;
                      const Scalar type = property.column.type;
                      for (std::size_t k = 0; k < count; ++k)
                        faces.add_corner(load(type, first + k * size_of(type), swap), source);
                      faces.end_face();
                    });
}

void read_text_faces(const PlyElement& element, Source& source, Polygons& faces) {
  check_text_size(element.count, element.properties.size(), source);
  std::string_view line;
  std::vector<std::string_view> fields;
  for (std::size_t row = 0; row < element.count;) {
    if (!source.next_line(line)) fail_truncated(element, source);
    split(line, fields);
    if (fields.empty()) continue;
    ++row;
    std::size_t at = 0;
    for (const PlyProperty& property : element.properties) {
      std::size_t count = 1;
      if (property.list_count && (at >= fields.size() || !parse_count(fields[at++], count)))
        source.fail_line("the count of a list of element " + element.name + " is missing");
      if (count > fields.size() - at)
        source.fail_line("element " + element.name + " has " + std::to_string(fields.size()) +
                         " values, fewer than its lists announce");
      for (std::size_t k = 0; lists_corners(property) && k < count; ++k) {
        double vertex = 0;
        if (!parse_coordinate(fields[at + k], vertex))
          source.fail_line("a vertex of a face is " + files::in_quotes(fields[at + k]) +
                           ", expected a number");
        faces.add_corner(vertex, source);
      }
      at += count;
      if (lists_corners(property)) faces.end_face();
    }
  }
}

// A count that is too small shows as points left over. Less than one point may be padding or a
// final line end.
void check_nothing_left(const PlyElement& last, Source& source, bool text) {
  if (text) {
    note_further_lines(source);
  } else if (!last.has_list() &&
             source.rest().size() >= std::max<std::size_t>(last.table().bytes_per_row(), 1)) {
    source.fail(std::to_string(source.rest().size()) + " bytes more than the header announces, " +
                std::to_string(last.count) + " of element " + last.name);
  }
}

// The other properties of vertices that have lists.
PointCloud read_binary_with_lists(const PlyElement& element, Source& source, ByteOrder order) {
  std::string rows;
  walk_binary_lists(element, source, order != host_order(),
                    [&](const PlyProperty& property, std::size_t, const char* first) {
                      if (!property.list_count) rows.append(first, size_of(property.column.type));
                    });
  return decode_binary(element.table(), source, rows.data(), Order::by_row, order);
}

PointCloud read_text_with_lists(const PlyElement& element, Source& source) {
  return decode_text(element.table(), source, [&](std::vector<std::string_view>& fields) {
    std::size_t from = 0, to = 0;
    for (const PlyProperty& property : element.properties) {
      std::size_t count = 0;
      if (from >= fields.size() || (property.list_count && !parse_count(fields[from], count)) ||
          count > fields.size() - from - 1)
        source.fail_line("a vertex has " + std::to_string(fields.size()) +
                         " values, fewer than its lists announce");
      if (!property.list_count) fields[to++] = fields[from];
      from += 1 + count;
    }
    if (from == fields.size()) fields.resize(to);
  });
}

PointCloud read_vertices(const PlyElement& element, Source& source, bool text, ByteOrder order) {
  check_rows(element.count, source);
  if (element.has_list())
    return text ? read_text_with_lists(element, source)
                : read_binary_with_lists(element, source, order);
  if (text) return decode_text(element.table(), source);
  const std::size_t bytes = checked_bytes(element, source);
  PointCloud cloud =
      decode_binary(element.table(), source, source.rest().data(), Order::by_row, order);
  source.skip(bytes);
  return cloud;
}

/// faces: where they go; null: they are skipped.
PointCloud read(Source& source, Polygons* faces) {
  const PlyHeader header = read_ply_header(source);
  const auto is_vertex = [](const PlyElement& element) { return element.name == "vertex"; };
  const auto vertices = std::count_if(header.elements.begin(), header.elements.end(), is_vertex);
  if (vertices != 1)
    source.fail("the header declares " + std::to_string(vertices) +
                " elements named vertex, expected 1");

  const bool text = header.format == PlyFormat::ascii;
  const ByteOrder order =
      header.format == PlyFormat::binary_big_endian ? ByteOrder::big : ByteOrder::little;
  PointCloud cloud;
  for (const PlyElement& element : header.elements) {
    if (faces != nullptr && element.name == "face" && element.has_list()) {
      text ? read_text_faces(element, source, *faces)
           : read_binary_faces(element, source, order != host_order(), *faces);
      continue;
    }
    if (!is_vertex(element)) {
      text ? skip_text(element, source) : skip_binary(element, source, order != host_order());
      continue;
    }
    cloud = read_vertices(element, source, text, order);
  }
  check_nothing_left(header.elements.back(), source, text);
  return cloud;
}

}  // namespace

PointCloud read_ply(Source& source) { return read(source, nullptr); }

Polygons read_ply_mesh(Source& source) {
  Polygons out;
  const PointCloud cloud = read(source, &out);
  if (out.ends.empty()) source.fail("it has no face: no list vertex_indices of an element face");
  for (const Eigen::Vector3f& p : cloud.points)
    out.vertices.push_back(p.cast<double>() + cloud.origin);
  check_corners(out, source, 0);
  return out;
}

}  // namespace gpureg::io
