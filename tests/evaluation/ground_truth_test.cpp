// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::evaluation {
namespace {

using test::expect_error;
using test::TemporaryFolder;

LogEntry pose(int i, int j) { return {i, j, 10, Eigen::Matrix4d::Identity()}; }

InformationEntry information(int i, int j, double count = 100) {
  InformationEntry entry{i, j, 10};
  entry.information.diagonal().setConstant(count);
  return entry;
}

TEST(GroundTruth, ReadsWhatIsThere) {
  const TemporaryFolder folder;
  write_log(folder / "gt.log", {pose(0, 1), pose(0, 2)});
  write_information(folder / "gt.info", {information(0, 1), information(0, 2)});
  GroundTruth truth = read_ground_truth(folder.path());
  EXPECT_EQ(truth.log.size(), 2u);
  EXPECT_EQ(truth.information.size(), 2u);
  EXPECT_TRUE(truth.all_log.empty());
  write_log(folder / "gt_all.log", {pose(0, 1), pose(0, 2), pose(0, 5)});
  write_information(folder / "gt_all.info",
                    {information(0, 1), information(0, 2), information(0, 5)});
  truth = read_ground_truth(folder.path());
  EXPECT_EQ(truth.all_log.size(), 3u);
  EXPECT_EQ(truth.all_information.size(), 3u);
}

TEST(GroundTruth, FilesThatContradictEachOtherAreAnError) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { read_ground_truth(folder.path()); }, {"gt.log", "No such file"});
  write_log(folder / "gt.log", {pose(0, 1), pose(0, 2)});
  expect_error<IoError>([&] { read_ground_truth(folder.path()); }, {"gt.info", "No such file"});
  write_information(folder / "gt.info", {information(0, 1)});
  expect_error<IoError>([&] { read_ground_truth(folder.path()); },
                        {"gt.info", "has 1 pairs", "has 2"});
  write_information(folder / "gt.info", {information(0, 2), information(0, 1)});
  expect_error<IoError>([&] { read_ground_truth(folder.path()); },
                        {"gt.info", "entry 1", "pair 0 2", "pair 0 1"});
  write_information(folder / "gt.info", {information(0, 1), information(0, 2, 0)});
  expect_error<IoError>([&] { read_ground_truth(folder.path()); },
                        {"gt.info", "entry 2", "information(0, 0)"});
  write_information(folder / "gt.info", {information(0, 1), information(0, 2)});
  write_information(folder / "gt_all.info", {information(0, 1)});
  expect_error<IoError>([&] { read_ground_truth(folder.path()); }, {"gt_all.log", "No such file"});
}

}  // namespace
}  // namespace gpureg::evaluation
