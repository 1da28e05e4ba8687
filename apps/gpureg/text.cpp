// SPDX-License-Identifier: BSD-3-Clause
#include "text.hpp"

#include <cmath>
#include <cstdio>

namespace gpureg::cli {
namespace {

std::string format(const char* pattern, int digits, double value) {
  char text[400];
  std::snprintf(text, sizeof(text), pattern, digits, value);
  return text;
}

}  // namespace

std::string fixed(double value, int digits) { return format("%.*f", digits, value); }
std::string significant(double value, int digits) { return format("%.*g", digits, value); }
std::string percent(double ratio) { return fixed(100 * ratio, 1); }

std::string grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (int at = static_cast<int>(text.size()) - 3; at > 0; at -= 3)
    text.insert(static_cast<std::size_t>(at), ",");
  return text;
}

std::string duration(double seconds) {
  const long total = std::lround(std::fmax(0, std::fmin(seconds, 1e8)));
  char text[64];
  if (total < 3600)
    std::snprintf(text, sizeof(text), "%ld:%02ld", total / 60, total % 60);
  else
    std::snprintf(text, sizeof(text), "%ld:%02ld:%02ld", total / 3600, total / 60 % 60, total % 60);
  return text;
}

std::string base_name(const std::string& path) {
  const std::size_t end = path.find_last_not_of('/');
  if (end == std::string::npos) return path;
  const std::size_t slash = path.rfind('/', end);
  const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
  return path.substr(begin, end + 1 - begin);
}

std::string pad_right(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

std::string pad_left(std::string text, std::size_t width) {
  if (text.size() < width) text.insert(0, width - text.size(), ' ');
  return text;
}

}  // namespace gpureg::cli
