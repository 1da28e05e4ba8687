// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

/// Redwood's pairwise files and evaluation protocol (component `evaluation`; standard library and
/// Eigen only). Every function is thread-safe.
namespace gpureg::evaluation {

/// Matrices without alignment: the layout of these structures must not depend on the processor that
/// a program is compiled for.
using UnalignedMatrix4d = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
using UnalignedMatrix6d = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// One block of a Redwood .log: target_from_source = T_ij maps points of fragment j (source) into
/// fragment i (target).
struct LogEntry {
  /// Fragment indices, and the number of fragments of the scene (third number in the file).
  int i = 0, j = 0, count = 0;
  UnalignedMatrix4d transform = UnalignedMatrix4d::Identity();
  int line = 0;  ///< first line of the block in its file; 0: not read from a file
};

/// One block of a Redwood .info: 6x6 matrix, translation first, then the quaternion vector with
/// factor 2.
struct InformationEntry {
  int i = 0, j = 0, count = 0;
  UnalignedMatrix6d information = UnalignedMatrix6d::Zero();
  int line = 0;  ///< first line of the block in its file; 0: not read from a file
};

/// Readers and writers. Writing goes through a temporary file, flushes and renames: a full disk or
/// a crash never leaves a truncated file under the final name.
/// @throws IoError naming file, line and reason; a transform must be a rotation and a translation
///   with finite elements.
/// @throws InvalidArgument from writers, for entries that no reader would accept (NaN, a negative
///   index).
std::vector<LogEntry> read_log(const std::string& path);
std::vector<InformationEntry> read_information(const std::string& path);
void write_log(const std::string& path, const std::vector<LogEntry>& entries);
void write_information(const std::string& path, const std::vector<InformationEntry>& entries);

/// Checks the blocks of one file against each other.
/// @throws IoError naming file and line if a pair is repeated, if the number of fragments
///   differs from that of the first block, and if i or j is not below it.
void check_entries(const std::string& path, const std::vector<LogEntry>& entries);
void check_entries(const std::string& path, const std::vector<InformationEntry>& entries);

/// Reported pose of one pair, ranked by confidence.
struct Report {
  int i = 0, j = 0;
  UnalignedMatrix4d transform = UnalignedMatrix4d::Identity();
  double confidence = 1;  ///< of another program any number that ranks its poses
  /// false: below the threshold of the method. Counts in curves and in raw recall only.
  bool reported = true;
  /// Ranks under the strict rule, by which a correct pose of a pair with little overlap counts as
  /// false. Empty: confidence.
  std::optional<double> overlap_confidence = std::nullopt;
};

/// Ground truth of one scene.
struct GroundTruth {
  std::vector<LogEntry> log;                  ///< pairs with an overlap of 30 % or more
  std::vector<InformationEntry> information;  ///< in the order of log
  /// Pairs with an overlap of 5 % or more; empty if the scene has no such list.
  std::vector<LogEntry> all_log;
  std::vector<InformationEntry> all_information;
};

/// Reads gt.log and gt.info of a folder, and gt_all.log and gt_all.info if they exist.
/// @throws IoError as the readers and check_entries(), and if a .log and its .info list
///   different pairs or another order.
GroundTruth read_ground_truth(const std::string& folder);

/// Counts and ratios of one scene under one rule. Ratios are in [0, 1]; precision is 1 without a
/// reported pair.
struct Scores {
  int good = 0;          ///< correct reported pairs
  int good_recall = 0;   ///< pairs of gt.log with a correct report
  int ground_truth = 0;  ///< pairs of gt.log with j - i > 1
  int reported = 0;      ///< reported pairs with j - i > 1
  /// @return correct pairs of gt.log / all pairs of gt.log.
  double recall() const { return ground_truth ? double(good_recall) / ground_truth : 0; }
  /// @return correct reported pairs / reported pairs.
  double precision() const { return reported ? double(good) / reported : 1; }
};

/// Recall at fixed precisions and average precision over the ranking by confidence.
struct RankedScores {
  double raw_recall = 0;  ///< recall if the best candidate of every pair is reported
  double recall_at_50 = 0, recall_at_80 = 0, recall_at_95 = 0, recall_at_99 = 0;
  double average_precision = 0;
};

/// Scores of one scene.
struct Evaluation {
  Scores strict;  ///< Redwood's rule: a report outside gt.log is false
  /// Correct if the pair is in gt_all and the error is at most 0.2 m; empty without gt_all.
  std::optional<Scores> geometric;
  std::optional<RankedScores> strict_ranked, geometric_ranked;  ///< if ranked
};

/// Pose error of Redwood (Choi et al. 2015): error^2 = e' Info e / Info(0,0), e = [t; q_xyz] of
/// inverse(T_gt) T. A pose is correct if it is at most 0.2.
/// @return the error, metres.
/// @throws InvalidArgument unless Info(0,0), the number of correspondences, is > 0.
double redwood_error(const Eigen::Matrix4d& ground_truth, const Eigen::Matrix4d& result,
                     const Eigen::Matrix<double, 6, 6>& information);

/// Evaluates the reports of one scene. Only pairs with j - i > 1 count; duplicates count twice.
/// Equal confidences enter the ranking together. Average precision is the sum of precision times
/// gain in recall over all thresholds.
/// @param ranked also fill the ranked scores.
/// @throws InvalidArgument for truths without information matrices and, if ranked, for a
///   confidence that is NaN.
Evaluation evaluate(const GroundTruth& truth, const std::vector<Report>& reports, bool ranked);

/// Unweighted mean over scenes, as in Redwood's table.
struct MeanScores {
  double recall = 0, precision = 0;
};
MeanScores scene_mean(const std::vector<Scores>& scenes);

}  // namespace gpureg::evaluation
