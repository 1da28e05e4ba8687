// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// Files, for the components and for programs (component `files`; standard library only).
namespace gpureg::files {

/// Writes a file completely or not at all: into a temporary file that is flushed and renamed, so
/// that a full disk or a crash leaves the old file in place. Links are followed, the mode of an
/// existing file is kept, devices and pipes are written in place. Thread-safe.
/// @throws IoError naming the file and the reason.
void write_atomically(const std::string& path, const std::string& content);

}  // namespace gpureg::files
