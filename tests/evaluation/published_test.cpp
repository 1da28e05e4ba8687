// SPDX-License-Identifier: BSD-3-Clause
// The protocol must reproduce the figures that were published for the Redwood benchmark's logs.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "gpureg/evaluation.hpp"
#include "support/data_folder.hpp"

namespace gpureg::evaluation {
namespace {

constexpr std::array kScenes = {"livingroom1", "livingroom2", "office1", "office2"};

std::string scene_folder(const std::string& root, const char* scene) {
  return (std::filesystem::path(root) / (std::string("iclnuim-") + scene + "-evaluation")).string();
}

std::vector<Report> reports_of(const std::string& root, const char* scene,
                               const std::string& method) {
  std::vector<Report> reports;
  for (const LogEntry& e :
       read_log((std::filesystem::path(scene_folder(root, scene)) / (method + ".log")).string()))
    reports.push_back({e.i, e.j, e.transform});
  return reports;
}

std::vector<Scores> scores_of(const std::string& root, const std::string& method) {
  std::vector<Scores> scores;
  for (const char* scene : kScenes)
    scores.push_back(evaluate(read_ground_truth(scene_folder(root, scene)),
                              reports_of(root, scene, method), false)
                         .strict);
  return scores;
}

// Percent with one digit, as the tables print it.
std::string percent(double recall, double precision) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f / %.1f", 100 * recall, 100 * precision);
  return text;
}

std::string table_entry(const std::vector<Scores>& scores) {
  const MeanScores mean = scene_mean(scores);
  return percent(mean.recall, mean.precision);
}

TEST(Published, RecallAndPrecisionToTheDigit) {
  GPUREG_DATA_FOLDER_OR_SKIP(root, "redwood-logs");
  EXPECT_EQ(table_entry(scores_of(root, "pcl_modified")), "59.2 / 19.6");
  EXPECT_EQ(table_entry(scores_of(root, "fpfh")), "46.1 / 19.1");
  EXPECT_EQ(table_entry(scores_of(root, "spin")), "52.0 / 21.7");
  EXPECT_EQ(table_entry(scores_of(root, "3dmatch")), "65.1 / 25.2");
}

TEST(Published, CountsOfChoiZhouKoltunPerScene) {
  GPUREG_DATA_FOLDER_OR_SKIP(root, "redwood-logs");
  const std::vector<Scores> scores = scores_of(root, "pcl_modified");
  const int expected[4][3] = {{166, 271, 610}, {76, 153, 446}, {116, 180, 605}, {83, 135, 559}};
  for (std::size_t k = 0; k < 4; ++k) {
    SCOPED_TRACE(kScenes[k]);
    EXPECT_EQ(scores[k].good, expected[k][0]);
    EXPECT_EQ(scores[k].good_recall, expected[k][0]);
    EXPECT_EQ(scores[k].ground_truth, expected[k][1]);
    EXPECT_EQ(scores[k].reported, expected[k][2]);
  }
}

TEST(Published, RedKitchenHasBothTruthsAndFindsItsOwnPosesRight) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const GroundTruth truth = read_ground_truth(folder);
  std::vector<Report> reports;
  for (const LogEntry& e : truth.all_log) reports.push_back({e.i, e.j, e.transform});
  const Evaluation result = evaluate(truth, reports, true);
  EXPECT_EQ(result.strict.ground_truth, 137);
  EXPECT_EQ(result.strict.good, 137);
  ASSERT_TRUE(result.geometric.has_value());
  EXPECT_EQ(result.geometric->reported, 164);
  EXPECT_EQ(result.geometric->good, 164);
  EXPECT_EQ(result.geometric->good_recall, 137);
  EXPECT_EQ(result.geometric_ranked->recall_at_99, 1);
}

TEST(Published, EveryLogAtHandCanBeRead) {
  GPUREG_DATA_FOLDER_OR_SKIP(root, ".");
  int logs = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const std::string extension = entry.path().extension().string();
    SCOPED_TRACE(entry.path().string());
    if (extension != ".log" && extension != ".info") continue;
    const std::size_t entries = extension == ".log"
                                    ? read_log(entry.path().string()).size()
                                    : read_information(entry.path().string()).size();
    EXPECT_GT(entries, 0u);
    ++logs;
  }
  EXPECT_GT(logs, 30);
}

}  // namespace
}  // namespace gpureg::evaluation
