// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"

/// Velodyne scans of the KITTI data set (Geiger et al. 2012): rows of four little-endian float32, x
/// y z and reflectance, without a header.
namespace gpureg::io {

/// True for names that end in .bin, in any case: nothing in the content tells the format.
bool looks_like_kitti(const std::string& path);

/// A whole file. Throws IoError where its size is no number of rows, or where most rows are no
/// coordinates.
PointCloud read_kitti(Source& source);

}  // namespace gpureg::io
