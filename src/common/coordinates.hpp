// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::limits {

/// Coordinates of poses and of origins beyond it are a mistake; in double its steps are 0.1 mm, and
/// its square is a float.
constexpr double kMaxCoordinate = 1e12;

}  // namespace gpureg::limits
