// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "math/vec3.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

/// The rows of the input without NaN and infinity.
inline std::vector<Vec3> finite_rows(const RawCloud& rows) {
  std::vector<Vec3> out;
  out.reserve(rows.size);
  for (std::size_t i = 0; i < rows.size; ++i) {
    const float* p = rows.points + i * rows.point_stride;
    if (all_finite({p[0], p[1], p[2]})) out.push_back({p[0], p[1], p[2]});
  }
  return out;
}

}  // namespace gpureg
