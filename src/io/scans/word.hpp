// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "files/text_file.hpp"

namespace gpureg::io::scans {

/// The text of a line from one field up to another, without quotes around it: a name may have
/// blanks.
inline std::string_view words(const files::TextFile& file, std::size_t begin, std::size_t end) {
  const std::string_view first = file.fields()[begin], last = file.fields()[end - 1];
  std::string_view text(first.data(),
                        static_cast<std::size_t>(last.data() - first.data()) + last.size());
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"')
    text = text.substr(1, text.size() - 2);
  return text;
}

/// Whether a word is a number of a scan, not a name.
inline bool is_digits(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace gpureg::io::scans
