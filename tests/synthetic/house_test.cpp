// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/house.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "data/sensor/ray_scene.hpp"

namespace gpureg::test {
namespace {

TEST(House, RoomsHangTogetherAndDoNotOverlap) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const synthetic::House house = synthetic::build_house(seed);
    const std::size_t n = house.rooms.size();
    EXPECT_GE(n, 4u) << seed;
    EXPECT_LE(n, 7u) << seed;
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) {
        EXPECT_FALSE(house.rooms[a].floor.overlaps(house.rooms[b].floor, 0)) << seed;
      }
    }
    std::vector<bool> reached(n, false);
    reached[0] = true;
    for (std::size_t round = 0; round < n; ++round) {
      for (const synthetic::Doorway& door : house.doors) {
        const auto a = static_cast<std::size_t>(door.room_a),
                   b = static_cast<std::size_t>(door.room_b);
        if (reached[a] || reached[b]) reached[a] = reached[b] = true;
      }
    }
    EXPECT_EQ(std::accumulate(reached.begin(), reached.end(), 0), static_cast<int>(n)) << seed;
  }
}

TEST(House, DoorwaysAreOpenAndWallsAreNot) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const synthetic::House house = synthetic::build_house(seed);
    const synthetic::RayScene scene(house.mesh);
    for (const synthetic::Doorway& door : house.doors) {
      const Eigen::Vector3f through(door.through.x(), door.through.y(), 0);
      const Eigen::Vector3f from =
          Eigen::Vector3f(door.centre.x(), door.centre.y(), 1.8f) - 0.3f * through;
      const synthetic::RayHit hit = scene.cast(from, through);
      EXPECT_TRUE(!hit.hit || hit.t > 0.5f) << "seed " << seed << ": something stands in a doorway";
    }
    for (const synthetic::Room& room : house.rooms) {
      const Eigen::Vector2f c = room.floor.centre();
      const synthetic::RayHit up = scene.cast({c.x(), c.y(), 2.0f}, {0, 0, 1}),
                              down = scene.cast({c.x(), c.y(), 2.0f}, {0, 0, -1});
      EXPECT_TRUE(up.hit && up.t < 1) << "a ceiling or its lamp";
      EXPECT_TRUE(down.hit && down.t < 2.01f) << "a floor or what stands on it";
    }
  }
}

TEST(House, IsFurnishedAndVaried) {
  std::size_t largest = 0, smallest = 1u << 30;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const synthetic::House house = synthetic::build_house(seed);
    EXPECT_GT(house.obstacles.size(), 3 * house.rooms.size()) << seed;
    ASSERT_EQ(house.mesh.triangles.size(), house.mesh.materials.size());
    for (const auto& triangle : house.mesh.triangles) {
      for (const std::uint32_t v : triangle) ASSERT_LT(v, house.mesh.vertices.size());
    }
    for (const Eigen::Vector3f& v : house.mesh.vertices) ASSERT_TRUE(v.allFinite());
    for (const std::uint16_t m : house.mesh.materials) ASSERT_LT(m, house.mesh.palette.size());
    largest = std::max(largest, house.mesh.triangles.size());
    smallest = std::min(smallest, house.mesh.triangles.size());
  }
  EXPECT_GT(smallest, 50000u);
  EXPECT_GT(largest, smallest + 10000u);
}

TEST(House, AnotherTimeHasTheSameWallsAndOtherFurniture) {
  const synthetic::House built = synthetic::build_house(5), later = synthetic::build_house(5, 1),
                         again = synthetic::build_house(5, 1), other = synthetic::build_house(5, 2);
  EXPECT_EQ(later.mesh.vertices, again.mesh.vertices);
  EXPECT_NE(later.mesh.vertices, built.mesh.vertices);
  EXPECT_NE(later.mesh.vertices, other.mesh.vertices);
  ASSERT_EQ(later.rooms.size(), built.rooms.size());
  for (std::size_t k = 0; k < built.rooms.size(); ++k)
    EXPECT_EQ(later.rooms[k].floor.low, built.rooms[k].floor.low);
  std::size_t kept = 0;
  for (const synthetic::Obstacle& a : built.obstacles)
    for (const synthetic::Obstacle& b : later.obstacles)
      kept += a.rect.low == b.rect.low && a.rect.high == b.rect.high;
  EXPECT_GT(kept, built.obstacles.size() / 2);
  EXPECT_LT(kept, built.obstacles.size());
}

}  // namespace
}  // namespace gpureg::test
