// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace gpureg::io::scans {

/// Number of scans of a file; 1 of one that is damaged, as whoever reads it will say.
std::size_t parts_of(const std::string& path);

}  // namespace gpureg::io::scans
