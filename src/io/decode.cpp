// SPDX-License-Identifier: BSD-3-Clause
#include "io/decode.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <utility>

#include "common/float_origin.hpp"
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

// Numbers of one coordinate: those of all rows, a stride apart.
struct Numbers {
  Scalar type;
  const char* first;
  std::size_t stride;
};

template <typename T>
void fill(const Numbers& from, bool swap, Eigen::Index axis, double shift,
          std::vector<Eigen::Vector3f>& rows) {
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const T value = load_as<T>(from.first + row * from.stride, swap);
    rows[row][axis] = shift == 0 ? static_cast<float>(value)
                                 : static_cast<float>(static_cast<double>(value) - shift);
  }
}

// One branch per column, not per number.
void fill_column(const Numbers& from, bool swap, Eigen::Index axis, double shift,
                 std::vector<Eigen::Vector3f>& rows) {
  switch (from.type) {
    case Scalar::int8:
      return fill<std::int8_t>(from, swap, axis, shift, rows);
    case Scalar::uint8:
      return fill<std::uint8_t>(from, swap, axis, shift, rows);
    case Scalar::int16:
      return fill<std::int16_t>(from, swap, axis, shift, rows);
    case Scalar::uint16:
      return fill<std::uint16_t>(from, swap, axis, shift, rows);
    case Scalar::int32:
      return fill<std::int32_t>(from, swap, axis, shift, rows);
    case Scalar::uint32:
      return fill<std::uint32_t>(from, swap, axis, shift, rows);
    case Scalar::int64:
      return fill<std::int64_t>(from, swap, axis, shift, rows);
    case Scalar::uint64:
      return fill<std::uint64_t>(from, swap, axis, shift, rows);
    case Scalar::float32:
      return fill<float>(from, swap, axis, shift, rows);
    case Scalar::float64:
      return fill<double>(from, swap, axis, shift, rows);
  }
}

std::vector<Eigen::Vector3d> sample_of(const Table& table,
                                       const std::array<std::size_t, 3>& columns,
                                       const std::function<Numbers(std::size_t)>& numbers,
                                       bool swap) {
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t row = 0; row < table.rows; row += origin_sample_step(table.rows)) {
    const auto value = [&](std::size_t axis) {
      const Numbers from = numbers(columns[axis]);
      return load(from.type, from.first + row * from.stride, swap);
    };
    sample.emplace_back(value(0), value(1), value(2));
  }
  return sample;
}

/// What the C library of Windows prints for NaN and infinity.
bool parse_not_finite(std::string_view text, double& value) {
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) text.remove_prefix(1);
  const auto begins = [&](std::string_view with) { return text.substr(0, with.size()) == with; };
  if (begins("1.#INF")) {
    value = negative ? -std::numeric_limits<double>::infinity()
                     : std::numeric_limits<double>::infinity();
    return true;
  }
  value = std::numeric_limits<double>::quiet_NaN();
  const bool in_parentheses = begins("nan(") && text.back() == ')';
  return in_parentheses || begins("1.#IND") || begins("1.#QNAN") || begins("1.#SNAN");
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

bool parse_coordinate(std::string_view text, double& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const char* const end = text.data() + text.size();
  value = 0;
  const auto [stop, error] = files::from_chars(text.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return parse_not_finite(text, value);
  if (error == std::errc::result_out_of_range) {
    const bool tiny = text.find("e-") != text.npos || text.find("E-") != text.npos;
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    if (text[0] == '-') value = -value;
  }
  return true;
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
  const auto numbers = [&](std::size_t k) {
    const Scalar type = table.columns[k].type;
    if (order == Order::by_row) return Numbers{type, body + offsets[k], offset};
    return Numbers{type, body + offsets[k] * table.rows, size_of(type)};
  };
  const auto read = [&](const std::array<std::size_t, 3>& columns, const Eigen::Vector3d& origin) {
    std::vector<Eigen::Vector3f> rows(table.rows);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      fill_column(numbers(columns[k]), swap, axis, origin[axis], rows);
    }
    return rows;
  };
  PointCloud cloud;
  cloud.origin = float_origin(sample_of(table, axes.point, numbers, swap));
  cloud.points = read(axes.point, cloud.origin);
  if (axes.normal) cloud.normals = read(*axes.normal, Eigen::Vector3d::Zero());
  return cloud;
}

PointCloud decode_text(const Table& table, Source& source,
                       const std::function<void(std::vector<std::string_view>&)>& drop_lists) {
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
    Eigen::Vector3d row;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view text = fields[first_value[columns[axis]]];
      if (!parse_coordinate(text, row[static_cast<Eigen::Index>(axis)]))
        source.fail_line(table.columns[columns[axis]].name + " is " + files::in_quotes(text) +
                         ", expected a number");
    }
    return row;
  };
  PointCloud cloud;
  std::vector<Eigen::Vector3d> points;
  points.reserve(table.rows);
  if (axes.normal) cloud.normals.reserve(table.rows);
  while (points.size() < table.rows) {
    if (!source.next_line(line))
      source.fail("truncated: the header announces " + std::to_string(table.rows) +
                  " points, the file ends after " + std::to_string(points.size()));
    split(line, fields);
    if (fields.empty()) continue;
    if (drop_lists) drop_lists(fields);
    if (fields.size() != values)
      source.fail_line("point " + std::to_string(points.size() + 1) + " has " +
                       std::to_string(fields.size()) + " values, expected " +
                       std::to_string(values));
    points.push_back(read(axes.point));
    if (axes.normal) cloud.normals.push_back(read(*axes.normal).cast<float>());
  }
  set_points(cloud, points);
  return cloud;
}

void note_further_lines(Source& source) {
  std::size_t further = 0;
  std::string_view line;
  while (source.next_line(line)) further += line.find_first_not_of(" \t") != line.npos;
  if (further > 0)
    source.note(std::to_string(further) + (further == 1 ? " line was" : " lines were") +
                " left out, after those that the header announces");
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
