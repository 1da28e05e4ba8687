// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json.hpp"

namespace gpureg::cli {

/// One top-level key a line, and one element of a top-level array of objects a line: a diff or grep
/// of a result finds the pair.
std::string format_document(const Json& document);

/// All or nothing. Throws IoError.
void write_document(const std::string& path, const Json& document);

/// Throws IoError naming the file and the reason.
std::string read_text(const std::string& path);

}  // namespace gpureg::cli
