// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"

/// Scans without a header, as of the KITTI data set (Geiger et al. 2012): rows of four
/// little-endian float32, x y z and reflectance; or of five, as of nuScenes (x y z intensity ring),
/// of three or of six, where the columns tell so.
namespace gpureg::io {

/// True for names that end in .bin, in any case: nothing in the content tells the format.
bool looks_like_kitti(const std::string& path);

/// A whole file. Throws IoError where its size is no number of rows, where its columns tell of rows
/// of another width or of none, or where most rows are no coordinates.
PointCloud read_kitti(Source& source);

}  // namespace gpureg::io
