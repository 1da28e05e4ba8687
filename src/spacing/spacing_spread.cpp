// SPDX-License-Identifier: BSD-3-Clause
#include "spacing/spacing_spread.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/radix_sort.hpp"
#include "pipeline/finite_rows.hpp"

namespace gpureg {
namespace {

/// Rows whose spacing is measured.
constexpr std::size_t kMeasuredRows = 1000;

std::vector<Vec3> finite_rows_by_x(const RawCloud& rows) {
  const std::vector<Vec3> all = finite_rows(rows);
  std::vector<KeyIndex> order;
  order.reserve(all.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) order.push_back({sortable_bits(all[i].x), i});
  radix_sort(order);
  std::vector<Vec3> sorted;
  sorted.reserve(order.size());
  for (const KeyIndex& item : order) sorted.push_back(all[item.index]);
  return sorted;
}

/// Evenly spaced places in the order of x, y, z, whatever the order of the rows. The rows are
/// sorted by x; of rows with one x only those at the places move to where they belong.
std::vector<std::size_t> evenly_spaced(std::vector<Vec3>& rows) {
  const std::size_t count = std::min(kMeasuredRows, rows.size());
  std::vector<std::size_t> places;
  auto begin = rows.begin(), end = begin;  // of the rows with one x that are not at a place yet
  for (std::size_t s = 0; s < count; ++s) {
    places.push_back(s * rows.size() / count);
    const auto place = rows.begin() + static_cast<std::ptrdiff_t>(places.back());
    const float x = place->x;
    if (place >= end) {
      begin = end = place;
      while (begin != rows.begin() && (begin - 1)->x == x) --begin;
      while (end != rows.end() && end->x == x) ++end;
    }
    std::nth_element(begin, place, end, [](const Vec3& a, const Vec3& b) {
      return a.y != b.y ? a.y < b.y : a.z < b.z;
    });
    begin = place + 1;
  }
  return places;
}

/// Squared distance to the nearest other point of a row, infinite where there is none.
float nearest_squared(const std::vector<Vec3>& rows_by_x, std::size_t at) {
  float nearest = std::numeric_limits<float>::infinity();
  // A row nearer than d is less than d away along x.
  const auto visit = [&](std::size_t k) {
    const Vec3 d = rows_by_x[k] - rows_by_x[at];
    if (d.x * d.x >= nearest) return false;
    const float squared = d.x * d.x + d.y * d.y + d.z * d.z;
    if (squared > 0) nearest = std::min(nearest, squared);
    return true;
  };
  for (std::size_t k = at + 1; k < rows_by_x.size() && visit(k);) ++k;
  for (std::size_t k = at; k > 0 && visit(k - 1);) --k;
  return nearest;
}

double quartile_ratio(std::vector<double> values) {
  if (values.size() < 4) return 1;
  std::sort(values.begin(), values.end());
  return values[values.size() * 3 / 4] / values[values.size() / 4];
}

}  // namespace

SpacingSpread spacing_spread(const RawCloud& rows, Vec3 viewpoint) {
  std::vector<Vec3> sorted = finite_rows_by_x(rows);
  std::vector<double> plain, radial;
  for (const std::size_t at : evenly_spaced(sorted)) {
    const float nearest = nearest_squared(sorted, at), range = norm(sorted[at] - viewpoint);
    if (!(range > 0) || nearest == std::numeric_limits<float>::infinity()) continue;
    plain.push_back(static_cast<double>(std::sqrt(nearest)));
    radial.push_back(plain.back() / static_cast<double>(range));
  }
  return {quartile_ratio(std::move(plain)), quartile_ratio(std::move(radial))};
}

}  // namespace gpureg
