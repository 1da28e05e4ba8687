// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <map>
#include <utility>

#include "evaluation/verdict.hpp"
#include "gpureg/error.hpp"

namespace gpureg::evaluation {
namespace {

constexpr double kGoodSquared = 0.2 * 0.2;  // metres^2, Choi et al. 2015

double squared_error(const Eigen::Matrix4d& ground_truth, const Eigen::Matrix4d& result,
                     const Eigen::Matrix<double, 6, 6>& information) {
  if (!(information(0, 0) > 0))
    throw InvalidArgument("information(0, 0) is " + std::to_string(information(0, 0)) +
                          ", expected the number of correspondences, > 0");
  const Eigen::Matrix4d e = ground_truth.inverse() * result;
  Eigen::Quaterniond q(Eigen::Matrix3d(e.topLeftCorner<3, 3>()));
  q.normalize();
  if (q.w() < 0)
    q.coeffs() =
        -q.coeffs();  // q and -q are the same rotation; the protocol wants the short way round
  Eigen::Matrix<double, 6, 1> er;
  er << e.topRightCorner<3, 1>(), q.vec();
  return er.dot(information * er) / information(0, 0);
}

using Pair = std::pair<int, int>;

struct Truth {
  const LogEntry* log = nullptr;
  const InformationEntry* information = nullptr;
};

// Of a pair that is listed twice the last entry holds, as in the evaluation code published with the
// benchmark.
void add_truths(std::map<Pair, Truth>& truths, const std::vector<LogEntry>& log,
                const std::vector<InformationEntry>& information, const char* name) {
  if (log.size() != information.size())
    throw InvalidArgument(std::string(name) + " has " + std::to_string(log.size()) +
                          " transforms and " + std::to_string(information.size()) +
                          " information matrices, expected as many");
  for (std::size_t k = 0; k < log.size(); ++k)
    if (counts(log[k].i, log[k].j)) truths[{log[k].i, log[k].j}] = {&log[k], &information[k]};
}

bool is_good(const std::map<Pair, Truth>& truths, const Report& report) {
  const auto found = truths.find({report.i, report.j});
  if (found == truths.end()) return false;
  return squared_error(found->second.log->transform, report.transform,
                       found->second.information->information) <= kGoodSquared;
}

Scores count(const std::vector<Verdict>& verdicts, int ground_truth) {
  Scores scores;
  scores.ground_truth = ground_truth;
  for (const Verdict& v : verdicts) {
    if (!v.reported) continue;
    ++scores.reported;
    scores.good += v.good;
    scores.good_recall += v.good_recall;
  }
  return scores;
}

}  // namespace

double redwood_error(const Eigen::Matrix4d& ground_truth, const Eigen::Matrix4d& result,
                     const Eigen::Matrix<double, 6, 6>& information) {
  const double squared = squared_error(ground_truth, result, information);
  return squared < 0 ? 0.0 : std::sqrt(squared);  // rounding may leave -1e-20; NaN stays NaN
}

Evaluation evaluate(const GroundTruth& truth, const std::vector<Report>& reports, bool ranked) {
  std::map<Pair, Truth> wanted, right;
  add_truths(wanted, truth.log, truth.information, "ground truth");
  add_truths(right, truth.log, truth.information, "ground truth");
  add_truths(right, truth.all_log, truth.all_information, "ground truth of all pairs");
  int ground_truth = 0;
  for (const LogEntry& entry : truth.log) ground_truth += counts(entry.i, entry.j);

  std::vector<Verdict> strict, geometric;
  for (const Report& report : reports) {
    if (!counts(report.i, report.j)) continue;
    const bool is_wanted = wanted.count({report.i, report.j}) != 0;
    const bool strictly = is_good(wanted, report), anyhow = is_good(right, report);
    strict.push_back({report.overlap_confidence.value_or(report.confidence), report.reported,
                      strictly, strictly});
    geometric.push_back({report.confidence, report.reported, anyhow, anyhow && is_wanted});
  }

  Evaluation result;
  result.strict = count(strict, ground_truth);
  if (ranked) result.strict_ranked = rank(std::move(strict), ground_truth);
  if (truth.all_log.empty()) return result;
  result.geometric = count(geometric, ground_truth);
  if (ranked) result.geometric_ranked = rank(std::move(geometric), ground_truth);
  return result;
}

MeanScores scene_mean(const std::vector<Scores>& scenes) {
  MeanScores mean;
  if (scenes.empty()) return mean;
  for (const Scores& s : scenes) {
    mean.recall += s.recall();
    mean.precision += s.precision();
  }
  mean.recall /= static_cast<double>(scenes.size());
  mean.precision /= static_cast<double>(scenes.size());
  return mean;
}

}  // namespace gpureg::evaluation
