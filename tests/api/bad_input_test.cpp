// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

RegistrationSettings quick() {
  RegistrationSettings o = resolve(RegistrationOptions{0.08f});
  o.quadruples.count = 20000;
  return o;
}

RegistrationResult run(const std::vector<Eigen::Vector3f>& source,
                       const std::vector<Eigen::Vector3f>& target) {
  return align(Context::cpu(2), PointCloudView(source), PointCloudView(target), quick());
}

std::vector<Eigen::Vector3f> room() {
  std::mt19937 random(1);
  return test::scan_room(random);
}

/// A failure is a status with a reason and no invented pose.
void expect_failure(const RegistrationResult& r, RegistrationReason reason) {
  EXPECT_EQ(r.status, RegistrationStatus::not_aligned);
  EXPECT_EQ(r.reason, reason) << to_string(r.reason);
  EXPECT_FALSE(r.has_pose());
  EXPECT_TRUE(r.target_from_source.matrix().array().isNaN().all());
  EXPECT_EQ(r.confidence, 0);
}

TEST(BadInput, FewPoints) {
  for (std::size_t n = 0; n < 4; ++n) {
    const std::vector<Eigen::Vector3f> all = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Eigen::Vector3f> few(all.begin(),
                                           all.begin() + static_cast<std::ptrdiff_t>(n));
    expect_failure(run(few, room()), RegistrationReason::too_few_source_points);
    expect_failure(run(room(), few), RegistrationReason::too_few_target_points);
    const RegistrationResult both = run(few, few);
    EXPECT_EQ(both.status, RegistrationStatus::not_aligned);
    EXPECT_FALSE(both.has_pose());
  }
}

TEST(BadInput, CollinearAndIdenticalPoints) {
  std::vector<Eigen::Vector3f> line, place(1000, Eigen::Vector3f(1, 2, 3));
  for (int k = 0; k < 1000; ++k)
    line.emplace_back(0.01f * static_cast<float>(k), 0.02f * static_cast<float>(k), 0.0f);
  expect_failure(run(line, line), RegistrationReason::no_usable_features);
  expect_failure(run(line, room()), RegistrationReason::no_usable_features);
  expect_failure(run(place, room()), RegistrationReason::too_few_source_points);
}

TEST(BadInput, NanAndInfinityAreDroppedAndCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  std::vector<Eigen::Vector3f> clean = room(), dirty = clean;
  dirty.insert(dirty.begin() + 100, {{nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}});
  const Context context = Context::cpu(2);
  const PreparedCloud a = prepare(context, PointCloudView(clean), quick().prepare),
                      b = prepare(context, PointCloudView(dirty), quick().prepare);
  EXPECT_EQ(b.statistics().invalid_points, 3u);
  EXPECT_EQ(a.points(), b.points());
  EXPECT_EQ(a.features(), b.features());
  const std::vector<Eigen::Vector3f> all_nan(100, Eigen::Vector3f(nan, nan, nan));
  expect_failure(run(all_nan, clean), RegistrationReason::too_few_source_points);
}

TEST(BadInput, NoOverlapIsNotAligned) {
  // A sphere and a room's corner share no surface; and a threshold of 0.9 is beyond chance
  // alignments.
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> sphere;
  for (int k = 0; k < 20000; ++k)
    sphere.push_back(Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
  RegistrationSettings options = quick();
  options.quadruples.min_inlier_ratio = 0.9f;
  const std::vector<Eigen::Vector3f> corner = room();
  const RegistrationResult r =
      align(Context::cpu(2), PointCloudView(sphere), PointCloudView(corner), options);
  EXPECT_EQ(r.status, RegistrationStatus::not_aligned);
  EXPECT_NE(r.reason, RegistrationReason::none);
  EXPECT_STRNE(explain(r.reason), "");
}

TEST(BadInput, TenKilometresAway) {
  std::mt19937 random(3);
  const std::vector<Eigen::Vector3f> a = test::scan_room(random), b = test::scan_room(random);
  std::vector<Eigen::Vector3f> far;
  for (const Eigen::Vector3f& p : b) far.push_back(p + Eigen::Vector3f(10000, -10000, 5000));
  RegistrationSettings options = quick();
  options.quadruples.count = 50000;
  const RegistrationResult r =
      align(Context::cpu(2), PointCloudView(a), PointCloudView(far), options);
  ASSERT_TRUE(r.aligned()) << to_string(r.reason);
  // Floats near 10^4 have steps of 1 mm; the pose itself is a double.
  const Eigen::Vector3d moved = r.target_from_source * Eigen::Vector3d(1, 1, 1);
  EXPECT_LT((moved - Eigen::Vector3d(10001, -9999, 5001)).norm(), 0.02);
}

TEST(BadInput, LyingViews) {
  const Context context = Context::cpu(1);
  const std::vector<Eigen::Vector3f> points = room();
  const auto expect = [&](auto&& change, const std::string& field) {
    PointCloudView view(points);
    change(view);
    test::expect_error<InvalidArgument>([&] { prepare(context, view); }, {field});
  };
  expect([](auto& v) { v.points = nullptr; }, "cloud.points");
  expect([](auto& v) { v.point_stride = 2; }, "cloud.point_stride");
  expect([](auto& v) { v.size = std::size_t(1) << 40; }, "cloud.size");
  expect(
      [](auto& v) {
        v.normals = v.points;
        v.normal_stride = 1;
      },
      "cloud.normal_stride");
  expect([](auto& v) { v.features = v.points; }, "cloud.feature_dimension");
  expect([](auto& v) { v.feature_dimension = 3; }, "cloud.features");
  expect(
      [](auto& v) {
        v.features = v.points;
        v.feature_dimension = 3;
        v.feature_stride = 2;
      },
      "cloud.feature_stride");
  expect([](auto& v) { v.viewpoint_count = 1; }, "cloud.viewpoints");
  const float nan[3] = {0, std::nanf(""), 0};
  expect(
      [&](auto& v) {
        v.viewpoints = nan;
        v.viewpoint_count = 1;
      },
      "cloud.viewpoints");
  // Finite, but so far away that all rays are one.
  const float far[3] = {0, -1e30f, 0}, satellite[3] = {0, 0, 5e5f};
  expect(
      [&](auto& v) {
        v.viewpoints = far;
        v.viewpoint_count = 1;
      },
      "cloud.viewpoints is -1e+30, expected coordinates within 2^23 times prepare.normal_radius");
  PointCloudView high(points), lost(points);
  high.viewpoints = satellite;
  lost.viewpoints = far;
  high.viewpoint_count = lost.viewpoint_count = 1;
  EXPECT_EQ(prepare(context, high).statistics().viewpoint, ViewpointSource::given);
  test::expect_error<InvalidArgument>([&] { prepare_batch(context, {high, lost}); },
                                      {"clouds[1]: cloud.viewpoints is -1e+30"});
  PointCloudView on_a_map(points);  // nobody said that the origin of the map is a viewpoint
  on_a_map.origin[1] = 5.4e6;
  EXPECT_EQ(prepare(context, on_a_map).size(), prepare(context, PointCloudView(points)).size());
  PointCloud uneven;
  uneven.points.resize(3);
  uneven.normals.resize(2);
  test::expect_error<InvalidArgument>([&] { uneven.view(); }, {"cloud.normals", "2"});
}

TEST(BadInput, AbsurdScaleAndDensityAreErrorsNotHangs) {
  const Context context = Context::cpu(2);
  const std::vector<Eigen::Vector3f> wide = {{0, 0, 0}, {1e7f, 0, 0}, {0, 1e7f, 0}, {0, 0, 1e7f}};
  test::expect_error<InvalidArgument>([&] { prepare(context, PointCloudView(wide)); },
                                      {"voxel_size"});
  std::mt19937 random(4);
  std::uniform_real_distribution<float> place(0, 0.01f);
  std::vector<Eigen::Vector3f> dense(100000);
  for (Eigen::Vector3f& p : dense) p = Eigen::Vector3f(place(random), place(random), place(random));
  PrepareSettings keep;
  keep.voxel_size = 0;
  test::expect_error<InvalidArgument>([&] { prepare(context, PointCloudView(dense), keep); },
                                      {"feature_radius"});
}

// Gigabytes otherwise, for nothing.
TEST(BadInput, MillimetresWithAVoxelInMetres) {
  const Context context = Context::cpu(2);
  std::mt19937 random(4);
  std::vector<Eigen::Vector3f> points;
  for (int scan = 0; scan < 3; ++scan)
    for (const Eigen::Vector3f& p : test::scan_room(random)) points.push_back(p);
  ASSERT_GT(points.size(), 30000u);
  EXPECT_GT(prepare(context, PointCloudView(points)).size(), 1000u);
  for (Eigen::Vector3f& p : points) p *= 1000;
  test::expect_error<InvalidArgument>(
      [&] { prepare(context, PointCloudView(points)); },
      {"points are isolated", "voxel_size 0.05", "unit of the points"});
  // Of several clouds it is said which one.
  const std::vector<Eigen::Vector3f> good = room();
  test::expect_error<InvalidArgument>(
      [&] { prepare_batch(context, {PointCloudView(good), PointCloudView(points)}); },
      {"clouds[1]: nearly all"});
  test::expect_error<InvalidArgument>(
      [&] {
        prepare_batch(context, {PointCloudView(good), PointCloudView(points)},
                      RegistrationOptions{}, {"kitchen", "hall"});
      },
      {"hall: nearly all"});
  test::expect_error<InvalidArgument>(
      [&] {
        prepare_batch(context, {PointCloudView(good), PointCloudView(good)}, RegistrationOptions{},
                      {"kitchen"});
      },
      {"names has 1 entries", "2"});
  test::expect_error<InvalidArgument>(
      [&] {
        align(context, PointCloudView(points), PointCloudView(good), RegistrationOptions{0.05f});
      },
      {"source: nearly all"});
  PointCloudView lying(good);
  lying.point_stride = 1;
  test::expect_error<InvalidArgument>([&] { align(context, PointCloudView(good), lying); },
                                      {"target: cloud.point_stride"});
  // By the points' own unit all is as before; and few points cost little.
  EXPECT_GT(
      prepare(context, PointCloudView(points), resolve(RegistrationOptions{50}).prepare).size(),
      1000u);
  points.resize(3000);
  EXPECT_EQ(prepare(context, PointCloudView(points)).size(), 3000u);
  // Given features with a correspondence distance of the spacing of the points must not fail for an
  // unused feature radius.
  std::vector<Eigen::Vector3f> wide;
  for (int x = 0; x < 150; ++x)
    for (int y = 0; y < 150; ++y)
      wide.emplace_back(0.3f * static_cast<float>(x), 0.3f * static_cast<float>(y), 0.0f);
  PrepareSettings far;
  far.max_correspondence_distance = 0.5f;
  EXPECT_EQ(prepare(context, PointCloudView(wide), far).size(), 22500u);
}

TEST(BadInput, SoFewPointsThatAnyPoseWouldDo) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit;
  for (const std::size_t n : {15u, 20u, 40u})
    for (int k = 0; k < 20; ++k) {
      std::vector<Eigen::Vector3f> a, b;
      for (std::size_t i = 0; i < n; ++i) {
        a.emplace_back(unit(random), unit(random), unit(random));
        b.emplace_back(unit(random), unit(random), unit(random));
      }
      const auto options =
          resolve(RegistrationOptions{std::pow(1.0f / static_cast<float>(n), 1.0f / 3)});
      const RegistrationResult r =
          align(Context::cpu(1), PointCloudView(a), PointCloudView(b), options);
      EXPECT_FALSE(r.aligned()) << n << " points, " << r.confidence;
    }
}

TEST(BadInput, HugeVoxelLeavesTooFewPoints) {
  // Away from the origin, where eight voxels meet whatever their size.
  std::vector<Eigen::Vector3f> points = room();
  for (Eigen::Vector3f& p : points) p += Eigen::Vector3f(10, 10, 10);
  const RegistrationResult r = align(Context::cpu(1), PointCloudView(points),
                                     PointCloudView(points), resolve(RegistrationOptions{1000}));
  EXPECT_EQ(r.reason, RegistrationReason::too_few_source_points);
}

TEST(BadInput, HandlesIndicesAndDistances) {
  const Context context = Context::cpu(1);
  const std::vector<Eigen::Vector3f> points = room();
  const PreparedCloud cloud = prepare(context, PointCloudView(points));
  EXPECT_FALSE(PreparedCloud().valid());
  test::expect_error<InvalidArgument>([&] { PreparedCloud().size(); }, {"prepare()"});
  test::expect_error<InvalidArgument>([&] { align(context, PreparedCloud(), cloud); },
                                      {"clouds[0]"});
  test::expect_error<InvalidArgument>([&] { align_batch(context, {cloud}, {{0, 1}}); },
                                      {"pairs[0]", "cloud 1"});
  RegistrationSettings far = resolve(RegistrationOptions{0.2f});
  test::expect_error<InvalidArgument>([&] { align(context, cloud, cloud, far); },
                                      {"max_correspondence_distance"});
  RegistrationPrior outside;
  outside.correspondences = {{{0, 1000000}}};
  test::expect_error<InvalidArgument>(
      [&] { align(context, cloud, cloud, RegistrationOptions{}, outside); },
      {"prior.correspondences[0]"});
}

}  // namespace
}  // namespace gpureg
