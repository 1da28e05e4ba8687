// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/text_cloud.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "common/float_origin.hpp"
#include "files/text_file.hpp"
#include "io/clouds/pose_rows.hpp"
#include "io/decode.hpp"
#include "io/extension.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;
using files::in_quotes;

/// Of a row of names; a row of numbers is cut no further than its coordinates.
constexpr std::size_t kMostColumns = 4096;

constexpr char kBlanks = ' ';  ///< separator: any run of spaces and tabs

bool is_decimal(char c) { return c >= '0' && c <= '9'; }

std::string_view without_blanks(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(" \t") + 1);
}

std::string_view without_quotes(std::string_view text) {
  if (text.size() > 1 && text.front() == '"' && text.back() == '"')
    return without_blanks(text.substr(1, text.size() - 2));
  return text;
}

/// Cuts a line into at most so many fields.
void cut(std::string_view line, char separator, std::size_t most, Fields& fields) {
  fields.clear();
  line = without_blanks(line);
  while (!line.empty() && fields.size() < most) {
    const std::size_t end = std::min(
        separator == kBlanks ? line.find_first_of(" \t") : line.find(separator), line.size());
    fields.push_back(without_quotes(without_blanks(line.substr(0, end))));
    line.remove_prefix(std::min(end + 1, line.size()));
    if (separator == kBlanks) line = without_blanks(line);
  }
}

char separator_of(std::string_view line, bool names) {
  if (line.find(';') != line.npos) return ';';
  if (line.find(',') != line.npos) return ',';
  // Names may have blanks in them.
  return names && without_blanks(line).find('\t') != line.npos ? '\t' : kBlanks;
}

/// The text behind #, // or another mark of a comment; none: the line is no comment.
std::optional<std::string_view> comment_of(std::string_view line) {
  line = without_blanks(line);
  if (line.empty()) return std::nullopt;
  if (line.front() != '#' && line.front() != '%' && line.front() != '!' &&
      line.substr(0, 2) != "//")
    return std::nullopt;
  return without_blanks(line.substr(std::min(line.find_first_not_of("#%!/"), line.size())));
}

/// "Points:0", " X [m]" and "x" are x.
std::string canonical(std::string_view name) {
  std::string text(without_blanks(name.substr(0, name.find_first_of("[("))));
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (text.size() > 2 && text[text.size() - 2] == ':' && text.back() >= '0' && text.back() <= '2') {
    const char axis = static_cast<char>('x' + (text.back() - '0'));
    if (text.rfind("normal", 0) == 0) return std::string("n") + axis;
    if (text.rfind("point", 0) == 0 || text.rfind("coord", 0) == 0) return std::string(1, axis);
  }
  for (const char axis : {'x', 'y', 'z'})
    for (const char* prefix : {"cartesian", "cartesian_", "pos_", "position_", "position.", "p"})
      if (text == prefix + std::string(1, axis)) return std::string(1, axis);
  for (const char axis : {'x', 'y', 'z'})
    for (const char* prefix : {"normal_", "normal", "normal."})
      if (text == prefix + std::string(1, axis)) return std::string("n") + axis;
  return text;
}

/// "sep=;", the first line of spreadsheets.
bool names_separator(std::string_view line) {
  return line.size() == 5 && canonical(line.substr(0, 4)) == "sep=";
}

struct Columns {
  std::array<std::optional<std::size_t>, 3> point, normal;
  std::size_t last = 0;

  bool flat() const { return !point[2]; }
  bool has_normal() const { return normal[0] && normal[1] && normal[2]; }
};

/// None where x or y is not among the names.
std::optional<Columns> columns_of(const Fields& names) {
  Columns columns;
  const auto find = [&](const std::string& name) -> std::optional<std::size_t> {
    for (std::size_t k = 0; k < names.size(); ++k)
      if (canonical(names[k]) == name) {
        columns.last = std::max(columns.last, k);
        return k;
      }
    return std::nullopt;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    columns.point[axis] = find(name);
    columns.normal[axis] = find("n" + name);
  }
  if (!columns.point[0] || !columns.point[1]) return std::nullopt;
  return columns;
}

Columns first_columns(bool normals) {
  Columns columns;
  columns.point = {0, 1, 2};
  if (normals) columns.normal = {3, 4, 5};
  columns.last = normals ? 5 : 2;
  return columns;
}

bool is_number(std::string_view field) {
  double ignored = 0;
  return field.empty() || parse_coordinate(field, ignored);
}

bool begins_with_numbers(const Fields& fields) {
  return fields.size() >= 3 && std::all_of(fields.begin(), fields.begin() + 3, is_number) &&
         !fields[0].empty();
}

/// Where a line of blanks, tabs or semicolons has numbers like 1,5.
bool has_decimal_commas(std::string_view line) {
  std::size_t numbers = 0, commas = 0;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t;"), line.size());
    const std::string_view field = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    if (field.empty()) continue;
    ++numbers;
    const std::size_t comma = field.find(',');
    commas += comma != field.npos && comma == field.rfind(',') && comma > 0 &&
              comma + 1 < field.size() && is_decimal(field[comma - 1]) &&
              is_decimal(field[comma + 1]);
  }
  return numbers > 1 && 2 * commas >= numbers;
}

class Reader {
 public:
  Reader(const std::string& path, Source& source)
      : extension_(extension_of(path)), source_(source) {}

  PointCloud read() {
    std::string_view line;
    while (source_.next_line(line)) {
      if (without_blanks(line).empty()) continue;
      if (const auto comment = comment_of(line)) {
        if (!columns_) take_names(*comment);
        continue;
      }
      if (!columns_ || points_.empty()) {
        if (is_preamble(line)) continue;
        // Names may be separated in another way than numbers.
        if (!separator_ || line.find(*separator_) == line.npos)
          separator_ = separator_of(line, false);
      }
      if (!columns_ && !begin(line)) continue;
      add(line);
    }
    return finish();
  }

 private:
  /// Columns by names, where they are in the text.
  bool take_names(std::string_view text) {
    const char separator = separator_ ? *separator_ : separator_of(text, true);
    cut(text, separator, kMostColumns, fields_);
    columns_ = columns_of(fields_);
    named_ = columns_.has_value();
    if (columns_ && separator != kBlanks && text.find(separator) != text.npos)
      separator_ = separator;
    return columns_.has_value();
  }

  /// A line before the rows that is neither names nor numbers: a separator, as of spreadsheets, or
  /// the number of rows.
  bool is_preamble(std::string_view line) {
    line = without_blanks(line);
    if (names_separator(line)) {
      separator_ = line[4];
      return true;
    }
    std::size_t count = 0;
    if (!parse_count(line, count)) return false;
    announced_ = announced_.value_or(0) + count;
    return true;
  }

  /// The first row: whether it is one of numbers. Names become the columns.
  bool begin(std::string_view line) {
    cut(line, *separator_, 7, fields_);
    if (begins_with_numbers(fields_) && !(*separator_ == ',' && has_decimal_commas(line))) {
      columns_ = first_columns(extension_ == ".xyzn" && fields_.size() >= 6);
      return true;
    }
    if (has_decimal_commas(line)) fail_decimal_comma(line);
    if (std::all_of(fields_.begin(), fields_.end(), is_number))
      source_.fail_line("a row of " + std::to_string(fields_.size()) +
                        " numbers, expected x y z; of a flat cloud, name the columns in a first "
                        "row: x,y");
    separator_.reset();
    if (take_names(line)) return false;
    std::string names;
    for (std::size_t k = 0; k < std::min<std::size_t>(fields_.size(), 12); ++k)
      names += (k == 0 ? "" : ", ") + in_quotes(fields_[k]);
    source_.fail_line("expected a row of x y z, or of names with x, y and z among them; found " +
                      names);
  }

  [[noreturn]] void fail_decimal_comma(std::string_view line) const {
    source_.fail_line(in_quotes(line) +
                      " has decimal commas: write the numbers with decimal points, as 1.5");
  }

  double value(std::size_t column, const char* name, std::string_view line) const {
    const std::string_view text = fields_[column];
    double number = std::numeric_limits<double>::quiet_NaN();
    if (!text.empty() && !parse_coordinate(text, number)) {
      if (has_decimal_commas(line)) fail_decimal_comma(line);
      source_.fail_line(std::string(name) + " is " + in_quotes(text) + ", expected a number");
    }
    return number;
  }

  void look_for_poses(std::string_view line) {
    constexpr std::size_t kFields = 17;  // one more than a matrix has
    Fields fields;
    cut(line, *separator_, kFields, fields);
    std::vector<double>& row = first_rows_.emplace_back();
    for (const std::string_view field : fields) {
      double number = std::numeric_limits<double>::quiet_NaN();
      parse_coordinate(field, number);
      row.push_back(number);
    }
  }

  void add(std::string_view line) {
    if (first_rows_.size() < kPoseRows) look_for_poses(line);
    cut(line, *separator_, columns_->last + 1, fields_);
    if (announced_ && fields_.size() == 1 && is_preamble(line)) return;  // of one more cloud
    if (announced_ && points_.size() == *announced_) {
      ++further_;
      return;
    }
    if (fields_.size() <= columns_->last) {
      if (has_decimal_commas(line)) fail_decimal_comma(line);
      source_.fail_line("point " + std::to_string(points_.size() + 1) + " has " +
                        std::to_string(fields_.size()) + " values, expected at least " +
                        std::to_string(columns_->last + 1));
    }
    static constexpr const char* kPoint[] = {"x", "y", "z"};
    static constexpr const char* kNormal[] = {"nx", "ny", "nz"};
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), n = p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      if (columns_->point[axis]) p[k] = value(*columns_->point[axis], kPoint[axis], line);
      if (columns_->has_normal()) n[k] = value(*columns_->normal[axis], kNormal[axis], line);
    }
    points_.push_back(p);
    if (columns_->has_normal()) normals_.push_back(n.cast<float>());
  }

  PointCloud finish() {
    if (announced_ && points_.size() < *announced_)
      source_.fail("truncated: " + std::to_string(*announced_) +
                   " points are announced, the file ends after " + std::to_string(points_.size()));
    if (points_.empty()) source_.fail("it has no row of numbers x y z");
    const std::string poses = named_ ? "" : poses_in(first_rows_);
    if (!poses.empty()) source_.fail("a list of poses (" + poses + "), no cloud");
    if (further_ > 0)
      source_.note(std::to_string(further_) + " rows after the announced " +
                   std::to_string(*announced_) + " were left out");
    if (columns_->flat()) source_.note("it has no column z: all points have z = 0");
    PointCloud cloud;
    set_points(cloud, points_);
    cloud.normals = std::move(normals_);
    return cloud;
  }

  std::string extension_;
  Source& source_;
  std::optional<char> separator_;
  std::optional<Columns> columns_;
  std::optional<std::size_t> announced_;
  std::size_t further_ = 0;
  bool named_ = false;  ///< the columns
  std::vector<std::vector<double>> first_rows_;
  Fields fields_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace

bool looks_like_text_cloud(std::string_view start) {
  if (start.find('\0') != start.npos) return false;
  Source source("", start);
  std::string_view line;
  Fields fields;
  while (source.next_line(line)) {
    const auto comment = comment_of(line);
    const std::string_view text = comment ? *comment : without_blanks(line);
    std::size_t count = 0;
    if (text.empty() || names_separator(text) || parse_count(text, count)) continue;
    cut(text, separator_of(text, true), kMostColumns, fields);
    if (columns_of(fields)) return true;
    if (comment) continue;
    cut(text, separator_of(text, false), 3, fields);
    return begins_with_numbers(fields) || has_decimal_commas(text);
  }
  return false;
}

PointCloud read_text_cloud(const std::string& path, Source& source) {
  return Reader(path, source).read();
}

}  // namespace gpureg::io
