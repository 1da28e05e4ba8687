// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/pcd.hpp"

#include <cmath>
#include <optional>

#include "files/numbers.hpp"
#include "files/text_file.hpp"
#include "io/clouds/lzf.hpp"
#include "io/decode.hpp"
#include "io/table.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;
using files::in_quotes;

enum class Data { ascii, binary, binary_compressed };

struct Header {
  Fields names, sizes, types, counts;
  std::optional<std::size_t> width, height, points;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  Data data = Data::ascii;
};

Fields values_of(const Fields& fields) { return {fields.begin() + 1, fields.end()}; }

std::size_t count_of(const Fields& fields, const Source& source) {
  std::size_t value = 0;
  if (fields.size() != 2 || !parse_count(fields[1], value))
    source.fail_line("expected: " + std::string(fields[0]) + " <number>");
  return value;
}

Eigen::Vector3d viewpoint_of(const Fields& fields, const Source& source) {
  if (fields.size() != 8) source.fail_line("expected: VIEWPOINT tx ty tz qw qx qy qz");
  Eigen::Vector3d t;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string_view text = fields[k + 1];
    double value = 0;
    const auto [stop, error] = files::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stop != text.data() + text.size() ||
        !std::isfinite(static_cast<float>(value)))
      source.fail_line("VIEWPOINT has " + in_quotes(text) + ", expected a finite number");
    t[static_cast<Eigen::Index>(k)] = value;
  }
  return t;
}

Data data_of(const Fields& fields, const Source& source) {
  if (fields.size() == 2) {
    if (fields[1] == "ascii") return Data::ascii;
    if (fields[1] == "binary") return Data::binary;
    if (fields[1] == "binary_compressed") return Data::binary_compressed;
  }
  source.fail_line("expected: DATA ascii, binary or binary_compressed");
}

Header read_header(Source& source) {
  Header header;
  std::string_view line;
  Fields fields;
  while (source.next_line(line)) {
    split(line, fields);
    if (fields.empty() || fields[0][0] == '#' || fields[0] == "VERSION") continue;
    if (fields[0] == "FIELDS" || fields[0] == "COLUMNS") {
      header.names = values_of(fields);
    } else if (fields[0] == "SIZE") {
      header.sizes = values_of(fields);
    } else if (fields[0] == "TYPE") {
      header.types = values_of(fields);
    } else if (fields[0] == "COUNT") {
      header.counts = values_of(fields);
    } else if (fields[0] == "WIDTH") {
      header.width = count_of(fields, source);
    } else if (fields[0] == "HEIGHT") {
      header.height = count_of(fields, source);
    } else if (fields[0] == "POINTS") {
      header.points = count_of(fields, source);
    } else if (fields[0] == "VIEWPOINT") {
      header.viewpoint = viewpoint_of(fields, source);
    } else if (fields[0] == "DATA") {
      header.data = data_of(fields, source);
      return header;
    } else {
      source.fail_line("unknown keyword " + in_quotes(fields[0]));
    }
  }
  source.fail("the header has no line: DATA");
}

Scalar scalar_type(std::string_view type, std::string_view size, std::string_view name,
                   const Source& source) {
  if (type == "F" && size == "4") return Scalar::float32;
  if (type == "F" && size == "8") return Scalar::float64;
  if (type == "I" || type == "U") {
    const bool is_signed = type == "I";
    if (size == "1") return is_signed ? Scalar::int8 : Scalar::uint8;
    if (size == "2") return is_signed ? Scalar::int16 : Scalar::uint16;
    if (size == "4") return is_signed ? Scalar::int32 : Scalar::uint32;
    if (size == "8") return is_signed ? Scalar::int64 : Scalar::uint64;
  }
  source.fail("field " + in_quotes(name) + " has type " + in_quotes(type) + " and size " +
              in_quotes(size) + ", expected F of 4 or 8, I or U of 1, 2, 4 or 8");
}

std::size_t rows_of(const Header& header, const Source& source) {
  // An older writer may leave POINTS, another HEIGHT; where they are there they must agree.
  if (!header.width && !header.points) source.fail("the header has neither WIDTH nor POINTS");
  if (!header.width) return *header.points;
  const std::size_t height = header.height.value_or(1);
  check_rows(*header.width, source);
  check_rows(height, source);
  const std::size_t product = *header.width * height;  // below 2^62
  if (header.points && *header.points != product)
    source.fail("WIDTH x HEIGHT is " + std::to_string(product) + ", but POINTS is " +
                std::to_string(*header.points));
  return product;
}

Table table_of(const Header& header, const Source& source) {
  const auto check = [&](const char* what, std::size_t size) {
    if (size != header.names.size())
      source.fail(std::string(what) + " has " + std::to_string(size) + " entries, but FIELDS has " +
                  std::to_string(header.names.size()));
  };
  if (header.names.empty()) source.fail("the header has no line: FIELDS");
  check("SIZE", header.sizes.size());
  check("TYPE", header.types.size());
  if (!header.counts.empty()) check("COUNT", header.counts.size());
  Table table;
  table.rows = rows_of(header, source);
  check_rows(table.rows, source);
  for (std::size_t k = 0; k < header.names.size(); ++k) {
    Column column{std::string(header.names[k]),
                  scalar_type(header.types[k], header.sizes[k], header.names[k], source)};
    // The bound keeps every product of sizes below 2^63.
    constexpr std::size_t kMaxCount = 65536;
    if (!header.counts.empty() && (!parse_count(header.counts[k], column.count) ||
                                   column.count < 1 || column.count > kMaxCount))
      source.fail("field " + in_quotes(column.name) + " has COUNT " + in_quotes(header.counts[k]) +
                  ", expected 1 to 65536");
    table.columns.push_back(std::move(column));
  }
  return table;
}

// The body that the header announces, which the file must have. A count that is too small shows as
// points left over.
std::string_view checked_body(const Table& table, const Source& source) {
  const std::size_t row = table.bytes_per_row();
  const std::string_view rest = source.rest();
  const std::string announced = "the header announces " + std::to_string(table.rows) +
                                " points of " + std::to_string(row) + " bytes";
  if (table.rows > rest.size() / row)
    source.fail("truncated: " + announced + ", but only " + std::to_string(rest.size()) +
                " bytes follow");
  if (rest.size() - table.rows * row >= row)
    source.fail(announced + ", but " + std::to_string(rest.size()) + " bytes follow");
  return rest;
}

std::string unpack(const Table& table, const Source& source) {
  const std::string_view rest = source.rest();
  if (rest.size() < 8) source.fail("truncated: the sizes of the compressed data are missing");
  const bool swap = host_order() != ByteOrder::little;
  const auto packed_size = static_cast<std::size_t>(load(Scalar::uint32, rest.data(), swap));
  const auto size = static_cast<std::size_t>(load(Scalar::uint32, rest.data() + 4, swap));
  if (packed_size > rest.size() - 8)
    source.fail("truncated: " + std::to_string(packed_size) +
                " bytes of compressed data are announced, but only " +
                std::to_string(rest.size() - 8) + " follow");
  const std::size_t row = table.bytes_per_row();
  if (size / row != table.rows || size % row != 0)  // the product might not fit
    source.fail("the compressed data hold " + std::to_string(size) +
                " bytes, but the header announces " + std::to_string(table.rows) + " points of " +
                std::to_string(table.bytes_per_row()) + " bytes");
  std::string body;
  if (size > packed_size * kLzfGrowth || !lzf_decompress(rest.substr(8, packed_size), size, body))
    source.fail("the compressed data are damaged");
  return body;
}

}  // namespace

bool looks_like_pcd(std::string_view bytes) {
  Source source("", bytes);
  std::string_view line;
  Fields fields;
  while (source.next_line(line)) {
    split(line, fields);
    if (fields.empty() || fields[0][0] == '#') continue;
    return fields[0] == "VERSION" || fields[0] == "FIELDS" || fields[0] == "COLUMNS";
  }
  return false;
}

PointCloud read_pcd(Source& source) {
  const Header header = read_header(source);
  const Table table = table_of(header, source);
  PointCloud cloud;
  if (header.data == Data::ascii) {
    cloud = decode_text(table, source);
    note_further_lines(source);
  } else if (header.data == Data::binary) {
    cloud = decode_binary(table, source, checked_body(table, source).data(), Order::by_row,
                          ByteOrder::little);
  } else {
    cloud = decode_binary(table, source, unpack(table, source).data(), Order::by_column,
                          ByteOrder::little);
  }
  if (!header.viewpoint.isZero(0)) cloud.set_viewpoints({header.viewpoint});
  return cloud;
}

}  // namespace gpureg::io
