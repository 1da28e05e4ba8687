// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/point_cloud.hpp"

/// LAS, LAZ and E57, which libraries of Python read: in a process of the interpreter that
/// GPUREG_PYTHON names, as the command of the Python package does.
namespace gpureg::cli {

/// Whether a file is of these formats, by its first bytes or its name.
bool is_for_python(const std::string& path);

/// @param path may name a scan, as "project.e57#2".
/// @throws IoError naming the file: what is wrong with it, or what has to be installed.
PointCloud read_by_python(const std::string& path);

}  // namespace gpureg::cli
