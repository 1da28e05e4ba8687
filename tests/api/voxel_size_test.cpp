// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/voxel_size.hpp"

#include <gtest/gtest.h>

#include <ctime>
#include <limits>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

VoxelSizeSuggestion suggest(const std::vector<Points>& clouds) {
  std::vector<PointCloudView> views;
  for (const Points& cloud : clouds) views.emplace_back(cloud);
  return suggest_voxel_size(views);
}

std::uint32_t prepared_points(const Points& cloud, float voxel_size) {
  const Context context = Context::cpu(2);
  return prepare(context, PointCloudView(cloud), RegistrationOptions{voxel_size})
      .statistics()
      .points;
}

Points room(unsigned seed) {
  std::mt19937 random(seed);
  return test::scan_room(random);
}

/// A closed surface with bumps, about `size` across.
Points object(float size, std::size_t count, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  Points points;
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector3f d =
        Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    const float bumps = 1 + 0.2f * std::sin(5 * d.x()) * std::cos(4 * d.y() + d.z());
    points.push_back(0.5f * size * bumps * d);
  }
  return points;
}

/// Rings of a spinning scanner, ever wider apart: ground up to 60 m, and four walls.
Points lidar(int rings = 64) {
  Points points;
  for (int ring = 0; ring < rings; ++ring)
    for (int step = 0; step < 1800; ++step) {
      const float turn = 6.2831853f * static_cast<float>(step) / 1800;
      const float down = 0.03f + 0.4f * static_cast<float>(ring) / static_cast<float>(rings);
      const Eigen::Vector3f d(std::cos(turn), std::sin(turn), -down);
      const float wall = 40 / std::max(std::abs(d.x()), std::abs(d.y()));
      points.push_back(std::min(wall, 1.8f / down) * d);
    }
  return points;
}

TEST(VoxelSize, LeavesThousandsOfPoints) {
  const std::vector<Points> clouds = {room(1), object(0.15f, 40000), object(150, 40000), lidar()};
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    const VoxelSizeSuggestion s = suggest({clouds[k]});
    ASSERT_TRUE(s.valid()) << k;
    const std::uint32_t left = prepared_points(clouds[k], s.voxel_size);
    // Distant rings keep fewer.
    EXPECT_GE(left, k == 3 ? 1000u : 3000u) << "cloud " << k << ", voxels of " << s.voxel_size;
    EXPECT_LE(left, 20000u) << "cloud " << k << ", voxels of " << s.voxel_size;
    EXPECT_NEAR(static_cast<double>(s.points), left, 0.25 * left) << "cloud " << k;
  }
}

TEST(VoxelSize, TwoCloudsWithoutOptionsAreAlignedBySuggestedVoxels) {
  Points source = room(1), target = room(1);
  for (Eigen::Vector3f& p : source) p *= 100;  // centimetres
  for (Eigen::Vector3f& p : target) p = 100 * p + Eigen::Vector3f(30, 0, 0);
  const PointCloudView a(source), b(target);
  const float size = suggest({source, target}).voxel_size;
  const RegistrationResult chosen = align(Context::cpu(2), a, b);
  EXPECT_EQ(chosen.voxel_size, size);
  EXPECT_TRUE(chosen.aligned());
  EXPECT_EQ(test::bytes(chosen),
            test::bytes(align(Context::cpu(2), a, b, RegistrationOptions{size})));
  const Points one_place(5, Eigen::Vector3f(1, 2, 3));
  const PointCloudView nothing(one_place);
  EXPECT_EQ(align(Context::cpu(2), nothing, nothing).reason,
            RegistrationReason::too_few_source_points);
}

// Voxels smaller than the gaps between the rings leave neighbours on one ring, without normals.
TEST(VoxelSize, ExceedsTheGapsBetweenRings) {
  const Points few = lidar(16);
  const VoxelSizeSuggestion s = suggest({few});
  ASSERT_TRUE(s.valid());
  EXPECT_GE(prepared_points(few, s.voxel_size), 1000u);
  // Of the points on the nearest quarter of the ground, which has rings up to 2 m apart.
  const Context context = Context::cpu(2);
  const auto share = [&](float size) {
    const PreparedCloud cloud = prepare(context, PointCloudView(few), RegistrationOptions{size});
    std::size_t upright = 0, near = 0;
    const auto points = cloud.points(), normals = cloud.normals();
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (points[k].head<2>().norm() > 15 || points[k].z() > -1) continue;
      ++near;
      upright += std::abs(normals[k].z()) > 0.9f;
    }
    return static_cast<double>(upright) / static_cast<double>(near);
  };
  EXPECT_GT(share(s.voxel_size), 0.9);
}

// The size follows the smaller cloud, of which it would else leave a hundred points.
TEST(VoxelSize, LeavesAThousandPointsOfAPartOnAScene) {
  Points scene, part;
  for (unsigned k = 0; k < 9; ++k)
    for (const Eigen::Vector3f& p : object(4, 30000, k + 1))
      scene.push_back(
          p + Eigen::Vector3f(6.f * static_cast<float>(k % 3), 6.f * static_cast<float>(k / 3), 0));
  for (const Eigen::Vector3f& p : scene)
    if ((p - scene.front()).norm() < 1) part.push_back(p);
  const float alone = suggest({scene}).voxel_size, pair = suggest({part, scene}).voxel_size;
  EXPECT_LT(prepared_points(part, alone), 300u);
  EXPECT_LT(pair, alone);
  EXPECT_GE(prepared_points(part, pair), 1000u);
  EXPECT_EQ(suggest({scene, part}).voxel_size, pair);
  // A larger part, which voxels of the scene would leave a thousand points of, keeps more.
  Points larger;
  for (const Eigen::Vector3f& p : scene)
    if ((p - scene.front()).norm() < 2.5f) larger.push_back(p);
  EXPECT_GE(prepared_points(larger, suggest({larger, scene}).voxel_size), 3000u);
  // One part among many scenes does not make all of them slow.
  const float set = suggest({scene, scene, scene, part}).voxel_size;
  EXPECT_LE(prepared_points(scene, set), 25000u);
}

// Points that are missing at random leave gaps, which features must span.
TEST(VoxelSize, ThinnedScansKeepLargeVoxels) {
  std::mt19937 random(3);
  std::bernoulli_distribution keep(0.1);
  const auto thinned = [&](const Points& points) {
    Points out;
    for (const Eigen::Vector3f& p : points)
      if (keep(random)) out.push_back(p);
    return out;
  };
  const Points scan = lidar(32), few = thinned(scan);
  EXPECT_GT(suggest({few}).voxel_size, 0.7f * suggest({scan}).voxel_size);
  EXPECT_GE(prepared_points(few, suggest({few}).voxel_size), 900u);
}

TEST(VoxelSize, FollowsTheUnit) {
  const double metres = static_cast<double>(suggest({object(0.15f, 40000)}).voxel_size);
  const double millimetres = static_cast<double>(suggest({object(150, 40000)}).voxel_size);
  EXPECT_NEAR(millimetres / metres, 1000, 100);  // rounding may fall to another digit
}

TEST(VoxelSize, RowsThatAreNoPointsAndRepetitionsDoNotMatter) {
  const Points plain = room(1);
  Points dirty;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Eigen::Vector3f& p : plain) {
    dirty.insert(dirty.end(), 3, p);
    dirty.emplace_back(p.x(), nan, std::numeric_limits<float>::infinity());
  }
  EXPECT_EQ(suggest({plain}).voxel_size, suggest({dirty}).voxel_size);
  EXPECT_EQ(suggest({plain}).spacing, suggest({dirty}).spacing);
  // Rows of PCL and of arrays: four floats apart.
  std::vector<float> padded;
  for (const Eigen::Vector3f& p : plain) padded.insert(padded.end(), {p.x(), p.y(), p.z(), 1});
  PointCloudView view(padded.data(), plain.size());
  view.point_stride = 4;
  EXPECT_EQ(suggest_voxel_size({view}).voxel_size, suggest({plain}).voxel_size);
}

// Every neighbour of most points is at the same place: the search of another one took 4 s of
// processor time, now 0.4 s.
TEST(VoxelSize, MillionsOfPointsAtOnePlaceCostLittle) {
  Points cloud(4'000'000, {1, 2, 3});
  for (int k = 0; k < 100; ++k)
    cloud[static_cast<std::size_t>(k) * 40'000] += Eigen::Vector3f(0.01f * k, 0, 0);
  const std::clock_t begin = std::clock();
  const VoxelSizeSuggestion s = suggest({cloud});
  EXPECT_LT(std::clock() - begin, 2 * CLOCKS_PER_SEC);
  EXPECT_NEAR(s.spacing, 0.01, 1e-6);
}

TEST(VoxelSize, OrderOfThePointsDoesNotMatterMuchAndNothingIsRandom) {
  Points cloud = room(1);
  const VoxelSizeSuggestion once = suggest({cloud}), twice = suggest({cloud});
  EXPECT_EQ(once.voxel_size, twice.voxel_size);
  EXPECT_EQ(once.noise, twice.noise);
  std::mt19937 random(9);
  std::shuffle(cloud.begin(), cloud.end(), random);
  EXPECT_EQ(suggest({cloud}).voxel_size, once.voxel_size);
}

TEST(VoxelSize, NotBelowTheSpacing) {
  Points grid;
  for (int x = 0; x <= 100; ++x)
    for (int y = 0; y <= 10; ++y)
      grid.emplace_back(0.02f * static_cast<float>(x), 0.02f * static_cast<float>(y), 1.f);
  const VoxelSizeSuggestion s = suggest({grid});
  EXPECT_NEAR(s.spacing, 0.02, 1e-6);
  EXPECT_FLOAT_EQ(s.voxel_size, 0.02f);
}

TEST(VoxelSize, RoughSurfacesNeedLargerVoxels) {
  // A square metre with 5 cm of noise: voxels of 1.4 cm would be half air.
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(0, 1);
  std::normal_distribution<float> normal(0, 0.05f);
  Points smooth, rough;
  for (int k = 0; k < 60000; ++k) {
    const float x = place(random), y = place(random), z = normal(random);
    smooth.emplace_back(x, y, 0.02f * z);
    rough.emplace_back(x, y, z);
  }
  const VoxelSizeSuggestion a = suggest({smooth}), b = suggest({rough});
  EXPECT_LT(a.noise, 0.004);
  EXPECT_GT(b.voxel_size, 1.5f * a.voxel_size);
  EXPECT_GE(prepared_points(rough, b.voxel_size), 2500u);
}

TEST(VoxelSize, OneSizeForASet) {
  std::vector<Points> clouds;
  for (unsigned k = 0; k < 20; ++k) clouds.push_back(room(k));
  clouds[3].clear();
  clouds[7].assign(9, {1, 2, 3});
  const VoxelSizeSuggestion all = suggest(clouds), one = suggest({clouds[0]});
  EXPECT_NEAR(all.voxel_size, one.voxel_size, 0.2f * one.voxel_size);
}

TEST(VoxelSize, CloudsOfNothingHaveAReason) {
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_EQ(suggest({}).reason, VoxelSizeReason::no_clouds);
  EXPECT_EQ(suggest({{}}).reason, VoxelSizeReason::too_few_points);
  EXPECT_EQ(suggest({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}).reason, VoxelSizeReason::too_few_points);
  EXPECT_EQ(suggest({Points(5, {inf, 0, 0})}).reason, VoxelSizeReason::too_few_points);
  EXPECT_EQ(suggest({Points(5, {1, 2, 3})}).reason, VoxelSizeReason::one_place);
  for (const VoxelSizeSuggestion& s : {suggest({}), suggest({Points(5, {1, 2, 3})})}) {
    EXPECT_FALSE(s.valid());
    EXPECT_EQ(s.voxel_size, 0);
    EXPECT_STRNE(explain(s.reason), "unknown");
    EXPECT_STRNE(to_string(s.reason), "unknown");
  }
  EXPECT_TRUE(suggest({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}).valid());
  PointCloudView bad;
  bad.size = 7;
  test::expect_error<InvalidArgument>([&] { suggest_voxel_size({bad}); }, {"cloud.points"});
}

}  // namespace
}  // namespace gpureg
