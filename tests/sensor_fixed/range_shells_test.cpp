// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "gpureg/io.hpp"
#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/registration.hpp"
#include "sensor_fixed/scans.hpp"
#include "support/data_folder.hpp"

namespace gpureg {
namespace {

using test::any_direction;
using test::Points;
using test::room;
using test::scan;

/// A spinning scanner of so many rings, 1.8 m above level ground, out to 100 m.
Points rings_on_ground(int rings, float noise, std::mt19937& random) {
  std::normal_distribution<float> error(0, noise);
  Points out;
  for (int ring = 0; ring < rings; ++ring)
    for (int k = 0; k < 2000; ++k) {
      const float up = -0.4f + 0.45f * static_cast<float>(ring) / static_cast<float>(rings),
                  turn = static_cast<float>(k) * 0.0031416f;
      const float range = up < 0 ? -1.8f / std::sin(up) : 0;
      if (range > 0 && range < 100)
        out.push_back((range + error(random)) * Eigen::Vector3f(std::cos(turn) * std::cos(up),
                                                                std::sin(turn) * std::cos(up),
                                                                std::sin(up)));
    }
  return out;
}

/// Adds so large a share of points at a range, in directions about an axis.
Points with_shell(Points points, float share, float range, float noise, float width,
                  std::mt19937& random) {
  std::normal_distribution<float> error(0, noise), side(0, width);
  const auto count =
      static_cast<std::size_t>(share / (1 - share) * static_cast<float>(points.size()));
  for (std::size_t k = 0; k < count; ++k)
    points.push_back((range + error(random)) *
                     Eigen::Vector3f(1, side(random), side(random)).normalized());
  return points;
}

RangeLimits limits_of(const Points& points) { return range_limits(PointCloudView(points)); }

class RangeShells : public testing::Test {
 protected:
  std::mt19937 random_{3};
  const Points room_ = scan(room, 40'000, 0.005f, random_);
};

TEST_F(RangeShells, OfTheLargestRangeAreFoundWhateverTheirShareNoiseAndDirections) {
  for (const float share : {0.01f, 0.05f, 0.2f})
    for (const float noise : {0.0f, 0.003f, 0.02f})
      for (const float width : {0.2f, 0.7f, 5.0f}) {
        const Points points = with_shell(room_, share, 30, noise, width, random_);
        const RangeLimits found = limits_of(points);
        EXPECT_EQ(found.largest_points, points.size() - room_.size())
            << share << " " << noise << " " << width;
        EXPECT_NEAR(found.largest_range, 30, 5 * noise + 1e-4);
        EXPECT_EQ(found.smallest_points, 0u);
      }
}

TEST_F(RangeShells, OfTheSmallestRangeAndAtTheSensorAreFound) {
  for (const float share : {0.01f, 0.05f, 0.2f}) {
    const Points near = with_shell(room_, share, 0.3f, 0.002f, 2, random_);
    EXPECT_EQ(limits_of(near).smallest_points, near.size() - room_.size());
    EXPECT_NEAR(limits_of(near).smallest_range, 0.3, 0.02);
    const Points none = with_shell(room_, share, 0, 0, 2, random_);
    EXPECT_EQ(limits_of(none).smallest_points, none.size() - room_.size());
    EXPECT_EQ(limits_of(none).smallest_range, 0);
  }
}

TEST_F(RangeShells, AreSeenFromTheViewpointThatIsSaid) {
  Points points = with_shell(room_, 0.02f, 30, 0.002f, 0.7f, random_);
  const std::size_t added = points.size() - room_.size();
  const Eigen::Vector3f viewpoint(8, -3, 2);
  for (Eigen::Vector3f& p : points) p += viewpoint;
  EXPECT_EQ(limits_of(points).points(), 0u);
  PointCloudView view(points);
  view.viewpoints = viewpoint.data();
  view.viewpoint_count = 1;
  EXPECT_EQ(range_limits(view).largest_points, added);
}

TEST_F(RangeShells, OfA2dScannerAreFound) {
  Points points;
  for (int k = 0; k < 2000; ++k) {
    const float turn = static_cast<float>(k) * 0.0031416f;
    const Eigen::Vector3f d(std::cos(turn), std::sin(turn), 0);
    points.push_back(k % 20 == 0 ? 30 * d : room(d) * d);
  }
  EXPECT_EQ(limits_of(points).largest_points, 100u);
}

TEST_F(RangeShells, AreNotSeenInSurfaces) {
  const auto dome = [](const Eigen::Vector3f& d) { return d.z() < -0.3f ? -1.5f / d.z() : 5.0f; };
  const auto ball = [](const Eigen::Vector3f&) { return 5.0f; };
  const auto barrel = [](const Eigen::Vector3f& d) {
    const float level = std::hypot(d.x(), d.y());
    return std::abs(d.z()) > 0.4f * level ? 2 / std::abs(d.z()) : 5 / level - 0.8f * d.z() * d.z();
  };
  const auto tower = [](const Eigen::Vector3f& d) {
    const float level = std::hypot(d.x(), d.y());
    return std::min(5 / level, 4 / std::abs(d.z()));
  };
  const auto wall = [](const Eigen::Vector3f& d) { return d.x() > 0.7f ? 6 / d.x() : 0.0f; };
  const auto far_wall = [](const Eigen::Vector3f& d) {
    return d.x() > 0.97f ? 60 / d.x() : room(d);
  };
  const auto clipped = [](const Eigen::Vector3f& d) {
    const float range = d.x() > 0.7f ? room(d) : 0;
    return range < 4.2f ? range : 0;
  };
  for (const float noise : {0.0f, 0.003f, 0.02f}) {
    EXPECT_EQ(limits_of(room_).points(), 0u);
    EXPECT_EQ(limits_of(scan(dome, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(ball, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(barrel, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(tower, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(wall, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(far_wall, 40'000, noise, random_)).points(), 0u) << noise;
    EXPECT_EQ(limits_of(scan(clipped, 40'000, noise, random_)).points(), 0u) << noise;
    for (const int rings : {16, 64, 128})
      EXPECT_EQ(limits_of(rings_on_ground(rings, noise, random_)).points(), 0u)
          << rings << " " << noise;
  }
}

TEST_F(RangeShells, AreNotAllOfACloud) {
  EXPECT_EQ(limits_of(Points(1000, Eigen::Vector3f::Zero())).points(), 0u);
  EXPECT_EQ(limits_of(Points(1000, Eigen::Vector3f(1, 2, 3))).points(), 0u);
  EXPECT_EQ(limits_of(Points(1000, Eigen::Vector3f::Constant(std::nanf("")))).points(), 0u);
  EXPECT_EQ(limits_of({}).points(), 0u);
}

TEST_F(RangeShells, OfModelsAndCloudsWithoutViewpointStay) {
  const Points points = with_shell(room_, 0.05f, 30, 0, 0.7f, random_);
  PointCloudView view(points);
  view.infer_viewpoint = false;
  EXPECT_EQ(range_limits(view).points(), 0u);
  view.infer_viewpoint = true;
  view.normals = points.front().data();
  EXPECT_EQ(range_limits(view).points(), 0u);
}

TEST_F(RangeShells, ArePreparedAsIfTheyWereNotThere) {
  Points points = with_shell(room_, 0.05f, 30, 0, 0.7f, random_);
  const std::size_t added = points.size() - room_.size();
  points.insert(points.begin() + 7, Eigen::Vector3f::Constant(std::nanf("")));
  const Context context = Context::cpu(2);
  RegistrationOptions options{0.1f};
  const PreparedCloud expected = prepare(context, PointCloudView(room_), options),
                      cloud = prepare(context, PointCloudView(points), options);
  EXPECT_EQ(cloud.points(), expected.points());
  EXPECT_EQ(cloud.features(), expected.features());
  const PrepareStatistics& s = cloud.statistics();
  EXPECT_EQ(s.range_limit_points, added);
  EXPECT_EQ(s.input_points, points.size());
  EXPECT_EQ(s.invalid_points, 1u);
  EXPECT_NEAR(s.largest_range, 30, 1e-4);
  EXPECT_EQ(expected.statistics().range_limit_points, 0u);
  options.prepare.keep_range_limits = true;
  const PreparedCloud all = prepare(context, PointCloudView(points), options);
  EXPECT_GT(all.size(), cloud.size());
  EXPECT_EQ(all.statistics().range_limit_points, 0u);
}

TEST(RangeShellsInRealScans, AreFoundInACorridor) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "corridor3");
  for (int k = 0; k < 3; ++k) {
    const PointCloud cloud = io::read_point_cloud(folder + "/scan" + std::to_string(k) + ".ply");
    const RangeLimits limits = range_limits(cloud.view());
    EXPECT_NEAR(limits.largest_range, 32.767, 1e-3);
    EXPECT_GT(limits.largest_points, 1300u);
    EXPECT_LT(limits.largest_points, 1630u);
  }
}

TEST(RangeShellsInRealScans, AreNotSeenWhereThereAreNone) {
  for (const char* set : {"kitti", "redkitchen/fragments", "house/A", "hospital/E"}) {
    GPUREG_DATA_FOLDER_OR_SKIP(folder, set);
    for (const auto& file : std::filesystem::directory_iterator(folder))
      if (file.path().extension() == ".ply")
        EXPECT_EQ(range_limits(io::read_point_cloud(file.path().string()).view()).points(), 0u)
            << file.path();
  }
}

}  // namespace
}  // namespace gpureg
