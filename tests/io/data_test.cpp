// SPDX-License-Identifier: BSD-3-Clause
// Files that other programs wrote: KinectFusion-like fragments, CloudCompare's scans, PCL's and
// Open3D's clouds.
#include <gtest/gtest.h>

#include <filesystem>

#include "gpureg/io.hpp"
#include "support/data_folder.hpp"

namespace gpureg::io {
namespace {

TEST(Data, EveryCloudAtHandCanBeRead) {
  GPUREG_DATA_FOLDER_OR_SKIP(root, ".");
  int clouds = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".ply" && extension != ".pcd") continue;
    SCOPED_TRACE(entry.path().string());
    const PointCloud cloud = read_point_cloud(entry.path().string());
    EXPECT_GT(cloud.points.size(), 1000u);
    for (const Eigen::Vector3f& p : cloud.points) ASSERT_TRUE(p.norm() < 1000) << p.transpose();
    // Not all are of unit length: fgr marks an unknown normal by (-1, -1, -1), rotated or not.
    for (const Eigen::Vector3f& n : cloud.normals) ASSERT_TRUE(n.norm() < 1.8f) << n.transpose();
    ++clouds;
  }
  EXPECT_GT(clouds, 100);
}

TEST(Data, KnownCounts) {
  GPUREG_DATA_FOLDER_OR_SKIP(lidar, "lidar");
  EXPECT_EQ(read_point_cloud(lidar + "/source.ply").points.size(), 69792u);
  GPUREG_DATA_FOLDER_OR_SKIP(kitchen, "redkitchen/fragments");
  const PointCloud fragment = read_point_cloud(kitchen + "/cloud_bin_0.ply");
  EXPECT_EQ(fragment.points.size(), 109833u);
  EXPECT_EQ(fragment.normals.size(), 109833u);
}

TEST(Data, FragmentsAndCamerasOfTheRedKitchen) {
  GPUREG_DATA_FOLDER_OR_SKIP(kitchen, "redkitchen/fragments");
  const auto fragments = list_scans(kitchen);
  ASSERT_EQ(fragments.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_EQ(fragments[k].number, k);
  const auto cameras = read_cameras(kitchen + "/cameras.txt");
  ASSERT_EQ(cameras.size(), 20u);
  for (const auto& [fragment, positions] : cameras) EXPECT_EQ(positions.size(), 50u) << fragment;
}

}  // namespace
}  // namespace gpureg::io
