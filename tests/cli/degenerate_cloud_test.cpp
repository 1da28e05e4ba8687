// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

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

  // The last run aligned, and took the point to where it belongs. Voxels of 0.1 m on a room of 3 m:
  // a refined pose is good to a centimetre or two.
  void expect_aligned(const Outcome& outcome, const Eigen::Isometry3d& truth,
                      const Eigen::Vector3f& point, double degrees = 0.5) const {
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    const auto numbers = json_of(folder_ / "r.json")["result"]["target_from_source"];
    Eigen::Isometry3d found = Eigen::Isometry3d::Identity();
    for (int k = 0; k < 16; ++k)
      found.matrix()(k / 4, k % 4) = numbers[static_cast<std::size_t>(k)];
    EXPECT_LT(rotation_error_degrees(truth, found), degrees);
    EXPECT_LT((truth * point.cast<double>() - found * point.cast<double>()).norm(), 0.05);
  }

  const TemporaryFolder folder_;
};

const Eigen::Isometry3d kTruth = scan_from_room(1) * scan_from_room(0).inverse();

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
  expect_aligned(outcome, kTruth, {0, 0, 0});
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
  expect_aligned(outcome, kTruth, {0, 0, 0});
  expect_holds(outcome.out, {"(30,000 stray, dropped)"});
  EXPECT_EQ(json_of(folder_ / "r.json")["source"]["prepare"]["stray_points"], 30'000);
}

// PCD, as it can say where the sensor was: seen from a far origin, walls would turn their backs to
// it.
std::string pcd_seen_from(const Eigen::Vector3f& sensor, const PointCloud& cloud) {
  std::ostringstream text;
  text.precision(9);
  text << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH "
       << cloud.points.size() << "\nHEIGHT 1\nVIEWPOINT " << sensor.transpose()
       << " 1 0 0 0\nPOINTS " << cloud.points.size() << "\nDATA ascii\n";
  for (const Eigen::Vector3f& p : cloud.points) text << p.transpose() << "\n";
  return text.str();
}

TEST_F(DegenerateCloud, CoordinatesOfTenKilometres) {
  // A float has a millimetre left there.
  const Eigen::Vector3f far(10000, -10000, 10000);
  const Eigen::Isometry3d away(Eigen::Translation3d(far.cast<double>()));
  PointCloud source = room_scan(0), target = room_scan(1);
  source.points = moved(away, source.points);
  target.points = moved(away, target.points);
  const Outcome outcome = align(folder_.write("source.pcd", pcd_seen_from(far, source)),
                                folder_.write("target.pcd", pcd_seen_from(far, target)));
  expect_aligned(outcome, away * kTruth * away.inverse(), far);
}

TEST_F(DegenerateCloud, OnePointTenKilometresAway) {
  PointCloud source = room_scan(0);
  source.points.emplace_back(10000.f, 10000.f, -10000.f);
  // The stray point draws the middle of the cloud kilometres away, where floats are coarse: 3
  // degrees are still a voxel at 2 m.
  expect_aligned(align(source, room_scan(1)), kTruth, {0, 0, 0}, 3);
}

}  // namespace
}  // namespace gpureg::test
