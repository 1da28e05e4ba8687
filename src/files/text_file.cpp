// SPDX-License-Identifier: BSD-3-Clause
#include "files/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "files/numbers.hpp"
#include "gpureg/error.hpp"

namespace gpureg::files {
namespace {

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

[[noreturn]] void fail_reading(const std::string& path, const std::string& reason) {
  throw IoError("cannot read " + path + ": " + reason);
}

// Of an open file; also says why it could not be opened.
struct stat status_of(const Descriptor& file, const std::string& path) {
  struct stat info{};
  if (file.fd < 0 || ::fstat(file.fd, &info) != 0)
    fail_reading(path, std::generic_category().message(errno));
  if (S_ISDIR(info.st_mode)) fail_reading(path, "it is a folder");
  return info;
}

void read_up_to(const Descriptor& file, const std::string& path, std::size_t bytes,
                std::string& content) {
  char buffer[1 << 16];
  while (content.size() < bytes) {
    const ssize_t got = ::read(file.fd, buffer, std::min(sizeof buffer, bytes - content.size()));
    if (got == 0) return;
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_reading(path, std::generic_category().message(errno));
    content.append(buffer, static_cast<std::size_t>(got));
  }
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

// "scan.e57#3" is a name.
std::size_t comment_at(std::string_view line, char mark) {
  std::size_t at = line.find(mark);
  while (at != std::string_view::npos && at > 0 && !is_space(line[at - 1]) &&
         at + 1 < line.size() && line[at + 1] >= '0' && line[at + 1] <= '9')
    at = line.find(mark, at + 1);
  return at;
}

// std::from_chars takes no '+', which some writers put in front of numbers; unlike strtod it does
// not depend on the locale.
template <typename T>
bool parse(std::string_view text, T& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, error] = files::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

}  // namespace

std::string read_file(const std::string& path, std::size_t max_bytes) {
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  const struct stat info = status_of(file, path);
  const std::string too_large = "larger than " + std::to_string(max_bytes) + " bytes";
  std::string content;
  if (S_ISREG(info.st_mode)) {
    if (static_cast<std::size_t>(info.st_size) > max_bytes) fail_reading(path, too_large);
    content.reserve(static_cast<std::size_t>(info.st_size));
  }
  read_up_to(file, path, max_bytes + 1, content);
  if (content.size() > max_bytes) fail_reading(path, too_large);
  return content;
}

std::string read_start(const std::string& path, std::size_t bytes) {
  // Who opens a pipe to which nobody writes waits, unless told not to.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (!S_ISREG(status_of(file, path).st_mode)) fail_reading(path, "it is not a regular file");
  std::string content;
  read_up_to(file, path, bytes, content);
  return content;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::string out = "'";
  for (const char c : text.substr(0, longest)) out += (c >= ' ' && c <= '~') ? c : '?';
  return out + (text.size() > longest ? "...'" : "'");
}

TextFile::TextFile(const std::string& path, char comment)
    : path_(path), content_(read_file(path)), comment_(comment) {}

bool TextFile::next() {
  while (position_ < content_.size()) {
    const std::size_t end = std::min(content_.find('\n', position_), content_.size());
    std::string_view rest(content_.data() + position_, end - position_);
    position_ = end + 1;
    ++line_;
    if (comment_ != '\0') rest = rest.substr(0, comment_at(rest, comment_));
    fields_.clear();
    for (std::size_t k = 0; k < rest.size();) {
      if (is_space(rest[k])) {
        ++k;
        continue;
      }
      const std::size_t begin = k;
      while (k < rest.size() && !is_space(rest[k])) ++k;
      fields_.push_back(rest.substr(begin, k - begin));
    }
    if (!fields_.empty()) return true;
  }
  fields_.clear();
  return false;
}

double TextFile::number(std::size_t k, const char* what) const {
  double value = 0;
  if (!parse(fields_.at(k), value))
    fail(std::string(what) + " is " + in_quotes(fields_[k]) + ", expected a number");
  if (!std::isfinite(value))
    fail(std::string(what) + " is " + in_quotes(fields_[k]) + ", expected a finite number");
  return value;
}

int TextFile::index(std::size_t k, const char* what) const {
  int value = 0;
  if (!parse(fields_.at(k), value) || value < 0)
    fail(std::string(what) + " is " + in_quotes(fields_[k]) +
         ", expected an integer from 0 to 2147483647");
  return value;
}

void TextFile::fail(const std::string& reason) const {
  throw IoError(path_ + ":" + std::to_string(line_) + ": " + reason);
}

}  // namespace gpureg::files
