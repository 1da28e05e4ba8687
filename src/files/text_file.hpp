// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Small text files, read strictly: every complaint is an IoError that names file and line. Private
/// to the library.
namespace gpureg::files {

/// No text file of this library comes near this size; the cap keeps devices and mistaken paths from
/// eating the memory.
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 30;

/// Whole content of a file. Throws IoError: missing, a directory, unreadable, larger than
/// max_bytes.
std::string read_file(const std::string& path, std::size_t max_bytes = kMaxTextBytes);

/// The first bytes of a regular file, fewer where it is shorter. Throws IoError: missing,
/// unreadable, a folder, a pipe, a device.
std::string read_start(const std::string& path, std::size_t bytes);

/// text for an error message: shortened, and without bytes that a terminal would act upon.
std::string in_quotes(std::string_view text);

/// The lines of a text file that are not blank, each cut into fields at spaces, tabs and carriage
/// returns.
class TextFile {
 public:
  /// comment: the rest of a line from this character on is ignored; 0: there are no comments.
  explicit TextFile(const std::string& path, char comment = '\0');

  /// Goes to the next line that is not blank; false at the end of the file.
  bool next();

  const std::vector<std::string_view>& fields() const { return fields_; }
  std::size_t line() const { return line_; }  ///< number of the current line, from 1

  /// Field k as a finite number or as an integer in [0, 2^31). what names it in the message.
  double number(std::size_t k, const char* what) const;
  int index(std::size_t k, const char* what) const;

  /// Throws IoError "path:line: reason".
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  std::string path_;
  std::string content_;
  char comment_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  std::vector<std::string_view> fields_;
};

}  // namespace gpureg::files
