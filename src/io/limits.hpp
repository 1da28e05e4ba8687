// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace gpureg::io {

/// Headers of PLY and PCD files are shorter.
inline constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16;
/// Of a cloud or mesh: 2^31 points of 32 bytes.
inline constexpr std::size_t kMostDataBytes = std::size_t{1} << 36;

}  // namespace gpureg::io
