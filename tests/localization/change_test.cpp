// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/change.hpp"

#include <gtest/gtest.h>

#include "gpureg/io.hpp"
#include "localization/building.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

using localization::ChangeLabel;
using localization::ChangeOptions;
using localization::ChangeResult;
using localization::PointChanges;

/// A room of 4 x 3 x 2.4 m with a box on its floor, as points on its surfaces that the sensor sees.
struct Room {
  static constexpr float kSide = 0.4f;
  static constexpr float kSpacing = 0.03f;
  std::vector<Eigen::Vector3f> boxes;  ///< corners on the floor

  PointCloud seen_from(const Eigen::Vector3f& sensor) const {
    std::vector<Eigen::AlignedBox3f> solid;
    for (const Eigen::Vector3f& corner : boxes)
      solid.emplace_back(corner, corner + Eigen::Vector3f::Constant(kSide));
    PointCloud cloud;
    cloud.viewpoints = {sensor};
    const auto add = [&](const Eigen::Vector3f& p) {
      for (const Eigen::AlignedBox3f& box : solid)
        if (hides(box, sensor, p)) return;
      cloud.points.push_back(p);
    };
    const auto face = [&](const Eigen::Vector3f& at, const Eigen::Vector3f& a,
                          const Eigen::Vector3f& b) {
      for (float u = kSpacing / 2; u < a.norm(); u += kSpacing)
        for (float v = kSpacing / 2; v < b.norm(); v += kSpacing)
          add(at + u * a.normalized() + v * b.normalized());
    };
    const Eigen::Vector3f x(4, 0, 0), y(0, 3, 0), z(0, 0, 2.4f);
    face({0, 0, 0}, x, y);
    face({0, 0, 0}, x, z);
    face({0, 0, 0}, y, z);
    face(y, x, z);
    face(x, y, z);
    for (const Eigen::Vector3f& corner : boxes) {
      const Eigen::Vector3f i(kSide, 0, 0), j(0, kSide, 0), k(0, 0, kSide);
      face(corner + k, i, j);
      face(corner, i, k);
      face(corner, j, k);
      face(corner + j, i, k);
      face(corner + i, j, k);
    }
    return cloud;
  }

 private:
  /// The segment from a to b passes through the box, other than at its end.
  static bool hides(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& a,
                    const Eigen::Vector3f& b) {
    constexpr int kSteps = 400;
    constexpr float kEnd = 0.995f;
    for (int k = 1; k < kSteps; ++k) {
      const float t = kEnd * static_cast<float>(k) / kSteps;
      if (box.contains((a + t * (b - a)).eval())) return true;
    }
    return false;
  }
};

const Eigen::Vector3f kFirst(1.5f, 1.2f, 0), kSecond(2.6f, 1.7f, 0);
const Eigen::Vector3f kMapSensor(0.6f, 2.2f, 1.7f), kScanSensor(0.8f, 0.6f, 1.6f);

PreparedMap map_of(const Room& room) {
  MapBuilder builder(MapOptions{0.05f});
  builder.add_scan(context(), room.seen_from(kMapSensor).view(), UnalignedIsometry3d::Identity());
  return builder.build();
}

bool on_box(const Eigen::Vector3f& p, const Eigen::Vector3f& corner, float margin) {
  const Eigen::Array3f low = corner.array() - 0.03f, high = corner.array() + Room::kSide + 0.03f;
  return (p.array() > low).all() && (p.array() < high).all() && p.z() > margin;
}

/// Shares of the points on a box and of all others that have the label.
std::pair<double, double> shares(const std::vector<Eigen::Vector3f>& points,
                                 const PointChanges& changes, ChangeLabel label,
                                 const Eigen::Vector3f& corner) {
  double on = 0, labelled_on = 0, off = 0, labelled_off = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const bool labelled = changes.labels[k] == label;
    if (on_box(points[k], corner, 0.1f)) {
      on += 1;
      labelled_on += labelled;
    } else if (!on_box(points[k], corner, -1)) {
      off += 1;
      labelled_off += labelled;
    }
  }
  return {labelled_on / on, labelled_off / off};
}

TEST(Change, AMovedBoxIsGoneHereAndNewThere) {
  const Room before{{kFirst}}, after{{kSecond}};
  const PreparedMap map = map_of(before);
  const PointCloud scan = after.seen_from(kScanSensor);
  const ChangeResult result =
      find_changes(context(), scan.view(), map, UnalignedIsometry3d::Identity());
  ASSERT_EQ(result.scan.labels.size(), scan.points.size());
  ASSERT_EQ(result.map.labels.size(), map.size());
  const auto [appeared, false_new] =
      shares(scan.points, result.scan, ChangeLabel::appeared, kSecond);
  EXPECT_GT(appeared, 0.9);
  EXPECT_LT(false_new, 0.001);
  const PointCloud cloud = map.cloud();
  std::vector<Eigen::Vector3f> placed;
  for (const Eigen::Vector3f& p : cloud.points)
    placed.push_back((p.cast<double>() + cloud.origin).cast<float>());
  const auto [gone, false_gone] = shares(placed, result.map, ChangeLabel::gone, kFirst);
  EXPECT_GT(gone, 0.8);
  EXPECT_LT(false_gone, 0.001);
  // The floor behind the new box.
  EXPECT_GT(result.map.count(ChangeLabel::occluded), 20u);
  for (std::size_t k = 0; k < scan.points.size(); ++k) {
    EXPECT_GE(result.scan.probabilities[k], 0);
    EXPECT_LE(result.scan.probabilities[k], 1);
  }
}

TEST(Change, NothingHasChanged) {
  const Room room{{kFirst, kSecond}};
  const PreparedMap map = map_of(room);
  const PointCloud scan = room.seen_from(kScanSensor);
  const ChangeResult result =
      find_changes(context(), scan.view(), map, UnalignedIsometry3d::Identity());
  EXPECT_EQ(result.scan.count(ChangeLabel::appeared), 0u);
  EXPECT_EQ(result.map.count(ChangeLabel::gone), 0u);
  EXPECT_GT(result.scan.count(ChangeLabel::same), scan.points.size() * 9 / 10);
}

TEST(Change, WhatTheMapNeverSawIsNotNew) {
  Room room{{kFirst}};
  const PreparedMap map = map_of(room);
  // A wall of a room that the map does not have.
  PointCloud scan = room.seen_from(kScanSensor);
  const std::size_t known = scan.points.size();
  for (float y = 0; y < 3; y += 0.03f)
    for (float z = 0; z < 2.4f; z += 0.03f) scan.points.emplace_back(-1.5f, y, z);
  const ChangeResult result =
      find_changes(context(), scan.view(), map, UnalignedIsometry3d::Identity());
  for (std::size_t k = known; k < scan.points.size(); ++k)
    EXPECT_NE(result.scan.labels[k], ChangeLabel::appeared) << k;
}

TEST(Change, WrittenWithColours) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  cloud.origin = {500000, 0, 0};
  PointChanges changes;
  changes.labels = {ChangeLabel::same, ChangeLabel::gone};
  changes.probabilities = {0.9f, 0.8f};
  const TemporaryFolder folder;
  write_changes(folder / "c.ply", cloud, changes);
  const PointCloud read = io::read_point_cloud(folder / "c.ply");
  ASSERT_EQ(read.points.size(), 2u);
  EXPECT_EQ(read.points[1].cast<double>() + read.origin, Eigen::Vector3d(500004, 5, 6));
  changes.labels.pop_back();
  expect_error<InvalidArgument>([&] { write_changes(folder / "c.ply", cloud, changes); },
                                {"1 labels", "2 points"});
  changes.labels.push_back(static_cast<ChangeLabel>(5));
  expect_error<InvalidArgument>([&] { write_changes(folder / "c.ply", cloud, changes); },
                                {"the label 5", "0 to 4"});
  changes.labels.back() = ChangeLabel::same;
  changes.probabilities.pop_back();
  expect_error<InvalidArgument>([&] { write_changes(folder / "c.ply", cloud, changes); },
                                {"1 probabilities", "2 points"});
}

TEST(Change, RefusesWhatCannotBe) {
  const Room room{{kFirst}};
  const PreparedMap map = map_of(room);
  const PointCloud scan = room.seen_from(kScanSensor);
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  pose.linear() *= 2;
  expect_error<InvalidArgument>([&] { find_changes(context(), scan.view(), map, pose); },
                                {"map_from_scan", "rigid"});
  ChangeOptions options;
  options.tolerance = 0;
  expect_error<InvalidArgument>(
      [&] { find_changes(context(), scan.view(), map, UnalignedIsometry3d::Identity(), options); },
      {"tolerance"});
  const ChangeResult empty =
      find_changes(context(), PointCloudView(), map, UnalignedIsometry3d::Identity());
  EXPECT_TRUE(empty.scan.labels.empty());
  EXPECT_EQ(empty.map.count(ChangeLabel::not_observed), map.size());
}

}  // namespace
}  // namespace gpureg::test
