// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gpureg/io.hpp"

/// E57 (ASTM E2807): the list of its scans. Their points are read by libraries of Python only.
namespace gpureg::io {

bool looks_like_e57(std::string_view start);

/// Name, points and pose of each scan, from the XML part of a file. Throws IoError where it is
/// damaged.
std::vector<StoredScan> index_e57(const std::string& path);

}  // namespace gpureg::io
