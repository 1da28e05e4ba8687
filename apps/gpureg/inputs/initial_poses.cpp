// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/initial_poses.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <locale>
#include <numeric>
#include <sstream>

#include "gpureg/error.hpp"

namespace gpureg::cli {
namespace {

[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& reason) {
  throw IoError(path + ":" + std::to_string(line) + ": " + reason);
}

double number(const std::string& word, const std::string& path, std::size_t line) {
  double value = 0;
  std::istringstream stream(word);
  stream.imbue(std::locale::classic());
  if (!(stream >> value) || stream.peek() != std::istringstream::traits_type::eof() ||
      !std::isfinite(value))
    fail(path, line, "'" + word.substr(0, 40) + "' is no finite number");
  return value;
}

UnalignedIsometry3d pose_of(const Eigen::Matrix4d& matrix, const std::string& path,
                            std::size_t line) {
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  // As the library does: a pose written with four decimals passes, a scale or a shear does not.
  constexpr double kTolerance = 1e-3;
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kTolerance ||
      r.determinant() < 0 || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    fail(path, line, "the matrix that ends here is no rigid motion");
  UnalignedIsometry3d pose;
  pose.matrix() = matrix;
  return pose;
}

}  // namespace

std::vector<UnalignedIsometry3d> read_initial_poses(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw IoError("cannot read " + path);
  std::vector<UnalignedIsometry3d> poses;
  Eigen::Matrix4d matrix;
  int rows = 0;
  std::size_t number_of_line = 0;
  for (std::string line; std::getline(file, line);) {
    ++number_of_line;
    std::istringstream text(line.substr(0, line.find('#')));
    std::vector<std::string> words;
    for (std::string word; text >> word;) words.push_back(word);
    // The first line of a log's block: i, j, count.
    if (words.empty() || (words.size() == 3 && rows == 0)) continue;
    if (words.size() != 4)
      fail(path, number_of_line,
           "row " + std::to_string(rows + 1) + " of a 4 x 4 matrix has " +
               std::to_string(words.size()) + " numbers");
    for (int column = 0; column < 4; ++column)
      matrix(rows, column) = number(words[static_cast<std::size_t>(column)], path, number_of_line);
    if (++rows < 4) continue;
    poses.push_back(pose_of(matrix, path, number_of_line));
    rows = 0;
  }
  if (rows > 0)
    fail(path, number_of_line, "the file ends after row " + std::to_string(rows) + " of a matrix");
  if (poses.empty()) throw IoError(path + ": holds no pose");
  return poses;
}

RegistrationResult result_of(const std::vector<PoseVerification>& poses, double min_confidence) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return poses[a].confidence > poses[b].confidence;
  });
  RegistrationResult result;
  for (const std::size_t k : order) {
    RegistrationMode mode;
    mode.target_from_source = poses[k].target_from_source;
    mode.confidence = poses[k].confidence;
    mode.overlap_confidence = poses[k].overlap_confidence;
    mode.evidence = poses[k].evidence;
    mode.rank_before_refinement = static_cast<std::uint32_t>(k);
    result.modes.push_back(mode);
  }
  const PoseVerification& best = poses[order.front()];
  result.has_candidate = true;
  result.target_from_source = best.target_from_source;
  result.score = best.confidence;
  result.statistics.inliers = best.inliers;
  result.statistics.points_scored = best.points;
  result.inlier_ratio = best.inlier_ratio;
  result.inlier_rmse = best.inlier_rmse;
  result.source_moments = best.source_moments;
  result.target_moments = best.target_moments;
  result.reason = result.score >= min_confidence ? RegistrationReason::none
                                                 : RegistrationReason::confidence_too_low;
  result.status = result.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                            : RegistrationStatus::not_aligned;
  return result;
}

}  // namespace gpureg::cli
