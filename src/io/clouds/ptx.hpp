// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>
#include <vector>

#include "gpureg/io.hpp"
#include "io/source.hpp"

/// PTX of Leica: scans one after another, each with its pose and a grid of rows of x y z intensity
/// in the scanner's frame.
namespace gpureg::io {

/// True where the first ten lines are those of a scan's header.
bool looks_like_ptx(std::string_view start);

/// All scans of a file. Throws IoError where a header is malformed or rows are missing.
std::vector<StoredScan> index_ptx(Source& source);

/// The scan at an index. Rows 0 0 0 are no returns and left out. The scanner is the viewpoint,
/// unless it is too far away. Throws IoError naming the line, or where there is no such scan.
PointCloud read_ptx(Source& source, std::size_t index);

}  // namespace gpureg::io
