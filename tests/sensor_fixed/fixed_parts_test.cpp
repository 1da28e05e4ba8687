// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "gpureg/io.hpp"
#include "gpureg/preparation/sensor_fixed.hpp"
#include "sensor_fixed/parts.hpp"
#include "sensor_fixed/scans.hpp"
#include "support/data_folder.hpp"

namespace gpureg {
namespace {

using test::add;
using test::of_disc;
using test::of_frame;
using test::of_hand;
using test::of_vehicle;
using test::Part;
using test::Points;
using test::views_of;

/// A scan of a furnished room of 9 x 7 x 2.6 m from a place and a heading, in the frame of the
/// sensor.
Points scan_from(const Eigen::Vector3f& place, float heading, std::mt19937& random) {
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(heading, Eigen::Vector3f::UnitZ()).toRotationMatrix();
  const auto range = [&](const Eigen::Vector3f& in_sensor) {
    const Eigen::Vector3f d = turn * in_sensor, low(0, 0, 0), high(9, 7, 2.6f);
    float nearest = 1e9f;
    for (int k = 0; k < 3; ++k)
      if (d[k] != 0) nearest = std::min(nearest, ((d[k] > 0 ? high[k] : low[k]) - place[k]) / d[k]);
    for (int column = 0; column < 6; ++column) {
      const Eigen::Vector2f centre(1.5f + 1.2f * static_cast<float>(column),
                                   column % 2 == 0 ? 2.0f : 5.5f),
          from = place.head<2>() - centre, along = d.head<2>();
      const float a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - 0.09f,
                  root = b * b - a * c;
      if (root > 0 && -b - std::sqrt(root) > 0)
        nearest = std::min(nearest, (-b - std::sqrt(root)) / a);
    }
    return nearest;
  };
  return test::scan(range, 20'000, 0.004f, random);
}

std::vector<Points> walk(int scans, std::mt19937& random) {
  std::uniform_real_distribution<float> unit;
  std::vector<Points> out;
  for (int k = 0; k < scans; ++k)
    out.push_back(
        scan_from({1 + 7 * unit(random), 3 + unit(random), 1.2f}, 6.28f * unit(random), random));
  return out;
}

class SensorFixedParts : public testing::Test {
 protected:
  std::mt19937 random_{11};
};

TEST_F(SensorFixedParts, AreFoundWhateverTheyAre) {
  for (const Part& part : {Part(of_vehicle), Part(of_hand), Part(of_disc), Part(of_frame)})
    for (const double share : {0.02, 0.05, 0.2}) {
      std::vector<Points> scans = walk(8, random_);
      std::vector<std::size_t> clean;
      for (const Points& scan : scans) clean.push_back(scan.size());
      add(part, share, scans, random_);
      const std::vector<PointCloudView> views = views_of(scans);
      const FixedParts parts = find_fixed_parts(views);
      for (std::size_t k = 0; k < scans.size(); ++k) {
        const std::vector<std::uint32_t> rows = rows_in(parts, views[k]);
        const double added = static_cast<double>(scans[k].size() - clean[k]);
        EXPECT_GE(static_cast<double>(rows.size()), 0.98 * added) << share;
        const auto own = std::count_if(rows.begin(), rows.end(),
                                       [&](std::uint32_t row) { return row < clean[k]; });
        EXPECT_LE(own, 50) << share;  // of 20,000 of the room
      }
    }
}

TEST_F(SensorFixedParts, AreNotSeenInScansOfTheRoom) {
  for (const int scans : {3, 4, 8, 20})
    for (int k = 0; k < 5; ++k)
      EXPECT_TRUE(find_fixed_parts(views_of(walk(scans, random_))).cells.empty()) << scans;
}

TEST_F(SensorFixedParts, AreNotSeenInScansFromOnePlace) {
  std::vector<Points> scans;
  for (int k = 0; k < 6; ++k) scans.push_back(scan_from({3, 3, 1.2f}, 0.3f, random_));
  EXPECT_TRUE(find_fixed_parts(views_of(scans)).cells.empty());
  add(of_hand, 0.05, scans, random_);
  EXPECT_TRUE(find_fixed_parts(views_of(scans)).cells.empty());
}

TEST_F(SensorFixedParts, NeedThreeScansOfKnownSensors) {
  std::vector<Points> scans = walk(6, random_);
  add(of_hand, 0.05, scans, random_);
  std::vector<PointCloudView> views = views_of(scans);
  EXPECT_TRUE(find_fixed_parts({views[0], views[1]}).cells.empty());
  EXPECT_TRUE(find_fixed_parts({}).cells.empty());
  for (PointCloudView& view : views) view.infer_viewpoint = false;
  EXPECT_TRUE(find_fixed_parts(views).cells.empty());
}

TEST(SensorFixedPartsInRealScans, AreTheMountOfTheScannerAndNothingElse) {
  const auto cells = [](const std::string& folder, std::size_t most) {
    std::vector<PointCloud> clouds;
    for (const auto& file : std::filesystem::directory_iterator(folder))
      if (file.path().extension() == ".ply" && clouds.size() < most)
        clouds.push_back(io::read_point_cloud(file.path().string()));
    std::vector<PointCloudView> views;
    for (PointCloud& cloud : clouds) {
      cloud.normals.clear();
      views.push_back(cloud.view());
    }
    return find_fixed_parts(views).cells.size();
  };
  for (const char* set : {"kitti", "redkitchen/fragments", "house/A", "hospital/E"}) {
    GPUREG_DATA_FOLDER_OR_SKIP(folder, set);
    EXPECT_EQ(cells(folder, 100), 0u) << set;
  }
  GPUREG_DATA_FOLDER_OR_SKIP(corridor, "corridor3");
  EXPECT_GT(cells(corridor, 3), 0u);
}

}  // namespace
}  // namespace gpureg
