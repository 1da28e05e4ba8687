// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

Points cube(std::size_t count, float width, std::uint32_t seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.5f * width, 0.5f * width);
  Points out(count);
  for (Eigen::Vector3f& p : out) p = {place(random), place(random), place(random)};
  return out;
}

Points room() {
  std::mt19937 random(1);
  return test::scan_room(random);
}

/// Alternately points of both, so that rows do not tell which is which.
Points mixed(const Points& a, const Points& b) {
  Points out;
  for (std::size_t k = 0; k < std::max(a.size(), b.size()); ++k) {
    if (k < a.size()) out.push_back(a[k]);
    if (k < b.size()) out.push_back(b[k]);
  }
  return out;
}

PreparedCloud prepared(const PointCloudView& view) { return prepare(Context::cpu(2), view); }

// Each of them took 22 KB: 30,000 a gigabyte.
TEST(StrayPoints, AreDroppedAndCountedAndLeaveTheRestAsItIs) {
  const Points clean = room(), stray = cube(30'000, 2000);
  Points all = mixed(clean, stray);
  all.insert(all.begin() + 50, Eigen::Vector3f::Constant(std::nanf("")));
  const PreparedCloud expected = prepared(PointCloudView(clean)),
                      cloud = prepared(PointCloudView(all));
  EXPECT_EQ(expected.statistics().stray_points, 0u);
  EXPECT_EQ(cloud.statistics().stray_points, stray.size());
  EXPECT_EQ(cloud.statistics().invalid_points, 1u);
  EXPECT_EQ(cloud.statistics().input_points, all.size());
  EXPECT_EQ(cloud.points(), expected.points());
  EXPECT_EQ(cloud.normals(), expected.normals());
  EXPECT_EQ(cloud.features(), expected.features());
}

TEST(StrayPoints, NormalsStayWithTheirPoints) {
  const Points clean = room(), all = mixed(clean, cube(30'000, 2000));
  const auto with_normals = [](const Points& points, Points& normals) {
    for (const Eigen::Vector3f& p : points) normals.push_back(p.cross(Eigen::Vector3f(1, 2, 3)));
    PointCloudView view(points);
    view.normals = normals.front().data();
    return view;
  };
  Points some, more;
  const PreparedCloud expected = prepared(with_normals(clean, some)),
                      cloud = prepared(with_normals(all, more));
  EXPECT_EQ(cloud.normals(), expected.normals());
  EXPECT_EQ(cloud.features(), expected.features());
}

TEST(StrayPoints, FeaturesStayWithTheirPoints) {
  const Points clean = room(), all = mixed(clean, cube(30'000, 2000));
  const auto with_features = [](const Points& points, std::vector<float>& features) {
    for (const Eigen::Vector3f& p : points) features.insert(features.end(), {p[0], p[1], p[2], 1});
    PointCloudView view(points);
    view.features = features.data();
    view.feature_dimension = 3;
    view.feature_stride = 4;
    return view;
  };
  std::vector<float> some, more;
  const PreparedCloud expected = prepared(with_features(clean, some)),
                      cloud = prepared(with_features(all, more));
  EXPECT_EQ(cloud.statistics().stray_points, 30'000u);
  EXPECT_EQ(cloud.features(), expected.features());
}

// Few stray points cost little; they stay, as the sparse returns of an outdoor scan do.
TEST(StrayPoints, StayWhereTheyAreFew) {
  const PreparedCloud alone = prepared(PointCloudView(room())),
                      cloud = prepared(PointCloudView(mixed(room(), cube(5'000, 2000))));
  EXPECT_EQ(cloud.statistics().stray_points, 0u);
  EXPECT_EQ(cloud.statistics().points, alone.statistics().points + 5'000);
}

// Without downsampling every point counts.
TEST(StrayPoints, AreDroppedFromCloudsThatAreNotDownsampled) {
  PrepareSettings options;
  options.voxel_size = 0;
  const Points clean = prepared(PointCloudView(room())).points();
  const Points all = mixed(clean, cube(30'000, 2000));
  const Context context = Context::cpu(2);
  EXPECT_EQ(prepare(context, PointCloudView(all), options).points(),
            prepare(context, PointCloudView(clean), options).points());
}

TEST(StrayPoints, ACloudOfNothingElseIsRefused) {
  const Points stray = cube(100'000, 200);
  test::expect_error<InvalidArgument>(
      [&] { prepared(PointCloudView(stray)); },
      {"nearly all of 100000 points", "199.99", "voxel_size 0.05", "unit"});
  const Points clean = room();
  test::expect_error<InvalidArgument>(
      [&] {
        prepare_batch(Context::cpu(2), {PointCloudView(clean), PointCloudView(stray)},
                      RegistrationOptions{}, {"room.ply", "stray.ply"});
      },
      {"stray.ply: nearly all of 100000 points"});
}

// Points that all have neighbours, but in too large a volume.
TEST(StrayPoints, WhereTheOtherPointsExceedTheMemoryTheCloudIsRefused) {
  const Points noise = cube(120'000, 12);
  test::expect_error<InvalidArgument>([&] { prepared(PointCloudView(noise)); },
                                      {"120000 points in 11.99", "larger voxel_size"});
  PrepareSettings all;
  all.voxel_size = 0;
  test::expect_error<InvalidArgument>([&] { prepare(Context::cpu(2), PointCloudView(noise), all); },
                                      {"too few for voxel_size 0, which keeps every point"});
  PrepareSettings larger = resolve(RegistrationOptions{0.5f}).prepare;
  larger.wide_feature_radius = 0;
  EXPECT_GT(prepare(Context::cpu(2), PointCloudView(noise), larger).size(), 10'000u);
}

}  // namespace
}  // namespace gpureg
