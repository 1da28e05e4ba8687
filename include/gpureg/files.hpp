// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>

/// Files, for the components and for programs (component `files`; standard library only).
namespace gpureg::files {

/// Writes a file completely or not at all: into a temporary file that is flushed and renamed, so
/// that a full disk or a crash leaves the old file in place. Links are followed, the mode of an
/// existing file is kept, devices and pipes are written in place. Temporary files that killed
/// processes left in the folder, .gpureg-*.tmp, are removed. Thread-safe.
/// @throws IoError naming the file and the reason.
void write_atomically(const std::string& path, const std::string& content);

/// Takes the next part of a file.
using Sink = std::function<void(std::string_view)>;

/// The same for a content that is made part by part and need not fit into memory.
/// @param content calls its argument with the parts in order; what it throws leaves the old file in
///   place (devices and pipes have received the parts before).
void write_atomically(const std::string& path, const std::function<void(const Sink&)>& content);

}  // namespace gpureg::files
