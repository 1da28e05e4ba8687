// SPDX-License-Identifier: BSD-3-Clause
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <utility>

namespace gpureg::cli {
namespace {

std::string format(const char* pattern, int digits, double value) {
  char text[400];
  std::snprintf(text, sizeof(text), pattern, digits, value);
  return text;
}

/// Letters to insert, delete or replace, and pairs of neighbours to exchange.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t(0));
  std::vector<std::size_t> last = row;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::exchange(last, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string fixed(double value, int digits) { return format("%.*f", digits, value); }
std::string significant(double value, int digits) { return format("%.*g", digits, value); }

std::string shortest(double value) {
  for (int digits = 15; digits < 17; ++digits)
    if (std::string text = significant(value, digits); std::strtod(text.c_str(), nullptr) == value)
      return text;
  return significant(value, 17);
}

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

std::string counted(const std::map<std::string, std::size_t>& counts) {
  std::vector<std::pair<std::string, std::size_t>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (const auto& [name, count] : sorted)
    text += (text.empty() ? "" : ", ") + grouped(count) + " " + name;
  return text;
}

std::string base_name(const std::string& path) {
  const std::size_t end = path.find_last_not_of('/');
  if (end == std::string::npos) return path;
  const std::size_t slash = path.rfind('/', end);
  const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
  return path.substr(begin, end + 1 - begin);
}

std::string nearest(const std::string& word, const std::vector<std::string>& words) {
  const std::string* best = nullptr;
  std::size_t fewest = word.size() / 3 + 1;  // more edits make it another word
  for (const std::string& candidate : words)
    if (const std::size_t count = edits(word, candidate); count < fewest) {
      fewest = count;
      best = &candidate;
    }
  return best ? *best : "";
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
