// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/ptx.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "common/float_origin.hpp"
#include "files/text_file.hpp"
#include "io/decode.hpp"
#include "io/table.hpp"

namespace gpureg::io {
namespace {

using Fields = std::vector<std::string_view>;

/// Numbers of the lines of a header: columns, rows, position of the scanner, its axes, the pose.
constexpr std::array<std::size_t, 10> kNumbersOfLines = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
/// Largest deviation of a rotation from an orthogonal matrix.
constexpr double kOrthogonal = 1e-3;

struct ScanHeader {
  std::size_t rows = 0;
  Eigen::Vector3d scanner;
  Eigen::Matrix4d pose;  ///< as a file has it: for rows that are multiplied from the left

  bool moves() const { return !pose.isIdentity(1e-12); }
};

/// False where fields are not so many numbers.
bool parse(const Fields& fields, std::size_t count, double* values) {
  if (fields.size() != count) return false;
  for (std::size_t k = 0; k < count; ++k)
    if (!parse_coordinate(fields[k], values[k])) return false;
  return true;
}

/// False at the end of the file.
bool next_header(Source& source, ScanHeader& header) {
  Fields fields;
  std::array<double, 30> numbers{};
  std::size_t at = 0, columns = 0, rows = 0;
  for (std::size_t line = 0; line < kNumbersOfLines.size(); ++line) {
    if (!next_fields(source, fields)) {
      if (line == 0) return false;
      source.fail("truncated: the file ends in the header of a scan");
    }
    const bool counts = line < 2;
    if (counts ? fields.size() != 1 || !parse_count(fields[0], line == 0 ? columns : rows)
               : !parse(fields, kNumbersOfLines[line], numbers.data() + at))
      source.fail_line("line " + std::to_string(line + 1) + " of the header of a scan has to be " +
                       (counts ? "a count" : std::to_string(kNumbersOfLines[line]) + " numbers"));
    if (!counts) at += kNumbersOfLines[line];
  }
  check_rows(columns, source);
  check_rows(rows, source);
  header.rows = columns * rows;  // below 2^62
  check_rows(header.rows, source);
  header.scanner = Eigen::Map<const Eigen::Vector3d>(numbers.data());
  header.pose = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data() + 12);
  return true;
}

[[noreturn]] void fail_truncated(const ScanHeader& header, std::size_t found,
                                 const Source& source) {
  source.fail("truncated: a scan announces " + std::to_string(header.rows) +
              " points, the file ends after " + std::to_string(found) + " of them");
}

void skip_rows(Source& source, const ScanHeader& header) {
  std::string_view line;
  for (std::size_t row = 0; row < header.rows;) {
    if (!source.next_line(line)) fail_truncated(header, row, source);
    row += line.find_first_not_of(" \t") != line.npos;
  }
}

std::optional<StoredScan::Pose> pose_of(const ScanHeader& header) {
  const Eigen::Matrix4d m = header.pose.transpose();
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const Eigen::RowVector4d last(0, 0, 0, 1);
  if (!m.allFinite() || !(r * r.transpose()).isIdentity(kOrthogonal) || r.determinant() < 0 ||
      !m.row(3).isApprox(last))
    return std::nullopt;
  return StoredScan::Pose(m);
}

/// False for a place farther from the points than they extend: they were moved since.
bool may_see(const Eigen::Vector3d& place, const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points)
    if (p.allFinite()) box.extend(p);
  return !box.isEmpty() && box.exteriorDistance(place) <= box.diagonal().norm();
}

}  // namespace

bool looks_like_ptx(std::string_view start) {
  Source source("", start);
  Fields fields;
  for (std::size_t line = 0; line < kNumbersOfLines.size(); ++line) {
    std::array<double, 4> numbers{};
    std::size_t count = 0;
    if (!next_fields(source, fields) || (line < 2 && !parse_count(fields[0], count)) ||
        !parse(fields, kNumbersOfLines[line], numbers.data()))
      return false;
  }
  return true;
}

std::vector<StoredScan> index_ptx(Source& source) {
  std::vector<StoredScan> scans;
  ScanHeader header;
  while (next_header(source, header)) {
    skip_rows(source, header);
    scans.push_back({"", header.rows, pose_of(header)});
  }
  return scans;
}

PointCloud read_ptx(Source& source, std::size_t index) {
  ScanHeader header;
  for (std::size_t k = 0;; ++k) {
    if (!next_header(source, header))
      source.fail("there is no scan " + std::to_string(index + 1) + ", it holds " +
                  std::to_string(k));
    if (k == index) break;
    skip_rows(source, header);
  }
  check_text_size(header.rows, 3, source);
  std::vector<Eigen::Vector3d> points;
  Fields fields;
  for (std::size_t row = 0; row < header.rows; ++row) {
    if (!next_fields(source, fields)) fail_truncated(header, row, source);
    if (fields.size() < 3)
      source.fail_line("point " + std::to_string(row + 1) + " has " +
                       std::to_string(fields.size()) + " values, expected x y z intensity");
    Eigen::Vector3d p;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!parse_coordinate(fields[axis], p[static_cast<Eigen::Index>(axis)]))
        source.fail_line("a coordinate is " + files::in_quotes(fields[axis]) +
                         ", expected a number");
    if (!p.isZero(0)) points.push_back(p);
  }
  PointCloud cloud;
  set_points(cloud, points);
  // Some programs write the points in the frame of the project, without a pose.
  const bool in_frame_of_project = !header.moves() && header.scanner.allFinite();
  const Eigen::Vector3d scanner =
      in_frame_of_project ? header.scanner : Eigen::Vector3d::Zero().eval();
  if (may_see(scanner, points)) cloud.set_viewpoints({scanner});
  return cloud;
}

}  // namespace gpureg::io
