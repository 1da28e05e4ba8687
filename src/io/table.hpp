// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/source.hpp"

namespace gpureg::io {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

std::size_t size_of(Scalar type);

/// Content of both formats: named columns of numbers. count: values per row (1, except for
/// histograms in PCD).
struct Column {
  std::string name;
  Scalar type = Scalar::float32;
  std::size_t count = 1;
};

struct Table {
  std::vector<Column> columns;
  std::size_t rows = 0;

  std::size_t values_per_row() const;
  std::size_t bytes_per_row() const;
};

/// Columns of x, y, z, and of the normal where all three of its coordinates are there.
struct Axes {
  std::array<std::size_t, 3> point{};
  std::optional<std::array<std::size_t, 3>> normal;
};

/// Throws IoError for a table without x, y, z, with one of them twice or with several values in
/// one.
Axes find_axes(const Table& table, const Source& source);

/// Throws IoError for more rows than a cloud may have points.
void check_rows(std::size_t rows, const Source& source);

}  // namespace gpureg::io
