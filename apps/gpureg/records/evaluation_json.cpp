// SPDX-License-Identifier: BSD-3-Clause
#include "records/evaluation_json.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <map>
#include <set>

namespace gpureg::cli {
namespace {

constexpr double kGoodDistance = 0.2;                        // metres, Redwood's rule
constexpr double kGoodDegrees = 15, kGoodTranslation = 0.3;  // 3DMatch's registration recall

using PairNumbers = std::pair<int, int>;

struct Known {
  Eigen::Matrix4d transform;
  Eigen::Matrix<double, 6, 6> information;
};

double degrees_between(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
  const Eigen::Matrix3d r = a.topLeftCorner<3, 3>().transpose() * b.topLeftCorner<3, 3>();
  const Eigen::Quaterniond q = Eigen::Quaterniond(r).normalized();
  return 2 * std::atan2(q.vec().norm(), std::abs(q.w())) * 180 / M_PI;
}

double metres_between(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
  return (a.topRightCorner<3, 1>() - b.topRightCorner<3, 1>()).norm();
}

void add(std::map<PairNumbers, Known>& known, const std::vector<evaluation::LogEntry>& log,
         const std::vector<evaluation::InformationEntry>& information) {
  for (std::size_t k = 0; k < log.size(); ++k)
    if (log[k].j - log[k].i > 1)
      known[{log[k].i, log[k].j}] = {log[k].transform, information[k].information};
}

Json scores_json(const evaluation::Scores& s) {
  return {
      {"good", s.good},         {"good_recall", s.good_recall}, {"ground_truth", s.ground_truth},
      {"reported", s.reported}, {"recall", s.recall()},         {"precision", s.precision()}};
}

Json ranked_json(const evaluation::RankedScores& r) {
  return {{"raw_recall", r.raw_recall},
          {"recall_at_precision",
           {{"50", r.recall_at_50},
            {"80", r.recall_at_80},
            {"95", r.recall_at_95},
            {"99", r.recall_at_99}}},
          {"average_precision", r.average_precision}};
}

}  // namespace

Json to_json(const evaluation::Evaluation& e) {
  Json json;
  json["strict"] = scores_json(e.strict);
  if (e.strict_ranked) json["strict"].update(ranked_json(*e.strict_ranked));
  if (e.geometric) {
    json["geometric"] = scores_json(*e.geometric);
    if (e.geometric_ranked) json["geometric"].update(ranked_json(*e.geometric_ranked));
  }
  return json;
}

Json pair_verdicts(const evaluation::GroundTruth& truth, const ResultFile& result) {
  std::map<PairNumbers, Known> listed;
  add(listed, truth.log, truth.information);
  std::map<PairNumbers, Known> known = listed;
  add(known, truth.all_log, truth.all_information);
  std::map<PairNumbers, const evaluation::Report*> reports;
  std::set<PairNumbers> tried, all;
  for (const evaluation::Report& report : result.reports) reports[{report.i, report.j}] = &report;
  for (const auto& [pair, unused] : reports) tried.insert(pair);
  for (const PairRecord& pair : result.pairs) tried.insert({pair.i, pair.j});
  for (const auto& [pair, unused] : listed) all.insert(pair);
  for (const PairNumbers& pair : tried)
    if (pair.second - pair.first > 1) all.insert(pair);

  Json verdicts = Json::array();
  for (const PairNumbers& pair : all) {
    const auto at = known.find(pair);
    const auto found = reports.find(pair);
    const bool is_listed = listed.count(pair) != 0;
    Json json = {{"i", pair.first},
                 {"j", pair.second},
                 {"listed", is_listed},
                 {"known", at != known.end()},
                 {"tried", tried.count(pair) != 0},
                 {"reported", false},
                 {"confidence", nullptr},
                 {"overlap_confidence", nullptr},
                 {"error", nullptr},
                 {"degrees", nullptr},
                 {"metres", nullptr},
                 {"strict", false},
                 {"geometric", false}};
    if (found != reports.end()) {
      const evaluation::Report& report = *found->second;
      json["reported"] = report.reported;
      if (result.has_scores) {
        json["confidence"] = report.confidence;
        json["overlap_confidence"] = report.overlap_confidence.value_or(report.confidence);
      }
      if (at != known.end()) {
        const Known& right = at->second;
        const double error =
            evaluation::redwood_error(right.transform, report.transform, right.information);
        json["error"] = error;
        json["degrees"] = degrees_between(right.transform, report.transform);
        json["metres"] = metres_between(right.transform, report.transform);
        json["geometric"] = error <= kGoodDistance;
        if (is_listed) {
          const Known& wanted = listed.at(pair);
          json["strict"] = evaluation::redwood_error(wanted.transform, report.transform,
                                                     wanted.information) <= kGoodDistance;
        }
      }
    }
    if (const auto a = result.names.find(pair.first), b = result.names.find(pair.second);
        a != result.names.end() && b != result.names.end())
      json.update({{"name_i", a->second}, {"name_j", b->second}});
    verdicts.push_back(std::move(json));
  }
  return verdicts;
}

RegistrationRecall registration_recall(const std::string& truth_log, const ResultFile& result) {
  const std::vector<evaluation::LogEntry> truth = evaluation::read_log(truth_log);
  evaluation::check_entries(truth_log, truth);
  std::map<PairNumbers, const evaluation::Report*> reports;
  for (const evaluation::Report& report : result.reports) reports[{report.i, report.j}] = &report;
  RegistrationRecall recall;
  for (const evaluation::LogEntry& entry : truth) {
    ++recall.pairs;
    const auto found = reports.find({entry.i, entry.j});
    if (found == reports.end()) continue;
    ++recall.tried;
    const Eigen::Matrix4d pose = found->second->transform;
    recall.right += degrees_between(entry.transform, pose) <= kGoodDegrees &&
                    metres_between(entry.transform, pose) <= kGoodTranslation;
  }
  return recall;
}

}  // namespace gpureg::cli
