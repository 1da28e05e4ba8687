// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

namespace gpureg::cuda {

/// Box of cells, both corners included.
struct CellRange {
  Cell lo, hi;
};

}  // namespace gpureg::cuda
