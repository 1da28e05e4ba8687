// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;

constexpr float kFullTurn = 6.2831853f;
/// Shares of the pieces that are taken away, moved, and joined by a second one.
constexpr float kGone = 0.15f, kMoved = 0.15f, kDoubled = 0.1f;
constexpr int kBoxesPerRoom = 4;

bool fits(const House& house, const Rect& rect) {
  const auto holds = [&](const Room& room) {
    return (rect.low.array() >= room.floor.low.array()).all() &&
           (rect.high.array() <= room.floor.high.array()).all();
  };
  return std::any_of(house.rooms.begin(), house.rooms.end(), holds) &&
         std::none_of(house.obstacles.begin(), house.obstacles.end(),
                      [&](const Obstacle& o) { return rect.overlaps(o.rect, 0.03f); }) &&
         std::none_of(house.doors.begin(), house.doors.end(), [&](const Doorway& door) {
           return rect.overlaps({door.centre.array() - 0.85f, door.centre.array() + 0.85f}, 0);
         });
}

/// Another place up to a metre away, or none.
std::vector<Affine3f> place_near(const House& house, const Affine3f& frame, const Piece& piece,
                                 Random& random) {
  for (int attempt = 0; attempt < 40; ++attempt) {
    const Affine3f place = upright({random.uniform(-1, 1), random.uniform(-1, 1), 0}, 0) * frame *
                           upright({0, 0, 0}, random.uniform(-0.8f, 0.8f));
    if (fits(house, footprint(place, piece))) return {place};
  }
  return {};
}

Piece small_box(Random& random) {
  const float w = random.uniform(0.1f, 0.3f), d = random.uniform(0.1f, 0.3f),
              h = random.uniform(0.1f, 0.3f);
  return {w, d, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(paint(r));
            mesh.box({-w / 2, 0, 0}, {w / 2, d, h});
          }};
}

}  // namespace

std::vector<Affine3f> places_of(House& house, const Affine3f& frame, const Piece& piece) {
  const std::uint64_t number = house.pieces++;
  if (house.rearrangement == 0) return {frame};
  Random random(hash_key(house.rearrangement, Purpose::rearrangement, number));
  const float fate = random.uniform();
  if (fate < kGone) return {};
  if (fate < kGone + kMoved) return place_near(house, frame, piece, random);
  if (fate >= kGone + kMoved + kDoubled) return {frame};
  std::vector<Affine3f> places = place_near(house, frame, piece, random);
  places.push_back(frame);
  return places;
}

void add_boxes(House& house) {
  if (house.rearrangement == 0) return;
  Random random(hash_key(house.rearrangement, Purpose::rearrangement, house.pieces));
  for (const Room& room : house.rooms) {
    for (int k = 0; k < kBoxesPerRoom; ++k) {
      const Piece box = small_box(random);
      for (int attempt = 0; attempt < 20; ++attempt) {
        const Affine3f frame = upright({random.uniform(room.floor.low.x(), room.floor.high.x()),
                                        random.uniform(room.floor.low.y(), room.floor.high.y()), 0},
                                       random.uniform(0, kFullTurn));
        if (!fits(house, footprint(frame, box))) continue;
        build_piece(house, frame, box, random.bits());
        break;
      }
    }
  }
}

}  // namespace gpureg::synthetic
