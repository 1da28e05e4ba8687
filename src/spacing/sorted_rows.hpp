// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/radix_sort.hpp"

namespace gpureg {

inline void sort_by_coordinates(std::vector<Eigen::Vector3f>::iterator first,
                                std::vector<Eigen::Vector3f>::iterator last) {
  constexpr std::ptrdiff_t kFew = 4096;  // the buckets of a radix sort cost more
  if (last - first < kFew) {
    std::sort(first, last, [](const Eigen::Vector3f& p, const Eigen::Vector3f& q) {
      return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    });
    return;
  }
  std::vector<Eigen::Vector3f> rows(first, last);
  for (const int axis : {2, 1, 0})
    radix_sort(rows, [axis](const Eigen::Vector3f& p) { return sortable_bits(p[axis]); });
  std::copy(rows.begin(), rows.end(), first);
}

/// Sorts finite rows along an axis, those of one coordinate by x, y, z: a total order, which does
/// not depend on that of the rows.
inline void sort_rows(std::vector<Eigen::Vector3f>& rows, Eigen::Index axis) {
  radix_sort(rows, [axis](const Eigen::Vector3f& p) { return sortable_bits(p[axis]); });
  for (auto first = rows.begin(), last = first; first != rows.end(); first = last) {
    bool equal = true;
    for (; last != rows.end() && (*last)[axis] == (*first)[axis]; ++last)
      equal = equal && *last == *first;
    if (!equal) sort_by_coordinates(first, last);
  }
}

/// The first row of each place, of rows in a total order.
inline std::vector<std::size_t> distinct_rows(const std::vector<Eigen::Vector3f>& rows) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (k == 0 || rows[k] != rows[k - 1]) out.push_back(k);
  return out;
}

}  // namespace gpureg
