// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <sstream>

#include "cli/command.hpp"
#include "support/data_folder.hpp"

namespace gpureg::test {
namespace {

struct Published {
  const char* method;
  std::vector<std::string> mean;                      // recall, precision
  std::vector<std::vector<std::string>> scenes = {};  // good, truth, reported
};

std::vector<std::string> words(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> found;
  for (std::string word; stream >> word;) found.push_back(word);
  return found;
}

// Redwood's four scenes, as published with the benchmark and with 3DMatch.
TEST(PublishedLogs, RecallAndPrecisionToTheDigit) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redwood-logs");
  const std::vector<std::string> scenes = {"livingroom1", "livingroom2", "office1", "office2"};
  for (const Published& published : {
           Published{"pcl_modified",
                     {"59.2", "19.6"},
                     {{"166", "271", "610"},
                      {"76", "153", "446"},
                      {"116", "180", "605"},
                      {"83", "135", "559"}}},
           Published{"fpfh", {"46.1", "19.1"}},
           Published{"spin", {"52.0", "21.7"}},
           Published{"3dmatch", {"65.1", "25.2"}},
       }) {
    SCOPED_TRACE(published.method);
    std::vector<std::string> arguments = {"evaluate"}, truths = {"--ground-truth"};
    for (const std::string& scene : scenes) {
      const std::string at = folder + "/iclnuim-" + scene + "-evaluation";
      arguments.push_back(at + "/" + published.method + ".log");
      truths.push_back(at);
    }
    arguments.insert(arguments.end(), truths.begin(), truths.end());
    const Outcome outcome = run(arguments);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    std::istringstream lines(outcome.out);
    std::string line;
    std::getline(lines, line);  // the title
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      std::getline(lines, line);
      const auto row = words(line);
      ASSERT_GE(row.size(), 6u) << outcome.out;
      EXPECT_NE(row[0].find(scenes[k]), std::string::npos);
      if (!published.scenes.empty())
        EXPECT_EQ(std::vector<std::string>(row.begin() + 1, row.begin() + 4), published.scenes[k]);
    }
    std::getline(lines, line);
    const auto mean = words(line);
    ASSERT_EQ(mean.size(), 6u) << line;  // mean of 4 scenes R P
    EXPECT_EQ(std::vector<std::string>(mean.begin() + 4, mean.end()), published.mean);
  }
}

}  // namespace
}  // namespace gpureg::test
