// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "io/decode.hpp"
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
// byte: no count can make it hang.
void skip_binary_lists(const PlyElement& element, Source& source, bool swap) {
  const std::string_view bytes = source.rest();
  std::size_t at = 0;
  const auto take = [&](std::size_t size) {
    if (size > bytes.size() - at) fail_truncated(element, source);
    at += size;
  };
  for (std::size_t row = 0; row < element.count; ++row)
    for (const PlyProperty& property : element.properties) {
      const std::size_t size = size_of(property.column.type);
      if (!property.list_count) {
        take(size);
        continue;
      }
      const std::size_t before = at;
      take(size_of(*property.list_count));
      const double count = load(*property.list_count, bytes.data() + before,
                                swap);  // integers of at most 32 bits: exact
      if (count < 0) source.fail("a list of element " + element.name + " has a negative count");
      take(static_cast<std::size_t>(count) * size);
    }
  source.skip(at);
}

void skip_binary(const PlyElement& element, Source& source, bool swap) {
  if (element.has_list()) return skip_binary_lists(element, source, swap);
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

// A count that is too small shows as points left over. Less than one point may be padding or a
// final line end.
void check_nothing_left(const PlyElement& last, Source& source, bool text) {
  if (text) {
    std::string_view line;
    while (source.next_line(line))
      if (line.find_first_not_of(" \t") != line.npos)
        source.fail_line("more data than the header announces, " + std::to_string(last.count) +
                         " of element " + last.name);
  } else if (!last.has_list() &&
             source.rest().size() >= std::max<std::size_t>(last.table().bytes_per_row(), 1)) {
    source.fail(std::to_string(source.rest().size()) + " bytes more than the header announces, " +
                std::to_string(last.count) + " of element " + last.name);
  }
}

}  // namespace

PointCloud read_ply(Source& source) {
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
    if (!is_vertex(element)) {
      text ? skip_text(element, source) : skip_binary(element, source, order != host_order());
      continue;
    }
    if (element.has_list())
      source.fail("element vertex has a property list, which is not supported");
    check_rows(element.count, source);
    if (text) {
      cloud = decode_text(element.table(), source);
    } else {
      const std::size_t bytes = checked_bytes(element, source);
      cloud = decode_binary(element.table(), source, source.rest().data(), Order::by_row, order);
      source.skip(bytes);
    }
  }
  check_nothing_left(header.elements.back(), source, text);
  return cloud;
}

}  // namespace gpureg::io
