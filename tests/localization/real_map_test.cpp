// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/io.hpp"
#include "localization/building.hpp"
#include "support/data_folder.hpp"

namespace gpureg::test {
namespace {

/// A fragment without its normals, seen by its cameras, in a random frame.
struct Fragment {
  PointCloud cloud;
  Eigen::Isometry3d frame_from_fragment;

  Fragment(const std::string& folder, int number, unsigned seed) {
    cloud = io::read_point_cloud(folder + "/cloud_bin_" + std::to_string(number) + ".ply");
    cloud.normals.clear();
    std::mt19937 random(seed);
    frame_from_fragment = random_pose(random);
    std::vector<Eigen::Vector3d> cameras = io::read_cameras(folder + "/cameras.txt").at(number);
    for (Eigen::Vector3d& camera : cameras) camera = frame_from_fragment * camera;
    cloud.points = moved(frame_from_fragment, std::move(cloud.points));
    cloud.set_viewpoints(cameras);
  }
};

TEST(RealMap, LeftOutFragmentsOfTheRedKitchenAreFoundAndAHouseIsNot) {
  GPUREG_DATA_FOLDER_OR_SKIP(kitchen, "redkitchen/fragments");
  GPUREG_DATA_FOLDER_OR_SKIP(house, "house/A");
  const Context context = Context::cpu(2);
  const std::vector<int> left_out{2, 12};
  MapBuilder builder(MapOptions{0.05f});
  std::map<int, Eigen::Matrix4d> poses;
  for (const auto& pose : evaluation::read_trajectory(kitchen + "/poses.txt"))
    poses[static_cast<int>(pose.time)] = pose.world_from_body;
  for (const auto& [number, pose] : poses) {
    // Every second one is enough, and takes half of the time.
    if (number % 2 == 0 && number != 0) continue;
    const Fragment fragment(kitchen, number, 1);
    UnalignedIsometry3d map_from_frame;
    map_from_frame.matrix() = pose * fragment.frame_from_fragment.inverse().matrix();
    builder.add_scan(context, fragment.cloud.view(), map_from_frame);
  }
  const PreparedMap map = builder.build();
  for (const int number : left_out) {
    const Fragment fragment(kitchen, number, 50 + static_cast<unsigned>(number));
    const LocateResult result = locate(context, fragment.cloud.view(), map);
    EXPECT_EQ(result.status, LocateStatus::found) << number;
    ASSERT_FALSE(result.poses.empty());
    const Eigen::Vector3d middle = fragment.cloud.points.front().cast<double>();
    const Eigen::Vector3d truth =
        (poses[number] * (fragment.frame_from_fragment.inverse() * middle).homogeneous())
            .hnormalized();
    // The truth is good to about 3 cm, a point far from the centre to twice that.
    EXPECT_LT((result.poses.front().map_from_scan * middle - truth).norm(), 0.1) << number;
  }
  const Fragment foreign(house, 8, 7);
  EXPECT_EQ(locate(context, foreign.cloud.view(), map).status, LocateStatus::not_found);
}

}  // namespace
}  // namespace gpureg::test
