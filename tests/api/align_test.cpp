// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

RegistrationSettings quick() {
  RegistrationSettings o = resolve(RegistrationOptions{0.08f});
  o.quadruples.count = 300000;
  return o;
}

TEST(Align, FindsRandomPoses) {
  const Context context = Context::cpu(2);
  std::mt19937 random(1);
  for (int trial = 0; trial < 6; ++trial) {
    const std::vector<Eigen::Vector3f> target = test::scan_room(random);
    const Eigen::Isometry3d pose = test::random_pose(random);
    const std::vector<Eigen::Vector3f> source =
        test::moved(pose.inverse(), test::scan_room(random));
    PointCloudView a(source), b(target);
    // One sensor for both scans, where normals point to.
    const Eigen::Vector3f eye(1.5f, 2.5f, 1.7f),
        eye_in_source = (pose.inverse() * eye.cast<double>()).cast<float>();
    a.viewpoints = eye_in_source.data();
    a.viewpoint_count = 1;
    b.viewpoints = eye.data();
    b.viewpoint_count = 1;
    const RegistrationResult r = align(context, a, b, quick());
    ASSERT_TRUE(r.aligned()) << to_string(r.reason);
    // Refined on 8 cm centroids of two samplings: some centimetres and half a degree.
    EXPECT_LT(test::translation_error(pose, r.target_from_source), 0.03);
    EXPECT_LT(test::rotation_error_degrees(pose, r.target_from_source), 0.5);
    EXPECT_GT(r.inlier_ratio, 0.8);
    EXPECT_GT(r.confidence, 0.9);
    EXPECT_EQ(r.confidence, r.modes.front().confidence);
    EXPECT_GT(r.inlier_rmse, 0);
    EXPECT_LT(r.inlier_rmse, 0.12);
    const RegistrationStatistics& s = r.statistics;
    EXPECT_EQ(s.hypotheses, quick().compatibility.seeds);
    EXPECT_GT(s.survivors, 0u);
    EXPECT_LE(s.scored, s.survivors);
    EXPECT_LE(s.consensus, s.inliers);
    EXPECT_LE(s.inliers, s.points_scored);
    EXPECT_EQ(s.points_scored, std::min(s.source_points, s.target_points));
    EXPECT_GT(r.timings.total(), 0);
    EXPECT_NEAR(r.source_moments.information_redwood()(0, 0),
                static_cast<double>(r.source_moments.count), 1e-9);
    EXPECT_TRUE(r.target_from_source.linear().isUnitary(1e-9));
  }
}

TEST(Align, SourceAndTargetAreNotMixedUp) {
  const Context context = Context::cpu(2);
  std::mt19937 random(2);
  const Eigen::Isometry3d pose = test::random_pose(random);
  const std::vector<Eigen::Vector3f> target = test::scan_room(random);
  std::vector<Eigen::Vector3f> source = test::moved(pose.inverse(), target);
  // Both ways round, and with either cloud the smaller one: the engine swaps inside.
  for (const bool smaller_as_source : {false, true}) {
    RegistrationSettings o = quick().with_quality(7);
    o.smaller_as_source = smaller_as_source;
    // The last quarter of the points is furniture that one scan alone has: the free space speaks
    // against every pose.
    o.min_confidence = 0;
    const Eigen::Vector3f eye(1.5f, 2.5f, 1.7f),
        eye_in_source = (pose.inverse() * eye.cast<double>()).cast<float>();
    PointCloudView a(source), b(target);
    a.size = a.size * 3 / 4;
    a.viewpoints = eye_in_source.data();
    a.viewpoint_count = 1;
    b.viewpoints = eye.data();
    b.viewpoint_count = 1;
    const RegistrationResult forth = align(context, a, b, o), back = align(context, b, a, o);
    ASSERT_TRUE(forth.aligned() && back.aligned());
    EXPECT_LT(test::translation_error(pose, forth.target_from_source), 0.03);
    EXPECT_LT(test::translation_error(pose.inverse(), back.target_from_source), 0.03);
    EXPECT_EQ(back.statistics.swapped, smaller_as_source);
    EXPECT_FALSE(forth.statistics.swapped);
    EXPECT_EQ(forth.statistics.source_points, back.statistics.target_points);
    // Moments of the source are in its frame, whichever cloud was sampled.
    const Eigen::Vector3d mean =
        back.source_moments.sum / static_cast<double>(back.source_moments.count);
    const Eigen::Vector3d expected =
        forth.target_moments.sum / static_cast<double>(forth.target_moments.count);
    EXPECT_LT((mean - expected).norm(), 0.1);
  }
}

TEST(Align, StridesAndNormalsOfTheInputAreUsed) {
  const Context context = Context::cpu(1);
  std::mt19937 random(3);
  const std::vector<Eigen::Vector3f> points = test::scan_room(random);
  std::vector<float> interleaved;
  for (const Eigen::Vector3f& p : points) {
    interleaved.insert(interleaved.end(), {p.x(), p.y(), p.z(), 7.0f, 0.0f, 0.0f, -1.0f});
  }
  PointCloudView strided(interleaved.data(), points.size());
  strided.point_stride = 7;
  const PreparedCloud a = prepare(context, PointCloudView(points)), b = prepare(context, strided);
  EXPECT_EQ(a.points(), b.points());
  EXPECT_EQ(a.normals(), b.normals());
  strided.normals = interleaved.data() + 4;
  strided.normal_stride = 7;
  PrepareSettings as_given;
  as_given.depth_maps = 0;  // normals of one direction contradict each other, and stay so
  for (const Eigen::Vector3f& n : prepare(context, strided, as_given).normals())
    EXPECT_LE(n.z(), 1e-6f);
}

TEST(AlignBatch, ReportsEveryPairInOrderAndCanBeStopped) {
  const Context context = Context::cpu(2);
  std::mt19937 random(4);
  std::vector<PointCloudView> views;
  std::vector<std::vector<Eigen::Vector3f>> scans;
  for (int k = 0; k < 4; ++k) scans.push_back(test::scan_room(random));
  for (const auto& s : scans) views.emplace_back(s);
  RegistrationSettings o = resolve(RegistrationOptions{0.15f});
  o.quadruples.count = 300;
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views, o.prepare);
  std::vector<Pair> pairs;
  for (int repeat = 0; repeat < 4; ++repeat)
    for (std::uint32_t i = 0; i < 4; ++i)
      for (std::uint32_t j = 0; j < 4; ++j) pairs.push_back({i, j});
  std::vector<std::size_t> seen;
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t p, const RegistrationResult& r) {
    seen.push_back(p);
    EXPECT_NE(r.status, RegistrationStatus::skipped);
  };
  callbacks.should_stop = [&] { return seen.size() >= 20; };
  const std::vector<RegistrationResult> results = align_batch(context, clouds, pairs, o, callbacks);
  ASSERT_EQ(results.size(), pairs.size());
  ASSERT_GE(seen.size(), 20u);
  ASSERT_LT(seen.size(), pairs.size());
  for (std::size_t k = 0; k < seen.size(); ++k) EXPECT_EQ(seen[k], k);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    EXPECT_EQ(results[k].status == RegistrationStatus::skipped, k >= seen.size());
    if (k >= seen.size()) EXPECT_EQ(results[k].reason, RegistrationReason::cancelled);
  }
  EXPECT_TRUE(align_batch(context, clouds, {}, o).empty());
}

}  // namespace
}  // namespace gpureg
