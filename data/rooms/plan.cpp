// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "data/rooms/house.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;

/// Rooms side by side from x = 0, all of one depth. Pairs of neighbours have the same width, which
/// makes perceptual aliases.
void add_row(House& house, Random& random, float bottom, float depth, int count, float height) {
  float x = 0, width = 0;
  for (int i = 0; i < count; ++i) {
    if (i == 0 || !random.chance(0.5f)) width = random.uniform(3.6f, 5.9f);
    Room room;
    room.floor = {{x, bottom}, {x + width, bottom + depth}};
    room.height = height;
    house.rooms.push_back(room);
    x += width + kWall;
  }
}

struct Contact {
  int a, b, side_a;
  float from, to;  // along the shared wall, world coordinate
};

/// Pairs of rooms that share enough wall for a door.
std::vector<Contact> contacts(const House& house) {
  std::vector<Contact> found;
  const int n = static_cast<int>(house.rooms.size());
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) {
      const Rect &ra = house.rooms[static_cast<std::size_t>(a)].floor,
                 &rb = house.rooms[static_cast<std::size_t>(b)].floor;
      for (int axis = 0; axis < 2; ++axis) {  // b lies beyond a along this axis
        if (std::abs(rb.low[axis] - ra.high[axis] - kWall) > 0.01f) continue;
        const int other = 1 - axis;
        const float from = std::max(ra.low[other], rb.low[other]),
                    to = std::min(ra.high[other], rb.high[other]);
        if (to - from > 1.5f) found.push_back({a, b, axis == 0 ? 1 : 2, from, to});
      }
    }
  }
  return found;
}

/// A span of the world coordinate along a wall, in the wall's own frame.
std::pair<float, float> to_side(const Room& room, int side, float from, float to) {
  switch (side) {
    case 0:
      return {from - room.floor.low.x(), to - room.floor.low.x()};
    case 1:
      return {from - room.floor.low.y(), to - room.floor.low.y()};
    case 2:
      return {room.floor.high.x() - to, room.floor.high.x() - from};
    default:
      return {room.floor.high.y() - to, room.floor.high.y() - from};
  }
}

void add_door(House& house, const Contact& c, Random& random) {
  const bool arch = random.chance(0.2f);
  const float width = arch ? std::min(1.5f, c.to - c.from - 0.5f) : random.uniform(0.86f, 0.98f);
  const float top = arch ? 2.2f : 2.05f,
              centre = random.uniform(c.from + width / 2 + 0.2f, c.to - width / 2 - 0.2f);
  open_door(house, c.a, c.b, c.side_a, centre, width, top);
}

/// Doors until all rooms hang together, and a few more, so that there are loops to walk.
void connect(House& house, Random& random) {
  std::vector<Contact> open = contacts(house);
  for (std::size_t i = open.size(); i > 1; --i)
    std::swap(open[i - 1], open[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  std::vector<int> group(house.rooms.size());
  for (std::size_t i = 0; i < group.size(); ++i) group[i] = static_cast<int>(i);
  for (const Contact& c : open) {
    const int a = group[static_cast<std::size_t>(c.a)], b = group[static_cast<std::size_t>(c.b)];
    if (a == b && !random.chance(0.6f)) continue;
    add_door(house, c, random);
    std::replace(group.begin(), group.end(), b, a);
  }
}

/// Windows and niches in walls that face outside.
void open_outer_walls(House& house, Random& random, const Rect& outline) {
  for (Room& room : house.rooms) {
    const bool outer[4] = {
        room.floor.low.y() <= outline.low.y(), room.floor.high.x() >= outline.high.x() - 0.01f,
        room.floor.high.y() >= outline.high.y(), room.floor.low.x() <= outline.low.x()};
    for (int side = 0; side < 4; ++side) {
      if (!outer[side]) continue;
      float x = random.uniform(0.4f, 1.0f);
      while (x < room.length(side) - 1.2f) {
        const float width = std::min(random.uniform(0.7f, 1.6f), room.length(side) - 0.3f - x);
        const float kind = random.uniform();
        if (kind < 0.55f) {
          room.openings[static_cast<std::size_t>(side)].push_back(
              {Opening::Kind::window, x, x + width, random.uniform(0.7f, 1.0f),
               random.uniform(1.9f, 2.2f), random.uniform(0.18f, 0.3f)});
        } else if (kind < 0.7f) {
          const float bottom = random.chance(0.5f) ? 0.0f : random.uniform(0.5f, 1.1f);
          room.openings[static_cast<std::size_t>(side)].push_back(
              {Opening::Kind::niche, x, x + 0.6f * width, bottom, random.uniform(1.6f, 2.1f),
               random.uniform(0.12f, 0.28f)});
        }
        x += width + random.uniform(0.4f, 1.4f);
      }
    }
  }
}

}  // namespace

Eigen::Affine3f Room::world_from_side(int side) const {
  const Vector2f corner[4] = {
      floor.low, {floor.high.x(), floor.low.y()}, floor.high, {floor.low.x(), floor.high.y()}};
  return upright({corner[side].x(), corner[side].y(), 0}, 1.57079633f * static_cast<float>(side));
}

void open_door(House& house, int a, int b, int side_a, float centre, float width, float top) {
  for (const auto& [index, side] : {std::pair{a, side_a}, std::pair{b, (side_a + 2) % 4}}) {
    Room& room = house.rooms[static_cast<std::size_t>(index)];
    const auto [from, to] = to_side(room, side, centre - width / 2, centre + width / 2);
    room.openings[static_cast<std::size_t>(side)].push_back(
        {Opening::Kind::door, from, to, 0, top, kWall / 2});
  }
  const bool east = side_a == 1;
  const Rect& floor = house.rooms[static_cast<std::size_t>(a)].floor;
  house.doors.push_back({a, b,
                         east ? Vector2f(floor.high.x() + kWall / 2, centre)
                              : Vector2f(centre, floor.high.y() + kWall / 2),
                         east ? Vector2f(1, 0) : Vector2f(0, 1)});
}

void plan_rooms(House& house, Random& random) {
  const float height = random.uniform(2.4f, 2.7f), south = random.uniform(3.6f, 5.4f),
              north = random.chance(0.5f) ? south : random.uniform(3.6f, 5.4f);
  add_row(house, random, 0, south, random.between(2, 3), height);
  float y = south + kWall;
  if (random.chance(0.35f)) {  // a corridor between the rows, over their full width or a part of it
    const float width = random.uniform(1.3f, 1.7f);
    Room corridor;
    corridor.height = height;
    corridor.floor = {{0, y}, {house.rooms.back().floor.high.x(), y + width}};
    house.rooms.push_back(corridor);
    y += width + kWall;
  }
  add_row(house, random, y, north, random.between(2, 3), height);
  Rect outline{{0, 0}, {0, y + north}};
  for (const Room& room : house.rooms)
    outline.high.x() = std::max(outline.high.x(), room.floor.high.x());
  connect(house, random);
  open_outer_walls(house, random, outline);
}

House build_house(std::uint64_t seed, std::uint64_t rearrangement) {
  House house;
  house.rearrangement = rearrangement;
  Random random(hash_key(seed, Purpose::house));
  plan_rooms(house, random);
  build_walls(house, random);
  furnish(house, seed);
  return house;
}

}  // namespace gpureg::synthetic
