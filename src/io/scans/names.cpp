// SPDX-License-Identifier: BSD-3-Clause
#include "io/scans/names.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "io/clouds/text_cloud.hpp"
#include "io/extension.hpp"

namespace gpureg::io::scans {
namespace {

constexpr std::array<std::string_view, 15> kClouds = {".ply", ".pcd", ".bin",  ".stl", ".obj",
                                                      ".off", ".xyz", ".xyzn", ".asc", ".xyzrgb",
                                                      ".pts", ".ptx", ".las",  ".laz", ".e57"};
/// Text files beside clouds whose rows look like points.
constexpr std::array<std::string_view, 12> kBeside = {"camera", "pose",  "traj",  "groundtruth",
                                                      "calib",  "times", "pairs", "odom",
                                                      "imu",    "gps",   "label", "gravity"};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Separators come first, so that a folder's files stay together.
int rank_of(char c) { return c == '/' ? -1 : static_cast<unsigned char>(lower(c)); }

std::string_view digits_at(std::string_view text, std::size_t at) {
  std::size_t end = at;
  while (end < text.size() && is_digit(text[end])) ++end;
  return text.substr(at, end - at);
}

std::string_view without_zeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

std::string lowered(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), lower);
  return out;
}

/// Bytes of the valid character at the start of a text, 0 where there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF5   ? 0
                             : first >= 0xF0 ? 4
                             : first >= 0xE0 ? 3
                             : first >= 0xC2 ? 2
                                             : 0;
  if (length == 0 || text.size() < length) return 0;
  std::uint32_t code = first & (0xFFu >> (length + 1));
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(k) & 0x3Fu);
  }
  constexpr std::uint32_t kFirst[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  return code < kFirst[length] || code > 0x10FFFF || surrogate ? 0 : length;
}

/// Rows of TUM and KITTI: a pose has 8, 12 or 16 numbers.
bool begins_with_poses(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    if (line.find_first_not_of("+-.0123456789eE \t\r") != std::string_view::npos) return false;
    std::size_t count = 0;
    for (std::size_t k = first; k < line.size(); ++k)
      count += is_blank(line[k]) ? 0 : k == first || is_blank(line[k - 1]);
    return count == 8 || count == 12 || count == 16;
  }
  return false;
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string_view x = digits_at(a, i), y = digits_at(b, j);
      const std::string_view m = without_zeros(x), n = without_zeros(y);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
      i += x.size();
      j += y.size();
      continue;
    }
    if (rank_of(a[i]) != rank_of(b[j])) return rank_of(a[i]) < rank_of(b[j]);
    ++i;
    ++j;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;
}

std::string_view stem_of(std::string_view name) {
  return name.substr(0, name.size() - extension_of(std::string(name)).size());
}

std::string printable(std::string_view name) {
  std::string out;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = utf8_length(name.substr(at));
    const auto byte = static_cast<unsigned char>(name[at]);
    if (length == 0 || byte < 0x20 || byte == 0x7F)
      out += '?';
    else
      out += name.substr(at, length);
    at += std::max<std::size_t>(1, length);
  }
  return out;
}

bool is_cloud_extension(std::string_view extension) {
  return std::find(kClouds.begin(), kClouds.end(), extension) != kClouds.end();
}

bool is_text_extension(std::string_view extension) {
  return extension == ".txt" || extension == ".csv" || extension == ".dat";
}

bool is_cloud_file(const std::string& path) {
  const std::string extension = extension_of(path);
  if (is_cloud_extension(extension)) return true;
  if (!is_text_extension(extension)) return false;
  const std::string name = lowered(path.substr(path.rfind('/') + 1));
  if (std::any_of(kBeside.begin(), kBeside.end(),
                  [&](std::string_view word) { return name.find(word) != std::string::npos; }))
    return false;
  constexpr std::size_t kStart = 4096;
  try {
    const std::string start = files::read_start(path, kStart);
    return looks_like_text_cloud(start) && !begins_with_poses(start);
  } catch (const IoError&) {
    return false;
  }
}

std::optional<NumberedStem> numbered(std::string_view stem) {
  std::size_t begin = stem.size();
  while (begin > 0 && is_digit(stem[begin - 1])) --begin;
  NumberedStem out{stem.substr(0, begin), 0};
  const char* end = stem.data() + stem.size();
  const auto [stop, error] = std::from_chars(stem.data() + begin, end, out.number);
  if (error != std::errc() || stop != end) return {};
  return out;
}

}  // namespace gpureg::io::scans
