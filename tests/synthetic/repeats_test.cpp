// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "data/rooms/house.hpp"
#include "data/sensor/ray_scene.hpp"
#include "gpureg/error.hpp"
#include "scene.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using synthetic::GenerateOptions;
using synthetic::House;
using Build = House (*)(std::uint64_t);

constexpr Build kBuilds[] = {synthetic::build_office, synthetic::build_warehouse};

/// Metres of the plan.
Eigen::Vector2f extent(const House& house) {
  Eigen::AlignedBox2f box;
  for (const synthetic::Room& room : house.rooms)
    box.extend(room.floor.low).extend(room.floor.high);
  return box.sizes();
}

TEST(Repeats, SizesAndMeshesAreSensible) {
  for (const Build build : kBuilds) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      const House house = build(seed);
      const Eigen::Vector2f size = extent(house);
      EXPECT_GT(size.minCoeff(), 9) << seed;
      EXPECT_LT(size.maxCoeff(), 32) << seed;
      EXPECT_GT(house.obstacles.size(), 12u) << seed;
      const Eigen::AlignedBox2f floor(Eigen::Vector2f(0, 0), size);
      for (const synthetic::Obstacle& piece : house.obstacles) {
        EXPECT_TRUE(floor.contains(piece.rect.low) && floor.contains(piece.rect.high)) << seed;
      }
      for (std::size_t a = 0; a < house.rooms.size(); ++a) {
        for (std::size_t b = a + 1; b < house.rooms.size(); ++b)
          EXPECT_FALSE(house.rooms[a].floor.overlaps(house.rooms[b].floor, 0)) << seed;
      }
      ASSERT_EQ(house.mesh.triangles.size(), house.mesh.materials.size());
      for (const Eigen::Vector3f& v : house.mesh.vertices) ASSERT_TRUE(v.allFinite());
    }
  }
}

TEST(Repeats, NothingStandsInADoorway) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const House house = synthetic::build_office(seed);
    const synthetic::RayScene scene(house.mesh);
    EXPECT_GE(house.doors.size() + 1, house.rooms.size()) << seed;
    for (const synthetic::Doorway& door : house.doors) {
      const Eigen::Vector3f through(door.through.x(), door.through.y(), 0);
      const Eigen::Vector3f from =
          Eigen::Vector3f(door.centre.x(), door.centre.y(), 0.6f) - 0.4f * through;
      const synthetic::RayHit hit = scene.cast(from, through);
      EXPECT_TRUE(!hit.hit || hit.t > 0.8f) << seed;
    }
  }
}

/// Distances that a level fan of rays measures.
std::vector<float> fan(const synthetic::RayScene& scene, const Eigen::Vector3f& eye) {
  std::vector<float> out;
  for (int k = 0; k < 64; ++k) {
    const float angle = 6.2831853f * static_cast<float>(k) / 64;
    out.push_back(scene.cast(eye, {std::cos(angle), std::sin(angle), -0.3f}).t);
  }
  return out;
}

// From the same place of two cells of an office nearly every ray measures the same: chairs were
// left differently, and some desks bear a thing of their own.
TEST(Repeats, CellsOfAnOfficeLookAlike) {
  const House house = synthetic::build_office(1);
  const synthetic::RayScene scene(house.mesh);
  const auto at = [&](std::size_t room) {
    const Eigen::Vector2f c = house.rooms[room].floor.low + Eigen::Vector2f(1.8f, 3.0f);
    return fan(scene, {c.x(), c.y(), 1.47f});
  };
  const std::vector<float> first = at(0);
  for (const std::size_t room : {1u, 2u, 3u}) {
    const std::vector<float> other = at(room);
    int same = 0;
    for (std::size_t k = 0; k < first.size(); ++k) same += std::abs(first[k] - other[k]) < 0.01f;
    EXPECT_GT(same, 48) << room;
    EXPECT_LT(same, 64) << room << ": nothing tells the cells apart";
  }
}

TEST(Repeats, RacksOfAWarehouseLookAlike) {
  const House house = synthetic::build_warehouse(1);
  const synthetic::RayScene scene(house.mesh);
  const synthetic::Rect &a = house.obstacles[0].rect, &b = house.obstacles[1].rect;
  for (float x = 0.1f; x < a.size().x(); x += 0.1f) {
    const auto depth = [&](const synthetic::Rect& rack) {
      return scene.cast({rack.low.x() + x, rack.high.y() + 1, 1.2f}, {0, -1, 0}).t;
    };
    EXPECT_NEAR(depth(a), depth(b), 1e-3) << x;  // floats of metres
  }
}

GenerateOptions scene_of(const std::string& building, std::uint64_t seed) {
  GenerateOptions options = small_scene(seed);
  options.building = building;
  options.frames_per_fragment = 2;
  return options;
}

TEST(Repeats, ScansFollowFromTheSeedAlone) {
  for (const std::string building : {"office", "warehouse"}) {
    const TemporaryFolder a, b, c;
    GenerateOptions options = scene_of(building, 1);
    synthetic::generate(a.path(), options);
    options.threads = 1;
    synthetic::generate(b.path(), options);
    synthetic::generate(c.path(), scene_of(building, 2));
    EXPECT_TRUE(all_files(a.path()) == all_files(b.path())) << building;
    for (const char* name : {"cloud_bin_0.ply", "poses.txt"})
      EXPECT_NE(content_of(a / name), content_of(c / name)) << building;
    for (int i = 0; i < options.fragments; ++i)
      EXPECT_GT(read_cloud(a / ("cloud_bin_" + std::to_string(i) + ".ply")).size(), 1000u);
  }
}

TEST(Repeats, AreFurnishedAlready) {
  const TemporaryFolder out;
  GenerateOptions options = scene_of("office", 1);
  options.clutter = 0.5;
  expect_error<InvalidArgument>([&] { synthetic::generate(out.path(), options); }, {"clutter"});
}

}  // namespace
}  // namespace gpureg::test
