// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace gpureg::io {

/// The bytes of a file, a position in them, and error messages with file and line.
class Source {
 public:
  Source(std::string path, std::string_view bytes) : path_(std::move(path)), bytes_(bytes) {}

  /// Next line without its line end (\n or \r\n); false at the end of the bytes.
  bool next_line(std::string_view& line);

  std::string_view rest() const { return bytes_.substr(position_); }
  void skip(std::size_t bytes) { position_ += bytes; }  ///< at most rest().size()

  /// Throws IoError naming the file, or file and line of the last next_line().
  [[noreturn]] void fail(const std::string& reason) const;
  [[noreturn]] void fail_line(const std::string& reason) const;

  /// What is strange about a file that is read nonetheless.
  void note(const std::string& sentence) { note_ += (note_.empty() ? "" : "; ") + sentence; }
  const std::string& notes() const { return note_; }

 private:
  std::string path_, note_;
  std::string_view bytes_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
};

/// Cuts a line at spaces and tabs into fields, whose old content is replaced.
void split(std::string_view line, std::vector<std::string_view>& fields);

/// The fields of the next line that has some; false at the end.
/// @param comment what follows this character in a line is left out; 0: nothing is.
bool next_fields(Source& source, std::vector<std::string_view>& fields, char comment = '\0');

/// The whole field as a decimal number of at most 18 digits; false for anything else.
bool parse_count(std::string_view field, std::size_t& value);

}  // namespace gpureg::io
