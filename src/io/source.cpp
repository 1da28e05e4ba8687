// SPDX-License-Identifier: BSD-3-Clause
#include "io/source.hpp"

#include <algorithm>
#include <charconv>

#include "gpureg/error.hpp"

namespace gpureg::io {

bool Source::next_line(std::string_view& line) {
  if (position_ >= bytes_.size()) return false;
  const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
  line = bytes_.substr(position_, end - position_);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  position_ = std::min(end + 1, bytes_.size());
  ++line_;
  return true;
}

void Source::fail(const std::string& reason) const {
  throw IoError("cannot read " + path_ + ": " + reason);
}

void Source::fail_line(const std::string& reason) const {
  throw IoError("cannot read " + path_ + ":" + std::to_string(line_) + ": " + reason);
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  const char* const end = line.data() + line.size();
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  for (const char* c = line.data(); c != end;) {
    if (blank(*c)) {
      ++c;
      continue;
    }
    const char* const begin = c;
    while (c != end && !blank(*c)) ++c;
    fields.emplace_back(begin, static_cast<std::size_t>(c - begin));
  }
}

bool next_fields(Source& source, std::vector<std::string_view>& fields, char comment) {
  std::string_view line;
  while (source.next_line(line)) {
    split(comment == '\0' ? line : line.substr(0, line.find(comment)), fields);
    if (!fields.empty()) return true;
  }
  return false;
}

bool parse_count(std::string_view field, std::size_t& value) {
  const char* const end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, value);
  return error == std::errc() && stop == end && field.size() <= 18;
}

}  // namespace gpureg::io
