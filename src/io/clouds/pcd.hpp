// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"

/// Point Cloud Data files of PCL, versions 0.5 to 0.7: ascii, binary and binary_compressed.
namespace gpureg::io {

/// True where the first line that is no comment is one of a PCD header.
bool looks_like_pcd(std::string_view bytes);

/// A whole file. A VIEWPOINT away from the origin becomes the cloud's viewpoint. Throws IoError.
PointCloud read_pcd(Source& source);

}  // namespace gpureg::io
