// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

/// Redwood's pairwise files and protocol (component `evaluation`; standard library and Eigen only).
namespace gpureg::evaluation {

/// Matrices without alignment, so that these structures have one layout whatever processor a
/// program is compiled for.
using UnalignedMatrix4d = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
using UnalignedMatrix6d = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// One block of a Redwood .log: target_from_source = T_ij maps points of fragment j (source) into
/// fragment i (target).
struct LogEntry {
  /// count: number of fragments of the scene, as in the file's third number
  int i = 0, j = 0, count = 0;
  UnalignedMatrix4d transform = UnalignedMatrix4d::Identity();
  int line = 0;  ///< of the file that it was read from, where the block begins; 0: it was not read
};

/// One block of a Redwood .info: translation first, quaternion vector with factor 2.
struct InformationEntry {
  int i = 0, j = 0, count = 0;
  UnalignedMatrix6d information = UnalignedMatrix6d::Zero();
  int line = 0;  ///< as LogEntry's
};

/// Read or write. Throw IoError naming file, line and reason; a transform must be a rotation and a
/// translation, every number finite. Writing goes through a temporary file, flushes, and renames,
/// so a full disk or a crash never leaves a truncated file under the final name. Writers throw
/// InvalidArgument for entries that no reader would take back (NaN, a negative index).
std::vector<LogEntry> read_log(const std::string& path);
std::vector<InformationEntry> read_information(const std::string& path);
void write_log(const std::string& path, const std::vector<LogEntry>& entries);
void write_information(const std::string& path, const std::vector<InformationEntry>& entries);

/// What a single block cannot show: throws IoError naming file and line where a pair stands twice,
/// where the number of fragments differs from the first block's, and where i or j is not below it.
void check_entries(const std::string& path, const std::vector<LogEntry>& entries);
void check_entries(const std::string& path, const std::vector<InformationEntry>& entries);

/// A report of one pair, ranked by score.
struct Report {
  int i = 0, j = 0;
  UnalignedMatrix4d transform = UnalignedMatrix4d::Identity();
  double score = 1;
  /// false: tried, but below the caller's threshold (counts in curves and in raw recall only)
  bool reported = true;
  /// Ranks instead of score under the strict rule, by which a right pose of a pair with little
  /// overlap is wrong.
  std::optional<double> strict_score = std::nullopt;
};

struct GroundTruth {
  std::vector<LogEntry> log;                  ///< pairs with overlap >= 30 %
  std::vector<InformationEntry> information;  ///< same order
  /// overlap >= 5 %; empty where the scene has none
  std::vector<LogEntry> all_log;
  std::vector<InformationEntry> all_information;
};

/// Reads gt.log, gt.info and, where they exist, gt_all.log and gt_all.info of a folder. Throws
/// IoError, also where a .log and its .info do not list the same pairs in the same order, and by
/// check_entries.
GroundTruth read_ground_truth(const std::string& folder);

/// Counts and ratios of one scene under one rule. Ratios in [0, 1]; precision is 1 where nothing is
/// reported.
struct Scores {
  int good = 0;          ///< reported pairs that are right
  int good_recall = 0;   ///< of gt.log's pairs, those reported right
  int ground_truth = 0;  ///< gt.log's pairs with j - i > 1
  int reported = 0;      ///< reported pairs with j - i > 1
  double recall() const { return ground_truth ? double(good_recall) / ground_truth : 0; }
  double precision() const { return reported ? double(good) / reported : 1; }
};

/// Recall at fixed precisions and average precision over the ranking by score.
struct RankedScores {
  double raw_recall = 0;  ///< right when every best candidate is reported
  double recall_at_50 = 0, recall_at_80 = 0, recall_at_95 = 0, recall_at_99 = 0;
  double average_precision = 0;
};

struct Evaluation {
  Scores strict;  ///< Redwood's rule: a report that is not in gt.log is wrong
  /// right when in gt_all and within 0.2 m; where gt_all exists
  std::optional<Scores> geometric;
  std::optional<RankedScores> strict_ranked, geometric_ranked;  ///< where reports carry scores
};

/// error^2 = e' Info e / Info(0,0), e = [t; q_xyz] of inverse(T_gt) T; good iff <= 0.2^2 (Choi et
/// al. 2015). Returns metres. Throws InvalidArgument unless Info(0,0), the number of
/// correspondences, is > 0.
double redwood_error(const Eigen::Matrix4d& ground_truth, const Eigen::Matrix4d& result,
                     const Eigen::Matrix<double, 6, 6>& information);

/// The protocol. Only reports and truths with j - i > 1 count; duplicates count twice. ranked: also
/// fill the ranked scores. Equal scores enter the ranking together; the strict ranking goes by
/// strict_score where a report has one. Average precision is the sum of precision times gain in
/// recall over all thresholds. Throws InvalidArgument for truths without their information matrices
/// and, where ranked, for a score that is NaN.
Evaluation evaluate(const GroundTruth& truth, const std::vector<Report>& reports, bool ranked);

/// Unweighted mean of recall and precision over scenes, as Redwood's table has it.
struct MeanScores {
  double recall = 0, precision = 0;
};
MeanScores scene_mean(const std::vector<Scores>& scenes);

}  // namespace gpureg::evaluation
