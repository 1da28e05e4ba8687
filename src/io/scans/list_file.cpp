// SPDX-License-Identifier: BSD-3-Clause
#include "io/scans/list_file.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "io/scans/names.hpp"

namespace gpureg::io::scans {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) + 1 - begin);
}

class Line {
 public:
  Line(const fs::path& folder, std::string_view text) : folder_(folder), text_(text) {}

  /// The longest beginning of the line, up to a blank, that is a file: paths and names may have
  /// blanks in them.
  bool read(Listed& out) const {
    for (std::size_t end = text_.size(); end > 0;) {
      if (take(trimmed(text_.substr(0, end)), out)) {
        out.name = printable(unquoted(trimmed(text_.substr(end))));
        return true;
      }
      end = text_.find_last_of(kBlank, end - 1);
      if (end == std::string_view::npos) break;
    }
    return false;
  }

  fs::path path_of(std::string_view word) const {
    const fs::path path(unquoted(word));
    return path.is_absolute() ? path : folder_ / path;
  }

 private:
  static std::string unquoted(std::string_view text) {
    const bool quoted = text.size() >= 2 && text.front() == text.back() &&
                        (text.front() == '"' || text.front() == '\'');
    return std::string(quoted ? text.substr(1, text.size() - 2) : text);
  }

  bool take(std::string_view word, Listed& out) const {
    std::error_code ignored;
    const fs::path path = path_of(word);
    if (word.empty()) return false;
    if (!fs::exists(scan_path(path.string()).file, ignored)) return false;
    out.path = path.string();
    return true;
  }

  const fs::path& folder_;
  std::string_view text_;
};

}  // namespace

std::vector<Listed> read_list(const std::string& path) {
  const std::string content = files::read_file(path);
  const fs::path parent = fs::path(path).parent_path();
  const fs::path folder = parent.empty() ? fs::path(".") : parent;
  if (content.find('\0') != std::string::npos)
    throw IoError(path + ": is no list of clouds, a text with one path a line");
  std::vector<Listed> out;
  std::string_view rest = content;
  if (rest.substr(0, 3) == "\xEF\xBB\xBF") rest.remove_prefix(3);
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view text = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (text.empty() || text.front() == '#') continue;
    const auto fail = [&](const std::string& why) {
      throw IoError(path + ":" + std::to_string(number) + ": " + why);
    };
    Listed entry;
    entry.line = number;
    const Line line(folder, text);
    if (!line.read(entry))
      fail("there is no file " + printable(line.path_of(text).string()) +
           ", expected a path, relative to the folder of the list, and perhaps a name");
    std::error_code ignored;
    if (fs::is_directory(entry.path, ignored))
      fail(printable(entry.path) + " is a folder, expected a file");
    out.push_back(std::move(entry));
  }
  return out;
}

}  // namespace gpureg::io::scans
