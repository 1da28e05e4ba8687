// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/pose_rows.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg::io {
namespace {

using Row = std::vector<double>;
constexpr double kUnit = 1e-3;  ///< deviation of a length from 1, of numbers with few digits

/// Whether the numbers from there on are a vector of length 1.
bool is_unit(const Row& row, std::size_t begin, std::size_t count) {
  double sum = 0;
  for (std::size_t k = begin; k < begin + count; ++k) sum += row[k] * row[k];
  return std::abs(std::sqrt(sum) - 1) < kUnit;
}

bool is_last_row(const Row& row) { return row == Row{0, 0, 0, 1}; }

/// Rows first to first + 3 are a matrix.
bool is_matrix(const std::vector<Row>& rows, std::size_t first) {
  if (rows.size() < first + 4 || !is_last_row(rows[first + 3])) return false;
  for (std::size_t k = first; k < first + 3; ++k)
    if (rows[k].size() != 4 || !is_unit(rows[k], 0, 3)) return false;
  return true;
}

}  // namespace

std::string poses_in(const std::vector<Row>& rows) {
  const auto all = [&](auto&& test) {
    return !rows.empty() && std::all_of(rows.begin(), rows.end(), test);
  };
  if (is_matrix(rows, 0) || (!rows.empty() && rows[0].size() == 3 && is_matrix(rows, 1)))
    return "4 x 4 matrices";
  if (all([](const Row& row) {
        return (row.size() == 12 || row.size() == 16) && is_unit(row, 0, 3) && is_unit(row, 4, 3) &&
               is_unit(row, 8, 3);
      }))
    return "a matrix a line";
  // Normals are of length 1, too: the times of poses ascend.
  const bool ascend = std::adjacent_find(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
                        return a.empty() || b.empty() || !(a[0] < b[0]);
                      }) == rows.end();
  if (ascend && all([](const Row& row) { return row.size() == 8 && is_unit(row, 4, 4); }))
    return "times, positions and quaternions";
  return {};
}

}  // namespace gpureg::io
