// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

namespace gpureg {

/// The whole number towards zero, within [low, high]; low for NaN. A plain cast of a number out of
/// range, or of NaN, is undefined.
template <typename Whole, typename Real>
Whole whole(Real value, Whole low, Whole high) {
  if (!(value > static_cast<Real>(low))) return low;
  return value < static_cast<Real>(high) ? static_cast<Whole>(value) : high;
}

/// The cell of an edge that a coordinate lies in; cells beyond 2^62 are one.
template <typename Real>
std::int64_t cell_at(Real coordinate, Real edge) {
  constexpr std::int64_t kMost = std::int64_t{1} << 62;
  return whole(std::floor(coordinate / edge), -kMost, kMost);
}

}  // namespace gpureg
