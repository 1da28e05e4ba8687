// SPDX-License-Identifier: BSD-3-Clause
#include "data/tours/tour.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "data/random.hpp"
#include "data/tours/walk_map.hpp"
#include "gpureg/error.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;

/// A free place in a room, not too near to the last one.
Vector2f place_in(const Room& room, const WalkMap& map, Random& random, const Vector2f& last) {
  Vector2f best = room.floor.centre();
  float score = -1;
  for (int attempt = 0; attempt < 24; ++attempt) {
    const Vector2f p(random.uniform(room.floor.low.x(), room.floor.high.x()),
                     random.uniform(room.floor.low.y(), room.floor.high.y()));
    const float value =
        map.free(p) ? std::min(1.6f, (p - last).norm()) + 0.2f * random.uniform() : -2;
    if (value > score) {
      score = value;
      best = p;
    }
  }
  return best;
}

/// A line that grows from place to place through walkable cells.
class Line {
 public:
  Line(const WalkMap& map, const Vector2f& start) : map_(map), points_{start}, at_(start) {}

  void go_to(const Vector2f& target) {
    std::vector<Vector2f> leg = map_.path(at_, target);
    if (leg.empty()) leg = {target};  // boxed in by furniture: step over it
    for (const Vector2f& p : leg) {
      while ((p - points_.back()).norm() > kTourSpacing) {
        const Vector2f step = kTourSpacing * (p - points_.back()).normalized();
        points_.push_back(points_.back() + step);
        length_ += kTourSpacing;
      }
    }
    at_ = target;
  }

  const Vector2f& at() const { return at_; }
  float length() const { return length_; }
  const std::vector<Vector2f>& points() const { return points_; }

 private:
  const WalkMap& map_;
  std::vector<Vector2f> points_;
  Vector2f at_;
  float length_ = 0;
};

/// Round each room, then through a door, mostly to where it was least.
std::vector<Vector2f> tour_of_rooms(const House& house, const WalkMap& map, std::uint64_t seed,
                                    std::uint64_t variant, float length, float no_return) {
  Random random(hash_key(seed, Purpose::path, variant));
  std::vector<int> visits(house.rooms.size(), 0);
  std::size_t room = 0;
  if (variant > 0)
    room = static_cast<std::size_t>(random.below(static_cast<int>(house.rooms.size())));
  while (house.rooms[room].floor.size().minCoeff() < 2.2f)
    room = (room + 1) % house.rooms.size();  // start in a room, not in the corridor
  Line line(map, place_in(house.rooms[room], map, random, house.rooms[room].floor.low));
  // A room that cannot be walked in would keep the tour from growing: it is bounded by its number
  // of legs too.
  for (int leg = 0; line.length() < length && leg < 1000 + static_cast<int>(length); ++leg) {
    ++visits[room];
    const bool away = line.length() < no_return;
    const int places =
        away || house.rooms[room].floor.size().minCoeff() < 2.2f ? 1 : random.between(2, 4);
    for (int i = 0; i < places; ++i)
      line.go_to(place_in(house.rooms[room], map, random, line.at()));
    std::vector<const Doorway*> ways;
    for (const Doorway& door : house.doors) {
      if (door.room_a == static_cast<int>(room) || door.room_b == static_cast<int>(room))
        ways.push_back(&door);
    }
    if (ways.empty()) continue;
    const auto beyond = [&](const Doorway* door) {
      return static_cast<std::size_t>(door->room_a == static_cast<int>(room) ? door->room_b
                                                                             : door->room_a);
    };
    const Doorway* next =
        ways[static_cast<std::size_t>(random.below(static_cast<int>(ways.size())))];
    if (away || random.chance(0.6f)) {
      for (const Doorway* door : ways) {
        if (visits[beyond(door)] < visits[beyond(next)]) next = door;
      }
    }
    const Vector2f side = next->through * (next->room_a == static_cast<int>(room) ? 1.0f : -1.0f);
    line.go_to(next->centre - 0.5f * side);
    line.go_to(next->centre + 0.5f * side);
    room = beyond(next);
  }
  return line.points();
}

/// Of a few places near by, mostly to where it was least.
std::vector<Vector2f> tour_of_places(const WalkMap& map, std::uint64_t seed, std::uint64_t variant,
                                     float length) {
  constexpr float kSquare = 1.5f, kLeg = 8;  // metres
  const std::vector<Vector2f> places = map.free_places();
  Random random(hash_key(seed, Purpose::path, variant));
  const auto any = [&] {
    return places[static_cast<std::size_t>(random.below(static_cast<int>(places.size())))];
  };
  std::map<std::pair<int, int>, int> visits;
  const auto square = [&](const Vector2f& p) {
    return std::pair<int, int>(std::floor(p.x() / kSquare), std::floor(p.y() / kSquare));
  };
  Line line(map, any());
  // In a place of a few cells the tour stops growing: it is bounded by its number of legs too.
  for (int leg = 0; line.length() < length && leg < 1000 + static_cast<int>(length); ++leg) {
    const bool back = random.chance(0.2f);
    Vector2f best = line.at();
    int fewest = 1 << 30;
    for (int attempt = 0; attempt < 60; ++attempt) {
      const Vector2f p = any();
      const float away = (p - line.at()).norm();
      // Where nothing else is near, anything will do.
      if ((away < 2 || away > kLeg) && attempt < 40) continue;
      const int before = visits[square(p)];
      if (before >= fewest) continue;
      fewest = before;
      best = p;
      if (back || attempt >= 40) break;
    }
    const std::size_t from = line.points().size();
    line.go_to(best);
    for (std::size_t k = from; k < line.points().size(); k += 25)
      ++visits[square(line.points()[k])];
    ++visits[square(best)];
  }
  return line.points();
}

}  // namespace

float first_return(const std::vector<Vector2f>& tour) {
  constexpr float kNear = 1.2f, kLeft = 6;  // metres
  constexpr std::size_t kStep = 5;          // points between those compared
  const auto gap = static_cast<std::size_t>(kLeft / kTourSpacing);
  for (std::size_t now = gap; now < tour.size(); now += kStep) {
    for (std::size_t before = 0; before + gap <= now; before += kStep) {
      if ((tour[now] - tour[before]).norm() < kNear) return static_cast<float>(now) * kTourSpacing;
    }
  }
  return static_cast<float>(tour.size()) * kTourSpacing;
}

std::vector<Vector2f> tour(const House& house, const RayScene& scene, std::uint64_t seed,
                           float length, float no_return) {
  constexpr std::uint64_t kVariants = 200;  // walks that are tried
  const WalkMap map = house.rooms.empty() ? WalkMap(scene) : WalkMap(house);
  const auto walk = [&](std::uint64_t variant, float metres) {
    return house.rooms.empty() ? tour_of_places(map, seed, variant, metres)
                               : tour_of_rooms(house, map, seed, variant, metres, no_return);
  };
  if (no_return <= 0) return walk(0, length);
  float longest = 0;
  for (std::uint64_t variant = 0; variant < kVariants; ++variant) {
    const float metres = first_return(walk(variant, no_return + 0.5f));
    if (metres >= no_return) return walk(variant, length);
    longest = std::max(longest, metres);
  }
  throw InvalidArgument("no_return is " + std::to_string(no_return) +
                        " m, but every walk tried in this building comes back after at most " +
                        std::to_string(longest) + " m");
}

}  // namespace gpureg::synthetic
