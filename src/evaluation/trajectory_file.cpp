// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "common/rigid.hpp"
#include "evaluation/rigid.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/files.hpp"

namespace gpureg::evaluation {
namespace {

constexpr std::size_t kTumFields = 8, kKittiFields = 12, kNumberFields = 1, kRowFields = 4,
                      kMatrixFields = 16;
/// Files carry six digits, which leaves 1e-6; the bound only detects columns that are no
/// quaternion.
constexpr double kNormTolerance = 1e-3;

void expect_fields(const files::TextFile& file, std::size_t fields, const char* what) {
  if (file.fields().size() != fields)
    file.fail("the line has " + std::to_string(file.fields().size()) + " fields, expected " + what);
}

/// The time of a line whose first fields, all but some, are a name or a number; none: neither.
std::optional<double> named_time(const files::TextFile& file, std::size_t others,
                                 const TimeOfName& time_of) {
  const std::vector<std::string_view>& fields = file.fields();
  if (!time_of || fields.size() <= others) return {};
  const std::string_view last = fields[fields.size() - others - 1];
  return time_of(
      {fields[0].data(), static_cast<std::size_t>(last.data() - fields[0].data()) + last.size()});
}

TrajectoryFormat format_of(const files::TextFile& file, const TimeOfName& time_of) {
  if (named_time(file, kTumFields - 1, time_of)) return TrajectoryFormat::tum;
  if (named_time(file, 0, time_of)) return TrajectoryFormat::blocks;
  switch (file.fields().size()) {
    case kTumFields:
      return TrajectoryFormat::tum;
    case kKittiFields:
      return TrajectoryFormat::kitti;
    case kNumberFields:
    case kRowFields:
    case kMatrixFields:
      return TrajectoryFormat::blocks;
    default:
      expect_fields(
          file, kTumFields,
          "8 (TUM: time tx ty tz qx qy qz qw), 12 (KITTI: rows of a pose), 1 (number of a "
          "4 x 4 block), 4 (a row of one without number) or 16 (a whole one)");
      return TrajectoryFormat::automatic;
  }
}

StampedPose tum_pose(const files::TextFile& file, const TimeOfName& time_of) {
  const std::optional<double> named = named_time(file, kTumFields - 1, time_of);
  if (!named) expect_fields(file, kTumFields, "8: time tx ty tz qx qy qz qw");
  StampedPose pose;
  pose.time = named ? *named : file.number(0, "time");
  const std::size_t at = file.fields().size() - kTumFields;  // a name has a field or more
  const Eigen::Quaterniond q(file.number(at + 7, "qw"), file.number(at + 4, "qx"),
                             file.number(at + 5, "qy"), file.number(at + 6, "qz"));
  if (std::abs(q.norm() - 1) > kNormTolerance)
    file.fail("the quaternion has length " + std::to_string(q.norm()) + ", expected 1");
  pose.world_from_body.topLeftCorner<3, 3>() = q.normalized().toRotationMatrix();
  pose.world_from_body.topRightCorner<3, 1>() = Eigen::Vector3d(
      file.number(at + 1, "tx"), file.number(at + 2, "ty"), file.number(at + 3, "tz"));
  return pose;
}

StampedPose kitti_pose(const files::TextFile& file, std::size_t place) {
  expect_fields(file, kKittiFields, "12: the first three rows of a pose");
  StampedPose pose;
  pose.time = static_cast<double>(place);
  for (int k = 0; k < 12; ++k)
    pose.world_from_body(k / 4, k % 4) = file.number(static_cast<std::size_t>(k), "pose");
  check_rigid(file, pose.world_from_body);
  return pose;
}

/// Without a number, the block counts by its place.
StampedPose block_pose(files::TextFile& file, std::size_t place, const TimeOfName& time_of) {
  StampedPose pose;
  pose.time = static_cast<double>(place);
  const auto is_matrix = [&] {
    return file.fields().size() == kRowFields || file.fields().size() == kMatrixFields;
  };
  const std::optional<double> named = named_time(file, 0, time_of);
  if (named || !is_matrix()) {
    if (!named) expect_fields(file, kNumberFields, "1: the number of a 4 x 4 block");
    pose.time = named ? *named : file.number(0, "number");
    if (!file.next()) file.fail("the file ends within a 4 x 4 block");
  }
  const bool whole = file.fields().size() == kMatrixFields;
  for (int row = 0; row < 4; ++row) {
    if (row > 0 && !whole && !file.next()) file.fail("the file ends within a 4 x 4 block");
    if (!whole) expect_fields(file, kRowFields, "4: a row of a pose");
    for (int column = 0; column < 4; ++column)
      pose.world_from_body(row, column) =
          file.number(static_cast<std::size_t>(whole ? 4 * row + column : column), "pose");
  }
  check_rigid(file, pose.world_from_body);
  return pose;
}

void append(std::string& text, double value, char end) {
  char digits[40];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr) += end;
}

}  // namespace

Trajectory read_trajectory(const std::string& path, TrajectoryFormat format,
                           const TimeOfName& time_of) {
  Trajectory poses;
  files::TextFile file(path, '#');
  while (file.next()) {
    if (format == TrajectoryFormat::automatic) format = format_of(file, time_of);
    if (format == TrajectoryFormat::tum)
      poses.push_back(tum_pose(file, time_of));
    else if (format == TrajectoryFormat::kitti)
      poses.push_back(kitti_pose(file, poses.size()));
    else
      poses.push_back(block_pose(file, poses.size(), time_of));
  }
  if (poses.empty()) throw IoError(path + ": holds no pose");
  poses.erase(std::remove_if(poses.begin(), poses.end(),
                             [](const StampedPose& pose) { return std::isnan(pose.time); }),
              poses.end());
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.time < b.time; });
  for (std::size_t k = 1; k < poses.size(); ++k)
    if (poses[k].time == poses[k - 1].time) {
      std::ostringstream time;
      time.precision(17);
      time << poses[k].time;
      throw IoError(path + ": the time " + time.str() + " is there twice");
    }
  return poses;
}

void write_trajectory(const std::string& path, const Trajectory& trajectory) {
  std::string text = "# time tx ty tz qx qy qz qw\n";
  for (const StampedPose& pose : trajectory) {
    const std::string why =
        std::isfinite(pose.time) ? why_not_rigid(pose.world_from_body) : "its time is not finite";
    if (!why.empty())
      throw InvalidArgument("the pose at time " + std::to_string(pose.time) +
                            " is not rigid: " + why);
    const Eigen::Matrix3d turn = pose.world_from_body.topLeftCorner<3, 3>();
    Eigen::Quaterniond q = Eigen::Quaterniond(turn).normalized();
    if (q.w() < 0) q.coeffs() *= -1;  // one sign of the two
    const Eigen::Vector3d t = pose.world_from_body.topRightCorner<3, 1>();
    append(text, pose.time, ' ');
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z()}) append(text, value, ' ');
    append(text, q.w(), '\n');
  }
  files::write_atomically(path, text);
}

}  // namespace gpureg::evaluation
