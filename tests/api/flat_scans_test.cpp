// SPDX-License-Identifier: BSD-3-Clause
// Scans of 2-D scanners: recognised, registered in their plane.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "flat/scan_plane.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"
#include "gpureg/voxel_size.hpp"
#include "support/floor_plan.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

const Eigen::Isometry3d kFirst = test::pose_in_plan(-1.2, 0.8, 0.2);
const Eigen::Isometry3d kSecond = test::pose_in_plan(-0.2, -1.0, 2.6);

Points first_scan() { return test::FloorPlan2d().scan(kFirst, 1); }
Points second_scan() { return test::FloorPlan2d().scan(kSecond, 2); }

std::optional<ScanPlane> plane_of(const Points& points) {
  return find_scan_plane(points.front().data(), points.size(), 3);
}

Points moved(const Points& points, const Eigen::Isometry3d& pose) {
  Points out;
  for (const Eigen::Vector3f& p : points) out.push_back((pose * p.cast<double>()).cast<float>());
  return out;
}

Eigen::Isometry3d tilted(double x, double y, double z) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(x, Eigen::Vector3d::UnitX()) *
                   Eigen::AngleAxisd(y, Eigen::Vector3d::UnitY()))
                      .toRotationMatrix();
  pose.translation() << 0, 0, z;
  return pose;
}

/// Points in a rectangle, evenly or at random; noise: across it, metres.
Points patch(float width, float depth, int points, float noise, bool even) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> across(0, 1);
  const float spacing = std::sqrt(width * depth / static_cast<float>(points));
  const int columns = static_cast<int>(width / spacing);
  Points out;
  for (int k = 0; k < points; ++k)
    out.push_back(
        even ? Eigen::Vector3f(spacing * static_cast<float>(k % columns),
                               spacing * static_cast<float>(k / columns), noise * across(random))
             : Eigen::Vector3f(width * unit(random), depth * unit(random), noise * across(random)));
  return out;
}

RegistrationResult registered(const Points& source, const Points& target, unsigned threads = 2) {
  return align(Context::cpu(threads), PointCloudView(source), PointCloudView(target),
               RegistrationOptions{0.05f});
}

TEST(FlatScans, AreRecognised) {
  const Points scan = first_scan();
  const auto plane = plane_of(scan);
  ASSERT_TRUE(plane);
  EXPECT_EQ(plane->normal[0], 0);
  EXPECT_EQ(plane->normal[1], 0);
  EXPECT_EQ(plane->normal[2], 1);
  EXPECT_EQ(plane->offset, 0);

  const auto higher = plane_of(moved(scan, tilted(0, 0, 0.3)));
  ASSERT_TRUE(higher);
  EXPECT_EQ(higher->offset, static_cast<double>(0.3f));

  Points gaps = scan;
  gaps[5].setConstant(std::numeric_limits<float>::quiet_NaN());
  gaps[7].x() = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(plane_of(gaps)) << "readings without a return";
  EXPECT_TRUE(plane_of(test::FloorPlan2d().scan(kFirst, 3, 0.03f))) << "a noisy scanner";
  EXPECT_TRUE(plane_of(test::FloorPlan2d().scan(kFirst, 3, 0.01f, 180))) << "two degrees";

  Points map;
  for (unsigned k = 0; k < 8; ++k) {
    const Eigen::Isometry3d pose = test::pose_in_plan(-1.2 + 0.3 * k, 0.8, 0.4 * k);
    for (const auto& p : moved(test::FloorPlan2d().scan(pose, k), pose)) map.push_back(p);
  }
  EXPECT_TRUE(plane_of(map)) << "several scans in one";
}

TEST(FlatScans, ATiltedPlaneIsOne) {
  const Eigen::Isometry3d tilt = tilted(0.3, -0.2, 1.5);
  for (const bool in_millimetres : {false, true}) {
    Points scan = moved(first_scan(), tilt);
    // As files with three decimals have them.
    if (in_millimetres)
      for (Eigen::Vector3f& p : scan) p = (p * 1000).array().round().matrix() / 1000;
    const auto plane = plane_of(scan);
    ASSERT_TRUE(plane);
    const Eigen::Vector3d normal = tilt.linear().col(2);
    // A millimetre of rounding over ten metres.
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(plane->normal[k], normal[k], 1e-4);
  }
}

// The outline of a room that the scanner sees all of is closed, as the surface of a part is.
TEST(FlatScans, AClosedRoomIsNoModel) {
  const Eigen::Isometry3d pose = test::pose_in_plan(-1.1, -0.7, 1.4);
  const Points scan = test::FloorPlan2d().scan(pose, 3);
  const Context context = Context::cpu(2);
  const RegistrationOptions options{0.05f};
  const auto viewpoint_of = [&](const Points& points) {
    return prepare(context, PointCloudView(points), options).statistics().viewpoint;
  };
  EXPECT_EQ(viewpoint_of(scan), ViewpointSource::origin) << to_string(viewpoint_of(scan));
  EXPECT_NE(viewpoint_of(moved(scan, pose)), ViewpointSource::model);
  const RegistrationResult result = registered(scan, first_scan());
  EXPECT_TRUE(result.aligned()) << explain(result);
}

TEST(FlatScans, OtherCloudsAreNone) {
  EXPECT_FALSE(plane_of(patch(4, 3, 5000, 0, true))) << "a floor without noise";
  EXPECT_FALSE(plane_of(patch(4, 3, 5000, 0, false))) << "a floor without noise, at random";
  EXPECT_FALSE(plane_of(patch(4, 3, 5000, 0.005f, true))) << "a floor";
  EXPECT_FALSE(plane_of(patch(10, 1, 5000, 0, true))) << "a strip";
  EXPECT_FALSE(plane_of(patch(2, 0.2f, 1000, 0, true))) << "a narrow strip";
  EXPECT_FALSE(plane_of(patch(1, 1, 200, 0, false))) << "few points";
  Points box = patch(4, 3, 2000, 0, true);
  for (const Eigen::Vector3f& p : patch(4, 3, 2000, 0, true)) box.emplace_back(p.x(), p.y(), 0.1f);
  EXPECT_FALSE(plane_of(box)) << "a thin box";
  EXPECT_FALSE(plane_of(Points(100, Eigen::Vector3f(1, 2, 3)))) << "one place";
  EXPECT_FALSE(plane_of(Points(1, Eigen::Vector3f(1, 2, 3)))) << "one point";
  Points line;
  for (int k = 0; k < 200; ++k)
    line.push_back(0.01f * static_cast<float>(k) * Eigen::Vector3f(1, 2, 3));
  EXPECT_FALSE(plane_of(line)) << "a line lies in many planes";
  for (Eigen::Vector3f& p : line) p.z() = 0;
  EXPECT_FALSE(plane_of(line)) << "a line without noise";
  std::mt19937 random(3);
  EXPECT_FALSE(plane_of(test::scan_room(random))) << "a room";
}

TEST(FlatScans, AreRegisteredInTheirPlane) {
  const RegistrationResult result = registered(first_scan(), second_scan());
  ASSERT_EQ(result.status, RegistrationStatus::aligned) << result.confidence;
  EXPECT_TRUE(result.flat);
  const Eigen::Isometry3d truth = kSecond.inverse() * kFirst;
  const Eigen::Matrix4d pose = result.target_from_source.matrix();
  // A point in ten of a voxel.
  EXPECT_LT((pose - truth.matrix()).cwiseAbs().maxCoeff(), 0.02);
  for (const RegistrationMode& mode : result.modes) {
    const Eigen::Matrix4d m = mode.target_from_source.matrix();
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(m(2, k), 0);
      EXPECT_EQ(m(k, 2), 0);
    }
    EXPECT_EQ(m(2, 2), 1);
    EXPECT_EQ(m(2, 3), 0);
    // No motion out of the plane is searched or reported.
    for (const std::size_t k : {0, 1, 5}) EXPECT_EQ(mode.evidence.weakest_direction[k], 0);
  }
  // Of points in the plane: motions in it (x, y, about z) do not mix with those out of it.
  const auto information = result.source_moments.information_open3d();
  EXPECT_LT(result.source_moments.count, first_scan().size());
  for (const int in : {2, 3, 4})
    for (const int out : {0, 1, 5}) EXPECT_EQ(information(in, out), 0);
}

TEST(FlatScans, TheEvidenceIsThatOfThePlanarPose) {
  const Context context = Context::cpu(2);
  // The layers let these drift out of their plane, each at its own voxel size.
  for (const float voxel : {0.05f, 0.08f, 0.12f, 0.15f}) {
    RegistrationOptions options{voxel};
    options.min_confidence = 0;
    const auto source = prepare(context, PointCloudView(first_scan()), options),
               target = prepare(context, PointCloudView(second_scan()), options);
    const RegistrationResult found = align(context, source, target, options);
    ASSERT_EQ(found.reason, RegistrationReason::none);
    std::vector<UnalignedIsometry3d> poses;
    for (const RegistrationMode& mode : found.modes) poses.push_back(mode.target_from_source);
    const std::vector<PoseVerification> as_they_are =
        verify_poses(context, source, target, poses, options, {false, false});
    ASSERT_EQ(as_they_are.size(), found.modes.size());
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const PoseEvidence &a = found.modes[k].evidence, &b = as_they_are[k].evidence;
      EXPECT_NEAR(a.source_overlap, b.source_overlap, 0.01) << voxel << " " << k;
      EXPECT_NEAR(a.target_overlap, b.target_overlap, 0.01) << voxel << " " << k;
    }
    // A pose that is refined stays in the plane, with its evidence.
    VerificationOptions refine;
    refine.refine = true;
    const PoseVerification refined =
        verify_poses(context, source, target, {poses.front()}, options, refine).front();
    EXPECT_EQ(refined.target_from_source(2, 3), 0);
    EXPECT_NEAR(refined.inlier_ratio, found.inlier_ratio, 0.02) << voxel;
  }
}

TEST(FlatScans, TheSmallerCloudMayBeTheTarget) {
  const RegistrationResult result = registered(second_scan(), first_scan());
  ASSERT_TRUE(result.aligned()) << result.confidence;
  ASSERT_TRUE(result.statistics.swapped);
  for (const RegistrationMode& mode : result.modes) {
    EXPECT_EQ(mode.target_from_source(2, 3), 0);
    for (const std::size_t k : {0, 1, 5}) EXPECT_EQ(mode.evidence.weakest_direction[k], 0);
  }
}

TEST(FlatScans, PlanesMayDiffer) {
  const Eigen::Isometry3d of_source = tilted(0.3, -0.2, 1.5), of_target = tilted(-0.1, 0.4, -2);
  const RegistrationResult result =
      registered(moved(first_scan(), of_source), moved(second_scan(), of_target));
  ASSERT_TRUE(result.aligned()) << result.confidence;
  const Eigen::Isometry3d truth = of_target * kSecond.inverse() * kFirst * of_source.inverse();
  EXPECT_LT((result.target_from_source.matrix() - truth.matrix()).cwiseAbs().maxCoeff(), 0.03);
  const Eigen::Vector3d normal = result.target_from_source.linear() * of_source.linear().col(2);
  // The planes were fitted to floats.
  EXPECT_LT((normal - of_target.linear().col(2)).norm(), 1e-5);
}

TEST(FlatScans, SameBitsForAnyThreads) {
  const RegistrationResult one = registered(first_scan(), second_scan(), 1),
                           many = registered(first_scan(), second_scan(), 4);
  EXPECT_EQ(one.confidence, many.confidence);
  EXPECT_EQ(one.target_from_source.matrix(), many.target_from_source.matrix());
}

TEST(FlatScans, NormalsAcrossThePlaneAreIgnored) {
  const Points source = first_scan(), target = second_scan();
  const Points up(source.size(), Eigen::Vector3f::UnitZ());
  PointCloudView with(source);
  with.normals = up.front().data();
  const RegistrationResult result =
      align(Context::cpu(2), with, PointCloudView(target), RegistrationOptions{0.05f});
  EXPECT_TRUE(result.aligned()) << result.confidence;
}

TEST(FlatScans, CountsAreOfTheScan) {
  Points scan = first_scan();
  scan[3].setConstant(std::numeric_limits<float>::quiet_NaN());
  const PreparedCloud cloud = prepare(Context::cpu(2), PointCloudView(scan));
  EXPECT_TRUE(cloud.statistics().flat);
  EXPECT_EQ(cloud.statistics().input_points, scan.size());
  EXPECT_EQ(cloud.statistics().invalid_points, 1u);
}

TEST(FlatScans, OfAnotherPlaceAreUnlikelyWithoutAThreshold) {
  Points circle;
  for (int k = 0; k < 720; ++k) {
    const float angle = static_cast<float>(k) * 0.0087266f;
    circle.emplace_back(3 * std::cos(angle),
                        3 * std::sin(angle) + 0.001f * static_cast<float>(k % 7), 0.0f);
  }
  RegistrationOptions options{0.05f};
  options.min_confidence = 0;
  const RegistrationResult result =
      align(Context::cpu(2), PointCloudView(first_scan()), PointCloudView(circle), options);
  EXPECT_TRUE(result.flat);
  EXPECT_LT(result.confidence, 0.2);
  EXPECT_EQ(result.aligned(), result.has_pose());
  if (result.has_pose()) {
    EXPECT_GT(result.statistics.inliers, 0u);
    EXPECT_EQ(result.target_from_source(2, 3), 0);
  }
}

TEST(FlatScans, WithA3dCloudIsRefused) {
  std::mt19937 random(3);
  const RegistrationResult result = registered(first_scan(), test::scan_room(random));
  EXPECT_EQ(result.status, RegistrationStatus::not_aligned);
  EXPECT_EQ(result.reason, RegistrationReason::flat_with_solid);
  EXPECT_FALSE(result.has_pose());
}

}  // namespace
}  // namespace gpureg
