// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "files/text_file.hpp"
#include "io/ply.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;
using files::in_quotes;

Scalar scalar_type(std::string_view name, const Source& source) {
  static constexpr std::pair<std::string_view, Scalar> known[] = {
      {"char", Scalar::int8},      {"int8", Scalar::int8},      {"uchar", Scalar::uint8},
      {"uint8", Scalar::uint8},    {"bool", Scalar::uint8},     {"short", Scalar::int16},
      {"int16", Scalar::int16},    {"ushort", Scalar::uint16},  {"uint16", Scalar::uint16},
      {"int", Scalar::int32},      {"int32", Scalar::int32},    {"uint", Scalar::uint32},
      {"uint32", Scalar::uint32},  {"float", Scalar::float32},  {"float32", Scalar::float32},
      {"double", Scalar::float64}, {"float64", Scalar::float64}};
  for (const auto& [text, type] : known)
    if (text == name) return type;
  source.fail_line("unknown type " + in_quotes(name));
}

PlyFormat format_of(const Fields& fields, const Source& source) {
  if (fields.size() != 3 || fields[2] != "1.0") source.fail_line("expected: format <encoding> 1.0");
  if (fields[1] == "ascii") return PlyFormat::ascii;
  if (fields[1] == "binary_little_endian") return PlyFormat::binary_little_endian;
  if (fields[1] == "binary_big_endian") return PlyFormat::binary_big_endian;
  source.fail_line("unknown format " + in_quotes(fields[1]));
}

PlyElement element_of(const Fields& fields, const Source& source) {
  PlyElement element;
  if (fields.size() != 3) source.fail_line("expected: element <name> <count>");
  if (!parse_count(fields[2], element.count))
    source.fail_line("the count of an element is " + in_quotes(fields[2]) + ", expected a number");
  element.name = std::string(fields[1]);
  return element;
}

PlyProperty property_of(const Fields& fields, const Source& source) {
  PlyProperty property;
  if (fields.size() == 5 && fields[1] == "list") {
    property.list_count = scalar_type(fields[2], source);
    if (*property.list_count == Scalar::float32 || *property.list_count == Scalar::float64)
      source.fail_line("the count of a list cannot be a " + in_quotes(fields[2]));
    property.column = {std::string(fields[4]), scalar_type(fields[3], source)};
  } else if (fields.size() == 3 && fields[1] != "list") {
    property.column = {std::string(fields[2]), scalar_type(fields[1], source)};
  } else {
    source.fail_line("expected: property <type> <name>, or: property list <type> <type> <name>");
  }
  return property;
}

}  // namespace

bool PlyElement::has_list() const {
  return std::any_of(properties.begin(), properties.end(),
                     [](const PlyProperty& p) { return p.list_count.has_value(); });
}

Table PlyElement::table() const {
  Table table;
  table.rows = count;
  for (const PlyProperty& property : properties)
    if (!property.list_count) table.columns.push_back(property.column);
  return table;
}

PlyHeader read_ply_header(Source& source) {
  PlyHeader header;
  bool has_format = false;
  std::string_view line;
  Fields fields;
  source.next_line(line);
  split(line, fields);
  if (fields.size() != 1 || fields[0] != "ply")
    source.fail_line("the first line of a PLY file must be: ply");
  while (source.next_line(line)) {
    split(line, fields);
    if (fields.empty() || fields[0] == "comment" || fields[0] == "obj_info") continue;
    if (fields[0] == "end_header") {
      if (!has_format) source.fail_line("the header ends without a line: format");
      return header;
    }
    if (fields[0] == "format") {
      if (has_format) source.fail_line("a second line: format");
      header.format = format_of(fields, source);
      has_format = true;
    } else if (fields[0] == "element") {
      header.elements.push_back(element_of(fields, source));
    } else if (fields[0] == "property") {
      if (header.elements.empty()) source.fail_line("a property before any element");
      header.elements.back().properties.push_back(property_of(fields, source));
    } else {
      source.fail_line("unknown keyword " + in_quotes(fields[0]));
    }
  }
  source.fail("the header has no line: end_header");
}

}  // namespace gpureg::io
