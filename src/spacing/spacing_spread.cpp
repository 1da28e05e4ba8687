// SPDX-License-Identifier: BSD-3-Clause
#include "spacing/spacing_spread.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "spacing/slabs.hpp"

namespace gpureg {
namespace {

/// Rows whose spacing is measured.
constexpr std::size_t kMeasuredRows = 1000;

double quartile_ratio(std::vector<double> values) {
  if (values.size() < 4) return 1;
  std::sort(values.begin(), values.end());
  return values[values.size() * 3 / 4] / values[values.size() / 4];
}

}  // namespace

SpacingSpread spacing_spread(const RawCloud& rows, Vec3 viewpoint) {
  const Slabs slabs(rows);
  std::vector<double> plain, radial;
  for (const Slabs::Row& row : slabs.evenly_spaced(kMeasuredRows)) {
    const float nearest = slabs.nearest_squared(row), range = norm(row.position - viewpoint);
    if (!(range > 0) || nearest == std::numeric_limits<float>::infinity()) continue;
    plain.push_back(static_cast<double>(std::sqrt(nearest)));
    radial.push_back(plain.back() / static_cast<double>(range));
  }
  return {quartile_ratio(std::move(plain)), quartile_ratio(std::move(radial))};
}

}  // namespace gpureg
