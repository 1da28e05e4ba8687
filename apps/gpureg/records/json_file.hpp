// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "records/json.hpp"

namespace gpureg::cli {

/// Version of the JSON documents and journals that the command writes, as "format_version". It
/// grows when a reader of the version before would misread a document; documents without it are
/// version 1.
inline constexpr int kFormatVersion = 1;

/// Throws IoError naming the file where a newer gpureg wrote the document.
void check_format(const std::string& path, const Json& document);

/// One top-level key a line, and one element of a top-level array of objects a line: a diff or grep
/// of a result finds the pair. Begins with the format version.
std::string format_document(const Json& document);

/// All or nothing. Throws IoError.
void write_document(const std::string& path, const Json& document);

/// Throws IoError naming the file and the reason.
std::string read_text(const std::string& path);

}  // namespace gpureg::cli
