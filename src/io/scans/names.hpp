// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Names of the files of a folder.
namespace gpureg::io::scans {

/// Order of people: scan2 before scan10; a folder's files together. A total order.
bool natural_less(std::string_view a, std::string_view b);

/// "a" of "a.ply"; a name that begins with its only dot is all stem.
std::string_view stem_of(std::string_view name);

/// A name for messages and documents: valid UTF-8 without control characters.
std::string printable(std::string_view name);

/// Whether only clouds and meshes have this extension.
bool is_cloud_extension(std::string_view extension);
/// Whether a file that is there is read as a cloud or mesh: by its extension, and where that says
/// little, of texts, by its first rows: poses and lists are none.
bool is_cloud_file(const std::string& path);
/// Whether a text file of this extension may be anything.
bool is_text_extension(std::string_view extension);

/// Number at the end of a stem, "scan_012": what is before it, and 12. None where it has no digits
/// or is beyond an int.
struct NumberedStem {
  std::string_view before;
  int number = 0;
};
std::optional<NumberedStem> numbered(std::string_view stem);

}  // namespace gpureg::io::scans
