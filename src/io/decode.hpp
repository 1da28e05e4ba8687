// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"
#include "io/table.hpp"

namespace gpureg::io {

enum class ByteOrder { little, big };
enum class Order {
  by_row,
  by_column
};  ///< by_column: all of x, then all of y, ... (PCD's compressed form)

ByteOrder host_order();

/// One number, wherever it lies.
double load(Scalar type, const char* bytes, bool swap);

/// The whole text as a number. Those beyond the range of double become infinity or zero.
bool parse_coordinate(std::string_view text, double& value);

/// The cloud in table.rows * table.bytes_per_row() bytes of body. Throws IoError for a table
/// without coordinates.
PointCloud decode_binary(const Table& table, const Source& source, const char* body, Order order,
                         ByteOrder bytes);

/// The cloud in the next table.rows lines that are not blank. Throws IoError naming the line that
/// is malformed or missing.
PointCloud decode_text(const Table& table, Source& source);

/// Throws IoError unless the rest of the source can hold `rows` rows: the size of the file bounds
/// the allocation.
void check_text_size(std::size_t rows, std::size_t values_per_row, const Source& source);

}  // namespace gpureg::io
