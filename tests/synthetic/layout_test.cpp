// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "gpureg/evaluation.hpp"
#include "scene.hpp"

namespace gpureg::test {
namespace {

class Layout : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    synthetic::generate(folder_->path(), small_scene());
  }
  static void TearDownTestSuite() { delete folder_; }
  static const TemporaryFolder& folder() { return *folder_; }

 private:
  static TemporaryFolder* folder_;
};
TemporaryFolder* Layout::folder_ = nullptr;

TEST_F(Layout, HasEveryFileAndNothingElse) {
  std::string names;
  for (const auto& [name, bytes] : all_files(folder().path())) names += name + " ";
  EXPECT_EQ(names,
            "cameras.txt cloud_bin_0.ply cloud_bin_1.ply cloud_bin_2.ply gt.info gt.log "
            "gt_all.info gt_all.log gt_overlap.txt poses.txt ");
}

TEST_F(Layout, CloudsAreBinaryPlyInFrontOfTheFirstCamera) {
  for (int i = 0; i < 3; ++i) {
    const std::string path = folder() / ("cloud_bin_" + std::to_string(i) + ".ply");
    EXPECT_EQ(content_of(path).rfind("ply\nformat binary_little_endian 1.0\nelement vertex ", 0),
              0u);
    const auto points = read_cloud(path);
    EXPECT_GT(points.size(), 3000u);
    EXPECT_LT(points.size(), 200000u);
    for (const Eigen::Vector3f& p : points) {
      ASSERT_TRUE(p.allFinite());
      ASSERT_LT(p.norm(),
                5.5f);  // 4 m of depth along rays of up to 38 degrees, and a few frames of motion
      ASSERT_GT(p.z(), 0.2f);
    }
  }
}

TEST_F(Layout, PosesStandUprightInTheHouse) {
  const auto poses = read_poses(folder() / "poses.txt");
  ASSERT_EQ(poses.size(), 3u);
  for (const auto& pose : poses) {
    EXPECT_NEAR((pose.linear() * pose.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 0,
                1e-8);  // 10 decimals
    EXPECT_GT(pose.translation().z(), 1.2);
    EXPECT_LT(pose.translation().z(), 1.75);
    EXPECT_LT(pose.linear()(2, 1), -0.8) << "the camera's y axis points down";
  }
}

TEST_F(Layout, CamerasBeginAtTheOriginAndDriftLittle) {
  std::ifstream file(folder() / "cameras.txt");
  int rows = 0;
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
  for (int fragment, frame; file >> fragment >> frame; ++rows) {
    EXPECT_EQ(fragment, rows / 6);
    EXPECT_EQ(frame, rows % 6);
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    file >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    EXPECT_NEAR(q.norm(), 1, 1e-5);
    EXPECT_GE(q.w(), 0);
    Eigen::Isometry3d pose = Eigen::Translation3d(t) * q.normalized();
    if (frame == 0) {
      EXPECT_EQ(t.norm(), 0);
      EXPECT_EQ(q.w(), 1);
    } else {
      const double step = (before.inverse() * pose).translation().norm();
      EXPECT_LT(step, 0.05) << "a hand-held camera at 30 Hz moves a few centimetres at most";
    }
    before = pose;
  }
  EXPECT_EQ(rows, 18);
}

TEST_F(Layout, OverlapListsAllPairsInOrder) {
  std::ifstream file(folder() / "gt_overlap.txt");
  std::string pairs;
  double high = 0, low = 0;
  for (int i, j; file >> i >> j >> high >> low;) {
    pairs += std::to_string(i) + std::to_string(j) + " ";
    EXPECT_GE(high, low);
    EXPECT_GE(low, 0);
    EXPECT_LE(high, 1);
  }
  EXPECT_EQ(pairs, "01 02 12 ");
}

TEST_F(Layout, GroundTruthCanBeReadAndListsTheSamePairs) {
  const evaluation::GroundTruth truth = evaluation::read_ground_truth(folder().path());
  ASSERT_FALSE(truth.log.empty());
  ASSERT_EQ(truth.log.size(), truth.information.size());
  ASSERT_EQ(truth.all_log.size(), truth.all_information.size());
  EXPECT_GE(truth.all_log.size(), truth.log.size());
  for (std::size_t k = 0; k < truth.log.size(); ++k) {
    EXPECT_EQ(truth.log[k].i, truth.information[k].i);
    EXPECT_EQ(truth.log[k].j, truth.information[k].j);
    EXPECT_EQ(truth.log[k].count, 3);
  }
}

}  // namespace
}  // namespace gpureg::test
