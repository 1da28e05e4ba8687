// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

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

/// The whole text as a number. Those beyond the range of double become infinity or zero. Knows how
/// programs of any system write what is no number: nan, -nan(ind), 1.#QNAN, -1.#IND, 1.#INF.
bool parse_coordinate(std::string_view text, double& value);

/// The cloud in table.rows * table.bytes_per_row() bytes of body. Throws IoError for a table
/// without coordinates.
PointCloud decode_binary(const Table& table, const Source& source, const char* body, Order order,
                         ByteOrder bytes);

/// The cloud in the next table.rows lines that are not blank. Throws IoError naming the line that
/// is malformed or missing.
/// @param drop_lists takes what is no column of the table out of the fields of a line; may be
/// empty.
PointCloud decode_text(
    const Table& table, Source& source,
    const std::function<void(std::vector<std::string_view>&)>& drop_lists = nullptr);

/// Passes the lines that follow what the header announces, and notes how many they are.
void note_further_lines(Source& source);

/// Throws IoError unless the rest of the source can hold `rows` rows: the size of the file bounds
/// the allocation.
void check_text_size(std::size_t rows, std::size_t values_per_row, const Source& source);

}  // namespace gpureg::io
