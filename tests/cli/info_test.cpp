// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

TEST(Info, VersionAndBackends) {
  const Outcome outcome = run({"info"});
  EXPECT_EQ(outcome.status, 0);
  expect_holds(outcome.out, {"gpureg ", "cpu, ", "cuda"});
}

TEST(Info, PointsExtentSpacingAndSuggestion) {
  const TemporaryFolder folder;
  PointCloud grid;  // 101 x 51 points, 0.02 apart
  for (int x = 0; x <= 100; ++x)
    for (int y = 0; y <= 50; ++y)
      grid.points.emplace_back(0.02f * static_cast<float>(x), 0.02f * static_cast<float>(y), 1.f);
  for (int k = 0; k < 3; ++k)
    grid.points.emplace_back(0.f, std::numeric_limits<float>::quiet_NaN(), 0.f);
  const std::string path = write_cloud(folder, "grid.ply", grid);
  const Outcome outcome = run({"info", path});
  EXPECT_EQ(outcome.status, 0);
  expect_holds(outcome.out, {path, "5,154, without normals", "not finite       3\n",
                             "extent           2 1 0, from 0 0 1 to 2 1 1",
                             "spacing          0.02 ", "--voxel-size 0.02"});
}

TEST(Info, SuggestionLeavesAboutFiveThousandPoints) {
  const TemporaryFolder folder;
  PointCloud dense;  // a square of 4 m with a point per square centimetre
  for (int x = 0; x < 400; ++x)
    for (int y = 0; y < 400; ++y)
      dense.points.emplace_back(0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0.f);
  const Outcome outcome = run({"info", write_cloud(folder, "dense.ply", dense)});
  const std::size_t at = outcome.out.find("--voxel-size ");
  ASSERT_NE(at, std::string::npos) << outcome.out;
  const double voxel = std::stod(outcome.out.substr(at + 13));
  EXPECT_NEAR(16 / (voxel * voxel), 5000, 1500) << "voxels of " << voxel << " m";
}

TEST(Info, NamesWhatIsFixedToTheSensor) {
  const TemporaryFolder folder;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<std::string> words = {"info"};
  for (int k = 0; k < 4; ++k) {
    PointCloud scan = room_scan(k);
    const std::size_t size = scan.points.size();
    for (std::size_t n = 0; n < size / 20; ++n) {
      const Eigen::Vector3f any(normal(random), normal(random), normal(random));
      scan.points.emplace_back(Eigen::Vector3f(0.3f, 0.05f, 0.1f) + 0.05f * any.normalized());
      if (n % 4 == 0) scan.points.emplace_back(20 * any.normalized());
    }
    words.push_back(write_cloud(folder, "scan" + std::to_string(k) + ".ply", scan));
  }
  const Outcome outcome = run(words);
  EXPECT_EQ(outcome.status, 0);
  expect_holds(outcome.out, {"points at the largest range of 20 (left out)", "fixed to sensor  ",
                             "at the same place in most of these scans"});
}

TEST(Info, CloudsOfNothing) {
  const TemporaryFolder folder;
  PointCloud cloud;
  const auto info = [&] {
    const Outcome outcome = run({"info", write_cloud(folder, "cloud.ply", cloud)});
    EXPECT_EQ(outcome.status, 0);
    EXPECT_EQ(outcome.out.find("--voxel-size"), std::string::npos) << outcome.out;
    return outcome.out;
  };
  expect_holds(info(), {"points           0"});
  cloud.points.assign(5, {1, 2, 3});
  expect_holds(info(), {"points           5", "all points are at one place"});
  cloud.points.assign(5, Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()));
  expect_holds(info(), {"not finite       5"});
}

TEST(Info, SeveralClouds) {
  const TemporaryFolder folder;
  const std::string a = write_cloud(folder, "a.ply", room_scan(0));
  const std::string b = write_cloud(folder, "b.ply", room_scan(1));
  expect_holds(run({"info", a, b}).out, {a, b});
}

}  // namespace
}  // namespace gpureg::test
