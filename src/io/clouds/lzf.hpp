// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace gpureg::io {

/// Longest output of so many bytes of LZF: a back reference of 3 bytes gives at most 264.
inline constexpr std::size_t kLzfGrowth = 88;

/// Decompresses LZF (M. Lehmann's format, which PCD uses). False unless packed is sound and gives
/// exactly size bytes.
bool lzf_decompress(std::string_view packed, std::size_t size, std::string& out);

}  // namespace gpureg::io
