// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace gpureg::io {

/// Numbers in a row of a table that is stored row by row without a header. The columns of a table
/// have different distributions: with the right width, the place in the row explains much of what
/// a number is like, with a width that has no factor in common, nothing.
/// @return 2 to 16; 0: nothing tells, or two widths do.
int row_width(const std::vector<float>& numbers);

}  // namespace gpureg::io
