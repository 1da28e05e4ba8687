// SPDX-License-Identifier: BSD-3-Clause
// Buildings whose furniture repeats: perceptual aliases that agree with each other.
#include <algorithm>

#include "data/furniture/furniture.hpp"
#include "data/rooms/house.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;

constexpr float kHalfTurn = 3.14159265f;
constexpr float kDoorWidth = 0.92f, kDoorTop = 2.05f;

/// One model, of which every copy has the same details.
struct Model {
  Piece piece;
  std::uint64_t details;
};

Model model_of(Piece (*maker)(Random&), std::uint64_t seed, std::uint64_t kind) {
  const std::uint64_t key = hash_key(seed, Purpose::furniture, 2000 + kind);
  Random shape(key);
  return {maker(shape), key};
}

void put(House& house, const Affine3f& frame, const Model& model) {
  place_piece(house, frame, model.piece, model.details);
}

Affine3f moved(const Affine3f& frame, float x, float y, float yaw) {
  return frame * upright({x, y, 0}, yaw);
}

/// Equal windows, or equal closed doors (niches), at equal distances along a wall.
void repeat_openings(Room& room, int side, const Opening& first, float pitch) {
  for (Opening next = first; next.to < room.length(side) - 0.3f;
       next.from += pitch, next.to += pitch)
    room.openings[static_cast<std::size_t>(side)].push_back(next);
}

int add_room(House& house, const Vector2f& low, const Vector2f& high, float height) {
  Room room;
  room.floor = {low, high};
  room.height = height;
  house.rooms.push_back(room);
  return static_cast<int>(house.rooms.size()) - 1;
}

Room& last_room(House& house) { return house.rooms.back(); }

/// Furniture and sizes of one office.
struct Office {
  Model desk, chair, table, seat, shelf;
  int cells, meetings;             // rooms south of the corridor; meeting rooms north of it
  float width, depth, hall_depth;  // of a cell; of the hall and the meeting rooms
  Random own;                      // what differs from copy to copy
};

/// A desk, its chair as it was left, and on some desks one thing of its own.
void put_workplace(House& house, Office& o, const Affine3f& frame) {
  const Piece& desk = o.desk.piece;
  put(house, frame, o.desk);
  put(house,
      moved(frame, o.own.uniform(-0.15f, 0.15f), desk.depth + o.own.uniform(0.45f, 0.7f),
            kHalfTurn + o.own.uniform(-0.5f, 0.5f)),
      o.chair);
  if (!o.own.chance(0.4f)) return;
  MeshBuilder mesh(house.mesh);
  mesh.place(frame);
  small_thing(mesh, o.own, {o.own.uniform(-0.5f, 0.5f), desk.depth - 0.15f, 0.735f},
              o.own.uniform(0.06f, 0.12f));
}

/// Sometimes a heap in a corner: otherwise nobody could tell the rooms apart.
void put_heap(House& house, Office& o, const Room& room) {
  if (!o.own.chance(0.35f)) return;
  const std::uint64_t details = o.own.bits();
  Random shape(details);
  const Piece heap = clutter_heap(shape);
  place_piece(house, moved(room.world_from_side(2), 0.1f + heap.width / 2, 0.05f, 0), heap,
              details);
}

/// Two workplaces that face the side walls, and a shelf.
void furnish_cell(House& house, Office& o, const Room& room) {
  for (const int side : {1, 3}) {
    const float along = side == 1 ? 1.5f : room.length(side) - 1.5f;
    put_workplace(house, o, moved(room.world_from_side(side), along, 0.05f, 0));
  }
  put(house, moved(room.world_from_side(1), room.length(1) - 0.8f, 0.03f, 0), o.shelf);
  put_heap(house, o, room);
}

/// Islands of two rows of desks back to back, with aisles around.
void furnish_hall(House& house, Office& o, const Room& room) {
  const Piece& desk = o.desk.piece;
  const float pitch = desk.width + 0.02f, aisle = 2.5f, gap = 1.3f;
  constexpr int kRow = 3;
  const float island = kRow * pitch;
  for (float y = room.floor.low.y() + 1.5f + desk.depth;
       y + desk.depth + 1.3f < room.floor.high.y(); y += 2 * desk.depth + aisle) {
    for (float x = room.floor.low.x() + 1.2f; x + island + 0.8f < room.floor.high.x();
         x += island + gap) {
      for (int k = 0; k < kRow; ++k) {
        const float middle = x + pitch * (static_cast<float>(k) + 0.5f);
        put_workplace(house, o, upright({middle, y + 0.01f, 0}, 0));
        put_workplace(house, o, upright({middle, y - 0.01f, 0}, kHalfTurn));
      }
    }
  }
  for (float x = 0.9f; x < room.length(2) - 0.9f; x += 4.5f)
    put(house, moved(room.world_from_side(2), x, 0.03f, 0), o.shelf);
}

/// A table with three seats on each long side and one at each end.
void furnish_meeting(House& house, Office& o, const Room& room) {
  const Piece &table = o.table.piece, &seat = o.seat.piece;
  const Vector2f at = room.floor.centre();
  const Affine3f middle = upright({at.x(), at.y(), 0}, kHalfTurn / 2);
  put(house, moved(middle, 0, -table.depth / 2, 0), o.table);
  for (int side = 0; side < 4; ++side) {
    const float along = side % 2 == 0 ? table.width : table.depth,
                away = side % 2 == 0 ? table.depth : table.width;
    const int count = side % 2 == 0 ? 3 : 1;
    for (int k = 0; k < count; ++k) {
      const float x = along * ((static_cast<float>(k) + 0.5f) / static_cast<float>(count) - 0.5f);
      put(house,
          moved(moved(middle, 0, 0, kHalfTurn / 2 * static_cast<float>(side)), x,
                -away / 2 - seat.depth * o.own.uniform(0.6f, 0.9f), o.own.uniform(-0.25f, 0.25f)),
          o.seat);
    }
  }
  put_heap(house, o, room);
}

/// Cells south of a corridor; a hall and meeting rooms north of it. Cells come first.
void plan_office(House& house, const Office& o, float height) {
  constexpr float kCorridor = 1.9f;
  const float pitch = o.width + kWall, length = static_cast<float>(o.cells) * pitch - kWall,
              north = o.depth + kCorridor + 2 * kWall,
              hall = length - static_cast<float>(o.meetings) * pitch;
  const auto window = [&](float from, float width) {
    return Opening{Opening::Kind::window, from, from + width, 0.85f, 2.1f, 0.22f};
  };
  const Opening closed{Opening::Kind::niche, 0.4f, 0.4f + kDoorWidth, 0, kDoorTop, 0.05f};
  for (int k = 0; k < o.cells; ++k) {
    const float x = pitch * static_cast<float>(k);
    add_room(house, {x, 0}, {x + o.width, o.depth}, height);
    repeat_openings(last_room(house), 0, window(0.4f, 1.2f), 1.5f);
  }
  const int corridor = add_room(house, {0, o.depth + kWall}, {length, north - kWall}, height);
  // Closed doors between the open ones, the same in every pitch.
  repeat_openings(last_room(house), 0, closed, pitch);
  const int first = add_room(house, {0, north}, {hall, north + o.hall_depth}, height);
  repeat_openings(last_room(house), 2, window(1.5f, 1.4f), 2.25f);
  for (int k = 0; k < o.meetings; ++k) {
    const float x = hall + kWall + pitch * static_cast<float>(k);
    add_room(house, {x, north}, {x + o.width, north + o.hall_depth}, height);
  }
  const auto door = [&](int a, int b, float x) {
    open_door(house, a, b, 2, x, kDoorWidth, kDoorTop);
  };
  for (int k = 0; k < o.cells; ++k)
    door(k, corridor, pitch * static_cast<float>(k) + o.width - 0.9f);
  for (int k = 0; pitch * static_cast<float>(k) + o.width < hall; k += 2)
    door(corridor, first, pitch * static_cast<float>(k) + o.width - 0.9f);
  for (int k = 0; k < o.meetings; ++k)
    door(corridor, first + 1 + k, hall + kWall + pitch * static_cast<float>(k) + o.width - 0.9f);
}

/// A rack of boards between posts; the same boxes on every copy.
Piece rack(Random& random) {
  const float w = random.uniform(2.2f, 2.7f), d = random.uniform(0.8f, 1.0f),
              step = random.uniform(0.75f, 0.95f);
  constexpr int kBoards = 4, kSlots = 3;
  return {w, d, kBoards * step, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(metal(r));
            for (const float x : {-w / 2, w / 2 - 0.08f}) {
              for (const float y : {0.0f, d - 0.08f})
                mesh.box({x, y, 0}, {x + 0.08f, y + 0.08f, kBoards * step});
            }
            for (int k = 0; k < kBoards; ++k) {
              const float z = 0.12f + step * static_cast<float>(k);
              mesh.paint(metal(r));
              mesh.box({-w / 2, 0, z - 0.1f}, {w / 2, d, z});
              for (int slot = 0; slot < kSlots; ++slot) {
                if (r.chance(0.2f)) continue;  // empty
                const float room = (w - 0.2f) / kSlots, half = room * r.uniform(0.3f, 0.46f),
                            x = -w / 2 + 0.1f + room * (static_cast<float>(slot) + 0.5f),
                            front = d - r.uniform(0.02f, 0.15f), back = r.uniform(0.02f, 0.2f);
                mesh.paint(wood(r));
                mesh.box({x - half, back, z}, {x + half, front, z + step * r.uniform(0.4f, 0.8f)});
              }
            }
          }};
}

/// Boxes piled on a pallet.
Piece pallet(Random& random) {
  const float top = random.uniform(0.7f, 1.1f);
  return {1.2f, 0.8f, top, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.box({-0.6f, 0, 0.1f}, {0.6f, 0.8f, 0.14f});
            for (const float x : {-0.6f, -0.05f, 0.5f}) mesh.box({x, 0, 0}, {x + 0.1f, 0.8f, 0.1f});
            mesh.paint(wood(r));
            mesh.box({-0.55f, 0.05f, 0.14f}, {0.05f, 0.75f, top});
            mesh.box({0.08f, 0.05f, 0.14f}, {0.55f, 0.6f, r.uniform(0.5f, 1.0f) * top});
          }};
}

}  // namespace

House build_office(std::uint64_t seed) {
  House house;
  Random random(hash_key(seed, Purpose::house, 1));
  Office o{model_of(desk, seed, 1),
           model_of(office_chair, seed, 2),
           model_of(dining_table, seed, 3),
           model_of(chair, seed, 4),
           model_of(bookshelf, seed, 5),
           random.between(5, 7),
           random.between(1, 2),
           random.uniform(3.7f, 4.3f),
           random.uniform(4.0f, 4.8f),
           random.uniform(6.5f, 8.0f),
           Random(hash_key(seed, Purpose::furniture, 2000))};
  plan_office(house, o, random.uniform(2.5f, 2.8f));
  build_walls(house, random);
  const auto corridor = static_cast<std::size_t>(o.cells);
  for (std::size_t k = 0; k < house.rooms.size(); ++k) {
    if (k == corridor) continue;
    const Room& room = house.rooms[k];
    if (k < corridor) furnish_cell(house, o, room);
    if (k == corridor + 1) furnish_hall(house, o, room);
    if (k > corridor + 1) furnish_meeting(house, o, room);
  }
  return house;
}

House build_warehouse(std::uint64_t seed) {
  House house;
  Random random(hash_key(seed, Purpose::house, 2)), own(hash_key(seed, Purpose::furniture, 2001));
  const Model shelf = model_of(rack, seed, 6), load = model_of(pallet, seed, 7);
  const int rows = random.between(3, 4), sections = random.between(4, 5);
  const float aisle = random.uniform(2.2f, 2.6f), apron = 3.5f, w = shelf.piece.width,
              d = shelf.piece.depth;
  const Vector2f size(static_cast<float>(sections) * w + 2 * apron,
                      static_cast<float>(rows) * (d + aisle) + aisle);
  add_room(house, {0, 0}, size, 4.5f);
  const Opening gate{Opening::Kind::niche, 1.2f, 3.8f, 0, 3.0f, 0.12f};
  for (const int side : {1, 3}) repeat_openings(last_room(house), side, gate, 3.6f);
  build_walls(house, random);
  for (int row = 0; row < rows; ++row) {
    const float y = aisle + (d + aisle) * static_cast<float>(row);
    for (int k = 0; k < sections; ++k)
      put(house, upright({apron + w * (static_cast<float>(k) + 0.5f), y, 0}, 0), shelf);
    // Pallets at the ends of some rows.
    for (const float x : {apron - 1.4f, size.x() - apron + 1.4f}) {
      if (own.chance(0.5f))
        put(house, upright({x, y + own.uniform(-0.3f, 0.3f), 0}, own.uniform(-0.2f, 0.2f)), load);
    }
  }
  return house;
}

}  // namespace gpureg::synthetic
