// SPDX-License-Identifier: BSD-3-Clause
#include "io/table.hpp"

#include <algorithm>
#include <initializer_list>

#include "common/limits.hpp"
#include "files/text_file.hpp"

namespace gpureg::io {

std::size_t size_of(Scalar type) {
  switch (type) {
    case Scalar::int8:
    case Scalar::uint8:
      return 1;
    case Scalar::int16:
    case Scalar::uint16:
      return 2;
    case Scalar::int32:
    case Scalar::uint32:
    case Scalar::float32:
      return 4;
    default:
      return 8;
  }
}

std::size_t Table::values_per_row() const {
  std::size_t sum = 0;
  for (const Column& column : columns) sum += column.count;
  return sum;
}

std::size_t Table::bytes_per_row() const {
  std::size_t sum = 0;
  for (const Column& column : columns) sum += column.count * size_of(column.type);
  return sum;
}

namespace {

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// A column of exactly that name, or else of one that differs in case: PDAL writes X Y Z.
std::optional<std::size_t> find(const Table& table, std::initializer_list<const char*> names,
                                const Source& source, bool exactly = true) {
  std::optional<std::size_t> found;
  for (std::size_t k = 0; k < table.columns.size(); ++k)
    for (const char* name : names) {
      if ((exactly ? table.columns[k].name : lower_case(table.columns[k].name)) != name) continue;
      if (found) source.fail(std::string("the header declares ") + name + " twice");
      if (table.columns[k].count != 1)
        source.fail(std::string("the header gives ") + name + " several values per point");
      found = k;
    }
  return found || !exactly ? found : find(table, names, source, false);
}

/// Names of the columns, for a message.
std::string names_of(const Table& table) {
  constexpr std::size_t kShown = 12;
  std::string text;
  for (std::size_t k = 0; k < std::min(kShown, table.columns.size()); ++k)
    text += (k == 0 ? "" : ", ") + files::in_quotes(table.columns[k].name);
  return table.columns.size() > kShown ? text + ", ..." : text;
}

}  // namespace

Axes find_axes(const Table& table, const Source& source) {
  Axes axes;
  const char* const names[3] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = find(table, {names[k]}, source);
    if (!column)
      source.fail(std::string("the points have no coordinate ") + names[k] + ", only " +
                  (table.columns.empty() ? "nothing" : names_of(table)));
    axes.point[k] = *column;
  }
  // Names of normals in PLY and in PCL.
  const auto nx = find(table, {"nx", "normal_x"}, source);
  const auto ny = find(table, {"ny", "normal_y"}, source);
  const auto nz = find(table, {"nz", "normal_z"}, source);
  if (nx && ny && nz) axes.normal = {*nx, *ny, *nz};
  return axes;
}

void check_rows(std::size_t rows, const Source& source) {
  if (rows > limits::kMaxPoints)
    source.fail("the header announces " + std::to_string(rows) +
                " points, more than the limit of 2^31 - 1");
}

}  // namespace gpureg::io
