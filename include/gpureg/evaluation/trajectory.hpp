// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Trajectories and their errors (component `evaluation`). Every function is thread-safe.
namespace gpureg::evaluation {

/// A pose at a time.
struct StampedPose {
  double time = 0;  ///< seconds, or whatever counts the poses
  /// p_world = world_from_body * p_body, metres.
  Eigen::Matrix<double, 4, 4, Eigen::DontAlign> world_from_body =
      Eigen::Matrix<double, 4, 4, Eigen::DontAlign>::Identity();
};
using Trajectory = std::vector<StampedPose>;

/// Formats of trajectory files. '#' starts a comment.
enum class TrajectoryFormat {
  automatic,  ///< by the number of fields of the first line
  tum,        ///< lines `time tx ty tz qx qy qz qw`
  kitti,  ///< lines of 12 numbers, the first three rows of the pose; the time is the line's place
  /// Four rows of four; before them `number`, as in poses.txt of gpureg, which is the time, or
  /// nothing: the time is the block's place.
  blocks
};

/// What stands for the time in a file of named poses; NaN: the pose is left out.
using TimeOfName = std::function<std::optional<double>(std::string_view name)>;

/// @param time_of says which time a name means that stands where TUM and blocks have a number, and
///   which may have blanks; none: it is no name, but a number. Without it, names are refused.
/// @return the poses in ascending order of their times.
/// @throws IoError naming file, line and reason: missing, another number of fields than the format
///   has, a number that is not finite, a pose that is not rigid, a time that is there twice, no
///   pose.
Trajectory read_trajectory(const std::string& path,
                           TrajectoryFormat format = TrajectoryFormat::automatic,
                           const TimeOfName& time_of = {});

/// Writes lines `time tx ty tz qx qy qz qw` (TUM), with the digits that give the same numbers when
/// they are read, all or nothing.
/// @throws IoError if writing fails.
/// @throws InvalidArgument for a time that is not finite and a pose that is not rigid.
void write_trajectory(const std::string& path, const Trajectory& trajectory);

/// How the steps of the relative error are counted.
enum class DeltaUnit {
  frames,  ///< every pose and the one `delta` matched poses later
  metres   ///< consecutive steps of at least `delta` along the true path
};

/// Options of evaluate_trajectory().
struct TrajectoryOptions {
  double max_difference = 0.01;  ///< largest difference of times of a match, >= 0
  bool align = true;  ///< moves the estimate rigidly onto the truth, by positions, without scale
  double delta = 1;   ///< of the relative error, > 0; whole if it counts frames
  DeltaUnit delta_unit = DeltaUnit::frames;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Figures of a list of errors.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0, deviation = 0, min = 0, max = 0;
};

/// Error of one pose.
struct PoseError {
  double time = 0;  ///< of the estimated pose
  double metres = 0, degrees = 0;
};

/// Errors of a trajectory.
struct TrajectoryEvaluation {
  std::size_t estimated = 0, true_poses = 0, matched = 0;
  /// Moves the estimate onto the truth; the identity if align is false.
  Eigen::Matrix<double, 4, 4, Eigen::DontAlign> truth_from_estimate =
      Eigen::Matrix<double, 4, 4, Eigen::DontAlign>::Identity();
  double path_length = 0;                ///< of the matched true poses, metres
  ErrorStatistics absolute_translation;  ///< ATE, metres
  ErrorStatistics absolute_rotation;     ///< degrees
  ErrorStatistics relative_translation;  ///< RPE, metres; none if no step is long enough
  ErrorStatistics relative_rotation;     ///< degrees
  std::vector<PoseError> poses;          ///< absolute errors of the matched poses, ascending times
};

/// Matches every pose to the true one with the nearest time (a true pose only once, to the nearer),
/// aligns, and measures.
/// @throws InvalidArgument for options out of range, fewer than 2 matches, or fewer than 3 if
/// the
///   trajectories are to be aligned.
/// Sources: Umeyama 1991, Horn 1987 (alignment); Sturm et al. 2012 (ATE, RPE).
TrajectoryEvaluation evaluate_trajectory(const Trajectory& estimate, const Trajectory& truth,
                                         const TrajectoryOptions& options = {});

}  // namespace gpureg::evaluation
