// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "data/mesh.hpp"
#include "data/random.hpp"

namespace gpureg::synthetic {

/// A rectangle on the floor, metres.
struct Rect {
  Eigen::Vector2f low, high;
  Eigen::Vector2f size() const { return high - low; }
  Eigen::Vector2f centre() const { return 0.5f * (low + high); }
  bool overlaps(const Rect& other, float margin) const {
    return low.x() < other.high.x() + margin && other.low.x() < high.x() + margin &&
           low.y() < other.high.y() + margin && other.low.y() < high.y() + margin;
  }
};

/// A hole in a wall, in the wall's frame (x along the wall from its left end as seen from inside).
struct Opening {
  enum class Kind { door, window, niche } kind;
  float from, to, bottom, top, depth;  ///< depth: how far it reaches into the wall
};

/// Side 0 is the south wall, then east, north, west. Its frame: x along the wall, y into the room,
/// z up, origin on the floor.
struct Room {
  Rect floor;
  float height = 2.5f;
  std::array<std::vector<Opening>, 4> openings;

  float length(int side) const { return side % 2 == 0 ? floor.size().x() : floor.size().y(); }
  Eigen::Affine3f world_from_side(int side) const;
};

struct Doorway {
  int room_a, room_b;
  Eigen::Vector2f centre;
  Eigen::Vector2f through;  ///< unit vector from room a into room b
};

/// Something that a walking person avoids.
struct Obstacle {
  Rect rect;
  float height;
};

/// A building that was read from a file (building_file.hpp) is a mesh alone.
struct House {
  std::vector<Room> rooms;
  std::vector<Doorway> doors;
  std::vector<Obstacle> obstacles;  ///< furniture; walls follow from rooms and doors
  Mesh mesh;
  /// 0: furnished as its seed says; another number: with some pieces moved, taken away or added.
  std::uint64_t rearrangement = 0;
  std::uint64_t pieces = 0;  ///< of furniture that were to be placed
};

constexpr float kWall = 0.14f;  ///< metres: thickness of the walls between rooms

/// Plans, builds and furnishes a house of 4 to 7 rooms. The same numbers give the same
/// house.
House build_house(std::uint64_t seed, std::uint64_t rearrangement = 0);
/// An office: rooms of equal desks along a corridor of equal doors, a hall with rows of the same
/// desks and chairs, meeting rooms with equal tables. Size and models follow from the seed.
House build_office(std::uint64_t seed);
/// A warehouse: one hall with rows of equal racks, which hold equal boxes.
House build_warehouse(std::uint64_t seed);

// The steps of build_house.
void plan_rooms(House& house, Random& random);
void build_walls(House& house, Random& random);
void furnish(House& house, std::uint64_t seed);

/// Opens a doorway between room a and room b, which lies beyond a's side 1 (east) or 2 (north).
/// centre: world coordinate along the wall.
void open_door(House& house, int a, int b, int side_a, float centre, float width, float top);

}  // namespace gpureg::synthetic
