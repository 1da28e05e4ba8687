// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "support/scan.hpp"

namespace gpureg::test {
namespace {

/// Clouds that are read well, but that hold little or strange things.
class DegenerateCloud : public ::testing::Test {
 protected:
  Outcome align(const std::string& source, const std::string& target) const {
    return run(joined({"register", source, target, "--json", folder_ / "r.json"}, kSmall));
  }
  Outcome align(const PointCloud& source, const PointCloud& target) const {
    return align(write_cloud(folder_, "source.ply", source),
                 write_cloud(folder_, "target.ply", target));
  }

  // In either role: status 1, the reason in words, and a JSON result that says the same.
  void expect_not_aligned(const PointCloud& cloud, const std::string& reason_as_source,
                          const std::string& reason_as_target) const {
    const PointCloud room = room_scan(0);
    for (const bool as_source : {true, false}) {
      const Outcome outcome = as_source ? align(cloud, room) : align(room, cloud);
      EXPECT_EQ(outcome.status, 1) << outcome.err;
      expect_holds(outcome.out,
                   {"not_aligned: " + (as_source ? reason_as_source : reason_as_target)});
      EXPECT_EQ(json_of(folder_ / "r.json")["result"]["status"], "not_aligned");
    }
  }

  // Voxels of 0.1 m on a room of 3 m: a refined pose is good to a centimetre or two.
  void expect_aligned(const Outcome& outcome) const {
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    const auto numbers = json_of(folder_ / "r.json")["result"]["target_from_source"];
    Eigen::Isometry3d found = Eigen::Isometry3d::Identity();
    for (int k = 0; k < 16; ++k)
      found.matrix()(k / 4, k % 4) = numbers[static_cast<std::size_t>(k)];
    const Eigen::Isometry3d truth = scan_from_room(1) * scan_from_room(0).inverse();
    EXPECT_LT(rotation_error_degrees(truth, found), 0.5);
    EXPECT_LT((truth.translation() - found.translation()).norm(), 0.05);
  }

  const TemporaryFolder folder_;
};

PointCloud line(int count, float step) {
  PointCloud cloud;
  for (int k = 0; k < count; ++k) cloud.points.emplace_back(step * static_cast<float>(k), 0.f, 1.f);
  return cloud;
}

TEST_F(DegenerateCloud, UpToThreePoints) {
  for (int count = 0; count <= 3; ++count)
    expect_not_aligned(line(count, 0.7f), "too_few_source_points", "too_few_target_points");
}

TEST_F(DegenerateCloud, PointsThatAreNotFinite) {
  PointCloud holed = room_scan(0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < 30; k += 3) {
    holed.points[k].x() = nan;
    holed.points[k + 1].y() = infinity;
    holed.points[k + 2].z() = -infinity;
  }
  const Outcome outcome = align(holed, room_scan(1));
  expect_aligned(outcome);
  expect_holds(outcome.out, {"(30 not finite, dropped)"});
  EXPECT_EQ(json_of(folder_ / "r.json")["source"]["prepare"]["invalid_points"], 30);

  for (Eigen::Vector3f& p : holed.points) p.x() = nan;
  expect_not_aligned(holed, "too_few_source_points", "too_few_target_points");
}

// Thirty thousand points within a kilometre, none near another: more memory than a room.
TEST_F(DegenerateCloud, StrayPoints) {
  PointCloud source = room_scan(0);
  for (int k = 0; k < 30'000; ++k)
    source.points.emplace_back(30.f * static_cast<float>(k % 32) - 480.f,
                               30.f * static_cast<float>(k / 32 % 32) - 480.f,
                               30.f * static_cast<float>(k / 1024) + 30.f);
  const Outcome outcome = align(source, room_scan(1));
  expect_aligned(outcome);
  expect_holds(outcome.out, {"(30,000 stray, dropped)"});
  EXPECT_EQ(json_of(folder_ / "r.json")["source"]["prepare"]["stray_points"], 30'000);
}

}  // namespace
}  // namespace gpureg::test
