// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"

/// Redwood's .log and .info share one layout: a line `i j n`, then a square matrix row by row.
/// Private to the library.
namespace gpureg::files {

/// Calls take(file, i, j, n, matrix, line) for each block of the file; line: where it begins.
/// Throws IoError naming file and line.
template <int Size, typename Take>
void read_blocks(const std::string& path, Take&& take) {
  const auto columns = std::to_string(Size);
  TextFile file(path, '#');
  while (file.next()) {
    if (file.fields().size() != 3)
      file.fail("a block starts with " + std::to_string(file.fields().size()) +
                " fields, expected 3: i j n");
    const int line = static_cast<int>(file.line());
    const int i = file.index(0, "i"), j = file.index(1, "j"), n = file.index(2, "n");
    Eigen::Matrix<double, Size, Size> matrix;
    for (int row = 0; row < Size; ++row) {
      const auto where = "row " + std::to_string(row + 1) + " of the matrix of pair " +
                         std::to_string(i) + " " + std::to_string(j);
      if (!file.next()) file.fail("the file ends before " + where);
      if (file.fields().size() != Size)
        file.fail(where + " has " + std::to_string(file.fields().size()) + " fields, expected " +
                  columns);
      for (int column = 0; column < Size; ++column)
        matrix(row, column) = file.number(static_cast<std::size_t>(column), where.c_str());
    }
    take(file, i, j, n, matrix, line);
  }
}

/// Appends `i j n` and the matrix with that many decimals. what names the matrix. Throws
/// InvalidArgument for a matrix that no reader would take back.
template <int Size, int Options>
void append_block(std::string& text, int i, int j, int n,
                  const Eigen::Matrix<double, Size, Size, Options>& matrix, int decimals,
                  const char* what) {
  const auto pair = std::to_string(i) + "\t" + std::to_string(j);
  if (i < 0 || j < 0 || n < 0)
    throw InvalidArgument(std::string(what) + " of pair " + pair +
                          ": i, j and count must not be negative");
  text += pair + "\t" + std::to_string(n) + "\n";
  for (int row = 0; row < Size; ++row) {
    for (int column = 0; column < Size; ++column) {
      const double value = matrix(row, column);
      if (!std::isfinite(value))
        throw InvalidArgument(std::string(what) + "(" + std::to_string(row) + ", " +
                              std::to_string(column) + ") of pair " + pair + " is " +
                              std::to_string(value) + ", expected a finite number");
      char digits[400];  // the largest double has 309 digits before the point
      const auto end =
          std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals)
              .ptr;
      text.append(digits, end);
      text += column + 1 < Size ? '\t' : '\n';
    }
  }
}

}  // namespace gpureg::files
