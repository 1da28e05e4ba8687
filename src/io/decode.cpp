// SPDX-License-Identifier: BSD-3-Clause
#include "io/decode.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "files/numbers.hpp"
#include "files/text_file.hpp"

namespace gpureg::io {
namespace {

template <typename T>
T load_as(const char* bytes, bool swap) {
  char local[sizeof(T)];
  std::memcpy(local, bytes, sizeof(T));
  if (swap) std::reverse(local, local + sizeof(T));
  T value;
  std::memcpy(&value, local, sizeof(T));
  return value;
}

template <typename T>
void fill(const char* first, std::size_t stride, bool swap, std::size_t axis,
          std::vector<Eigen::Vector3f>& rows) {
  for (std::size_t row = 0; row < rows.size(); ++row)
    rows[row][static_cast<Eigen::Index>(axis)] =
        static_cast<float>(load_as<T>(first + row * stride, swap));
}

// One branch per column, not per number.
void fill_column(Scalar type, const char* first, std::size_t stride, bool swap, std::size_t axis,
                 std::vector<Eigen::Vector3f>& rows) {
  switch (type) {
    case Scalar::int8:
      return fill<std::int8_t>(first, stride, swap, axis, rows);
    case Scalar::uint8:
      return fill<std::uint8_t>(first, stride, swap, axis, rows);
    case Scalar::int16:
      return fill<std::int16_t>(first, stride, swap, axis, rows);
    case Scalar::uint16:
      return fill<std::uint16_t>(first, stride, swap, axis, rows);
    case Scalar::int32:
      return fill<std::int32_t>(first, stride, swap, axis, rows);
    case Scalar::uint32:
      return fill<std::uint32_t>(first, stride, swap, axis, rows);
    case Scalar::int64:
      return fill<std::int64_t>(first, stride, swap, axis, rows);
    case Scalar::uint64:
      return fill<std::uint64_t>(first, stride, swap, axis, rows);
    case Scalar::float32:
      return fill<float>(first, stride, swap, axis, rows);
    case Scalar::float64:
      return fill<double>(first, stride, swap, axis, rows);
  }
}

// Parses a coordinate. Numbers beyond the range of double round as usual, to infinity or zero.
bool parse_coordinate(std::string_view text, float& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const char* const end = text.data() + text.size();
  double parsed = 0;
  const auto [stop, error] = files::from_chars(text.data(), end, parsed);
  if (stop != end || error == std::errc::invalid_argument) return false;
  if (error == std::errc::result_out_of_range) {
    const bool tiny = text.find("e-") != text.npos || text.find("E-") != text.npos;
    parsed = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    if (text[0] == '-') parsed = -parsed;
  }
  value = static_cast<float>(parsed);
  return true;
}

}  // namespace

ByteOrder host_order() {
  const std::uint16_t one = 1;
  unsigned char first;
  std::memcpy(&first, &one, 1);
  return first == 1 ? ByteOrder::little : ByteOrder::big;
}

double load(Scalar type, const char* bytes, bool swap) {
  switch (type) {
    case Scalar::int8:
      return load_as<std::int8_t>(bytes, swap);
    case Scalar::uint8:
      return load_as<std::uint8_t>(bytes, swap);
    case Scalar::int16:
      return load_as<std::int16_t>(bytes, swap);
    case Scalar::uint16:
      return load_as<std::uint16_t>(bytes, swap);
    case Scalar::int32:
      return load_as<std::int32_t>(bytes, swap);
    case Scalar::uint32:
      return load_as<std::uint32_t>(bytes, swap);
    case Scalar::int64:
      return static_cast<double>(load_as<std::int64_t>(bytes, swap));
    case Scalar::uint64:
      return static_cast<double>(load_as<std::uint64_t>(bytes, swap));
    case Scalar::float32:
      return load_as<float>(bytes, swap);
    case Scalar::float64:
      break;
  }
  return load_as<double>(bytes, swap);
}

PointCloud decode_binary(const Table& table, const Source& source, const char* body, Order order,
                         ByteOrder bytes) {
  const Axes axes = find_axes(table, source);
  const bool swap = bytes != host_order();
  std::vector<std::size_t> offsets;
  std::size_t offset = 0;
  for (const Column& column : table.columns) {
    offsets.push_back(offset);
    offset += column.count * size_of(column.type);
  }
  const auto read = [&](const std::array<std::size_t, 3>& columns) {
    std::vector<Eigen::Vector3f> rows(table.rows);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t k = columns[axis];
      const Scalar type = table.columns[k].type;
      const bool by_row = order == Order::by_row;
      fill_column(type, body + (by_row ? offsets[k] : offsets[k] * table.rows),
                  by_row ? offset : size_of(type), swap, axis, rows);
    }
    return rows;
  };
  PointCloud cloud;
  cloud.points = read(axes.point);
  if (axes.normal) cloud.normals = read(*axes.normal);
  return cloud;
}

PointCloud decode_text(const Table& table, Source& source) {
  const Axes axes = find_axes(table, source);
  const std::size_t values = table.values_per_row();
  check_text_size(table.rows, values, source);
  std::vector<std::size_t> first_value;  // where each column starts in a line
  std::size_t sum = 0;
  for (const Column& column : table.columns) {
    first_value.push_back(sum);
    sum += column.count;
  }
  std::vector<std::string_view> fields;
  std::string_view line;
  const auto read = [&](const std::array<std::size_t, 3>& columns) {
    Eigen::Vector3f row;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view text = fields[first_value[columns[axis]]];
      if (!parse_coordinate(text, row[static_cast<Eigen::Index>(axis)]))
        source.fail_line(table.columns[columns[axis]].name + " is " + files::quoted(text) +
                         ", expected a number");
    }
    return row;
  };
  PointCloud cloud;
  cloud.points.reserve(table.rows);
  if (axes.normal) cloud.normals.reserve(table.rows);
  while (cloud.points.size() < table.rows) {
    if (!source.next_line(line))
      source.fail("truncated: the header announces " + std::to_string(table.rows) +
                  " points, the file ends after " + std::to_string(cloud.points.size()));
    split(line, fields);
    if (fields.empty()) continue;
    if (fields.size() != values)
      source.fail_line("point " + std::to_string(cloud.points.size() + 1) + " has " +
                       std::to_string(fields.size()) + " values, expected " +
                       std::to_string(values));
    cloud.points.push_back(read(axes.point));
    if (axes.normal) cloud.normals.push_back(read(*axes.normal));
  }
  return cloud;
}

void check_text_size(std::size_t rows, std::size_t values_per_row, const Source& source) {
  // A value takes a digit and a separator, and only the last one of the file can do without.
  const std::size_t most =
      values_per_row == 0 ? rows : (source.rest().size() + 1) / 2 / values_per_row;
  if (rows > most)
    source.fail("truncated: the header announces " + std::to_string(rows) + " rows of " +
                std::to_string(values_per_row) + " values, but only " +
                std::to_string(source.rest().size()) + " bytes follow");
}

}  // namespace gpureg::io
