// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace gpureg::io {

/// For a file that no reader of the library takes: what it is, and what to do with it. Empty where
/// neither its first bytes nor its name tell.
std::string foreign_format(const std::string& path, std::string_view start);

}  // namespace gpureg::io
