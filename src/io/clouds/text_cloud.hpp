// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"

/// Rows of numbers in text: XYZ, TXT, ASC, PTS and CSV as CloudCompare, PDAL, ParaView, MeshLab,
/// scanners, libpointmatcher and spreadsheets write them.
namespace gpureg::io {

/// True where the first row that is no comment begins with three numbers or names the columns x
/// and y.
bool looks_like_text_cloud(std::string_view start);

/// A whole file. Columns are separated by blanks, tabs, commas or semicolons. A row of names, also
/// behind # or //, says which columns are x, y, z and the normal; without one, x y z come first.
/// Without a column z the cloud is flat, which a note tells. Empty cells are no numbers (NaN). A
/// line of one whole number announces so many rows, as in PTS. Throws IoError naming the line.
PointCloud read_text_cloud(const std::string& path, Source& source);

}  // namespace gpureg::io
