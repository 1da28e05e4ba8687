// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>

#include "data/furniture/furniture.hpp"
#include "data/rooms/house.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using Maker = Piece (*)(Random&);

constexpr float kQuarter = 1.57079633f;

/// Furnishes one room: keeps the placed pieces, and tries locations until one is free.
class Furnisher {
 public:
  Furnisher(House& house, const Room& room, std::uint64_t seed, Random random)
      : house_(house), room_(room), mesh_(house.mesh), random_(random), seed_(seed) {
    for (const Doorway& door : house.doors)
      keep_clear_.push_back({door.centre.array() - 0.85f, door.centre.array() + 0.85f});
  }

  Random& random() { return random_; }

  /// A new piece, or one of two models that other rooms have too: repeated furniture aliases.
  Piece make(Maker maker, int kind, std::uint64_t& model) {
    model = random_.chance(0.8f)
                ? hash_key(seed_, Purpose::furniture, static_cast<std::uint64_t>(1000 + kind),
                           random_.bits() % 2)
                : random_.bits();
    Random shape(model);
    return maker(shape);
  }

  bool at_wall(Maker maker, int kind) {
    std::uint64_t model = 0;
    const Piece piece = make(maker, kind, model);
    for (int attempt = 0; attempt < 40; ++attempt) {
      const int side = random_.below(4);
      const float length = room_.length(side),
                  x = random_.uniform(piece.width / 2 + 0.03f, length - piece.width / 2 - 0.03f);
      if (piece.width + 0.06f > length || !wall_is_free(side, x, piece.width, 0, piece.height))
        continue;
      const Affine3f frame =
          room_.world_from_side(side) *
          upright({x, random_.uniform(0.02f, 0.07f), 0}, random_.uniform(-0.02f, 0.02f));
      if (!put(piece, frame, model, 0.02f)) continue;
      on_wall_.push_back({side, x - piece.width / 2, x + piece.width / 2, 0, piece.height});
      return true;
    }
    return false;
  }

  /// Returns the frame of the piece, so that chairs can be put around it.
  std::optional<std::pair<Affine3f, Piece>> in_the_middle(Maker maker, int kind, float margin) {
    std::uint64_t model = 0;
    const Piece piece = make(maker, kind, model);
    for (int attempt = 0; attempt < 40; ++attempt) {
      const Vector2f at(random_.uniform(room_.floor.low.x() + 0.5f, room_.floor.high.x() - 0.5f),
                        random_.uniform(room_.floor.low.y() + 0.5f, room_.floor.high.y() - 0.5f));
      const float yaw =
          kQuarter * static_cast<float>(random_.below(4)) + random_.uniform(-0.12f, 0.12f);
      const Affine3f frame =
          upright({at.x(), at.y(), 0}, yaw) * Eigen::Translation3f(0, -piece.depth / 2, 0);
      if (put(piece, frame, model, margin)) return std::pair{frame, piece};
    }
    return std::nullopt;
  }

  void chairs_around(const Affine3f& table, const Piece& piece, int count) {
    const std::uint64_t model =
        hash_key(seed_, Purpose::furniture, 999);  // one set of chairs for the house
    for (int i = 0; i < count; ++i) {
      Random shape(model);
      const Piece one = chair(shape);
      const int side = i % 4;
      const float along = side % 2 == 0 ? piece.width : piece.depth,
                  away = side % 2 == 0 ? piece.depth : piece.width;
      const float shift = count > 4 && side % 2 == 0 ? (i < 4 ? -0.25f : 0.25f) * along : 0.0f;
      const Affine3f frame =
          table * Eigen::Translation3f(0, piece.depth / 2, 0) *
          Eigen::AngleAxisf(kQuarter * static_cast<float>(side) + random_.uniform(-0.3f, 0.3f),
                            Vector3f::UnitZ()) *
          Eigen::Translation3f(shift + random_.uniform(-0.06f, 0.06f),
                               -away / 2 - one.depth * random_.uniform(0.5f, 1.0f), 0);
      put(one, frame, model, -0.3f);
    }
  }

  void rug() {
    const Vector2f c =
        room_.floor.centre() + Vector2f(random_.uniform(-0.4f, 0.4f), random_.uniform(-0.4f, 0.4f));
    const Vector2f half(random_.uniform(0.6f, 1.1f), random_.uniform(0.5f, 0.8f));
    const float phase = random_.uniform(0, 6);
    mesh_.place(upright({c.x(), c.y(), 0}, random_.uniform(-0.3f, 0.3f)));
    mesh_.paint(fabric(random_));
    mesh_.sheet(
        [&](float u, float v) -> Vector3f {
          const float x = 2 * u - 1, y = 2 * v - 1;
          return {half.x() * x, half.y() * y,
                  0.012f + 0.008f * std::sin(4 * x + phase) * std::sin(3 * y - phase) * x * x};
        },
        24, 18);
  }

  void on_walls() {
    for (int side = 0; side < 4; ++side) {
      mesh_.place(room_.world_from_side(side));
      for (const Opening& hole : room_.openings[static_cast<std::size_t>(side)]) {
        if (hole.kind != Opening::Kind::window) continue;
        const float middle = 0.5f * (hole.from + hole.to), width = hole.to - hole.from;
        if (random_.chance(0.6f) && wall_is_free(side, middle, width, 0, hole.bottom - 0.05f)) {
          radiator(mesh_, random_, middle, 0.9f * width);
          on_wall_.push_back({side, hole.from, hole.to, 0, hole.bottom});
        }
        for (const float x : {hole.from - 0.15f, hole.to + 0.15f}) {
          if (x < 0.3f || x > room_.length(side) - 0.3f || !random_.chance(0.55f) ||
              !wall_is_free(side, x, 0.25f, 0, 2.2f))
            continue;
          curtain(mesh_, random_, x, random_.uniform(0.3f, 0.55f),
                  std::min(room_.height - 0.1f, hole.top + 0.12f));
          on_wall_.push_back({side, x - 0.25f, x + 0.25f, 0, 2.3f});
        }
      }
      for (int attempt = 0; attempt < 5; ++attempt) {
        const float x = random_.uniform(0.5f, room_.length(side) - 0.5f), kind = random_.uniform();
        const float width =
            kind < 0.7f ? random_.uniform(0.25f, 0.9f) : random_.uniform(0.7f, 1.0f);
        const float low = kind < 0.85f ? random_.uniform(1.15f, 1.5f) : 0.7f,
                    high = low + (kind < 0.7f ? random_.uniform(0.3f, 0.8f) : 0.4f);
        if (!wall_is_free(side, x, width + 0.1f, low - 0.1f, std::max(high, 1.8f))) continue;
        if (kind < 0.7f) {
          picture(mesh_, random_, x, low, width, std::min(high, room_.height - 0.15f) - low);
        } else if (kind < 0.85f) {
          wall_shelf(mesh_, random_, x, low, width);
        } else {
          coat_rack(mesh_, random_, x);
        }
        on_wall_.push_back({side, x - width / 2, x + width / 2, low, high});
      }
    }
  }

  void ceiling_lamp() {
    const Vector2f c =
        room_.floor.centre() + Vector2f(random_.uniform(-0.3f, 0.3f), random_.uniform(-0.3f, 0.3f));
    const float drop = random_.uniform(0.25f, 0.6f), radius = random_.uniform(0.15f, 0.28f);
    mesh_.place(upright({c.x(), c.y(), room_.height}, 0));
    mesh_.paint(metal(random_));
    mesh_.tube({{0, 0, 0}, {0, 0, -drop}}, 0.008f);
    mesh_.paint(fabric(random_));
    mesh_.lathe({0, 0, -drop - 0.5f * radius},
                {{radius, 0}, {0.8f * radius, 0.3f * radius}, {0.15f * radius, 0.6f * radius}}, 24);
  }

 private:
  struct Span {
    int side;
    float from, to, bottom, top;
  };

  bool wall_is_free(int side, float x, float width, float bottom, float top) const {
    const float from = x - width / 2, to = x + width / 2;
    for (const Opening& hole : room_.openings[static_cast<std::size_t>(side)]) {
      if (from < hole.to + 0.05f && hole.from < to + 0.05f && bottom < hole.top &&
          hole.bottom < top)
        return false;
    }
    return std::none_of(on_wall_.begin(), on_wall_.end(), [&](const Span& s) {
      return s.side == side && from < s.to && s.from < to && bottom < s.top && s.bottom < top;
    });
  }

  bool put(const Piece& piece, const Affine3f& frame, std::uint64_t model, float margin) {
    const Rect rect = footprint(frame, piece);
    if ((rect.low.array() < room_.floor.low.array()).any() ||
        (rect.high.array() > room_.floor.high.array()).any())
      return false;
    const auto hits = [&](const Rect& other) { return rect.overlaps(other, margin); };
    if (std::any_of(taken_.begin(), taken_.end(), hits)) return false;
    if (std::any_of(keep_clear_.begin(), keep_clear_.end(),
                    [&](const Rect& r) { return rect.overlaps(r, 0); }))
      return false;
    taken_.push_back(rect);
    place_piece(house_, frame, piece, model);
    return true;
  }

  House& house_;
  const Room& room_;
  MeshBuilder mesh_;
  Random random_;
  std::uint64_t seed_;
  std::vector<Rect> taken_, keep_clear_;
  std::vector<Span> on_wall_;
};

Piece pillar(Random& random) {
  const float w = random.uniform(0.3f, 0.9f), d = random.uniform(0.15f, 0.4f);
  return {w, d, 2.3f, [=](MeshBuilder& mesh, Random& r) {
            Material m = paint(r);
            m.pattern = Pattern::plaster;
            mesh.paint(m);
            mesh.box({-w / 2, -0.1f, 0}, {w / 2, d, 2.75f});
          }};
}

/// What a room of a kind holds, larger things first. A number names the model line: equal pieces
/// are repeated across rooms.
struct Wish {
  Maker maker;
  int kind;
  float chance;
};

const std::vector<std::vector<Wish>>& room_kinds() {
  static const std::vector<std::vector<Wish>> kinds = {
      // living room
      {{pillar, 0, 0.4f},
       {sofa, 1, 1},
       {bookshelf, 2, 1},
       {sideboard, 3, 1},
       {armchair, 4, 0.8f},
       {bookshelf, 2, 0.6f},
       {piano, 5, 0.4f},
       {floor_lamp, 6, 0.8f},
       {plant, 7, 0.9f},
       {sofa, 1, 0.3f},
       {clutter_heap, 8, 0.6f},
       {plant, 7, 0.4f}},
      // bedroom
      {{bed, 9, 1},
       {wardrobe, 10, 1},
       {sideboard, 3, 0.6f},
       {bed, 9, 0.3f},
       {desk, 11, 0.4f},
       {armchair, 4, 0.4f},
       {floor_lamp, 6, 0.6f},
       {drying_rack, 12, 0.5f},
       {clutter_heap, 8, 0.8f},
       {plant, 7, 0.4f},
       {bookshelf, 2, 0.4f}},
      // kitchen
      {{kitchen_counter, 13, 1},
       {fridge, 14, 1},
       {kitchen_counter, 13, 0.5f},
       {sideboard, 3, 0.6f},
       {clutter_heap, 8, 0.5f},
       {plant, 7, 0.5f},
       {bookshelf, 2, 0.3f}},
      // study
      {{desk, 11, 1},
       {bookshelf, 2, 1},
       {bookshelf, 2, 1},
       {desk, 11, 0.5f},
       {sofa, 1, 0.4f},
       {pillar, 0, 0.4f},
       {wardrobe, 10, 0.4f},
       {office_chair, 15, 0.9f},
       {clutter_heap, 8, 0.9f},
       {plant, 7, 0.7f},
       {floor_lamp, 6, 0.5f},
       {bicycle, 16, 0.4f}},
      // hall or corridor
      {{wardrobe, 10, 0.5f},
       {bicycle, 16, 0.5f},
       {sideboard, 3, 0.6f},
       {clutter_heap, 8, 0.9f},
       {plant, 7, 0.7f},
       {bookshelf, 2, 0.4f},
       {clutter_heap, 8, 0.5f}},
  };
  return kinds;
}

}  // namespace

Rect footprint(const Affine3f& frame, const Piece& piece) {
  Rect r{Vector2f::Constant(1e9f), Vector2f::Constant(-1e9f)};
  for (const float x : {-piece.width / 2, piece.width / 2}) {
    for (const float y : {0.0f, piece.depth}) {
      const Vector2f p = (frame * Vector3f(x, y, 0)).head<2>();
      r.low = r.low.cwiseMin(p);
      r.high = r.high.cwiseMax(p);
    }
  }
  return r;
}

void place_piece(House& house, const Affine3f& frame, const Piece& piece, std::uint64_t model) {
  for (const Affine3f& place : places_of(house, frame, piece))
    build_piece(house, place, piece, model);
}

void build_piece(House& house, const Affine3f& frame, const Piece& piece, std::uint64_t model) {
  house.obstacles.push_back({footprint(frame, piece), piece.height});
  MeshBuilder mesh(house.mesh);
  mesh.place(frame);
  Random details(mix64(model));
  piece.build(mesh, details);
}

void furnish(House& house, std::uint64_t seed) {
  Random order(hash_key(seed, Purpose::furniture));
  const int first = order.below(4);
  for (std::size_t i = 0; i < house.rooms.size(); ++i) {
    const Room& room = house.rooms[i];
    Furnisher filler(house, room, seed, Random(hash_key(seed, Purpose::furniture, i + 1)));
    Random& random = filler.random();
    const bool corridor = room.floor.size().minCoeff() < 2.2f;
    const int kind = corridor ? 4 : (first + static_cast<int>(i)) % 4;
    // Some rooms are nearly bare: walls and floor are all that registration has there.
    const float fullness = random.uniform(0.4f, 0.95f);
    if (!corridor && random.chance(0.4f)) filler.rug();
    if (kind == 2 || (kind == 0 && random.chance(0.4f)) || (kind == 3 && random.chance(0.3f))) {
      const bool round = random.chance(0.3f);
      if (const auto table =
              filler.in_the_middle(round ? round_table : dining_table, round ? 17 : 18, 0.45f)) {
        filler.chairs_around(table->first, table->second, random.between(3, 6));
      }
    } else if (kind == 0) {
      filler.in_the_middle(coffee_table, 19, 0.5f);
    }
    for (const Wish& wish : room_kinds()[static_cast<std::size_t>(kind)]) {
      if (random.chance(fullness * wish.chance)) filler.at_wall(wish.maker, wish.kind);
    }
    if (kind == 3 && random.chance(fullness)) filler.in_the_middle(office_chair, 15, 0.2f);
    if (kind == 0 && random.chance(fullness)) filler.in_the_middle(armchair, 4, 0.3f);
    if (random.chance(fullness)) filler.in_the_middle(clutter_heap, 8, 0.25f);
    filler.on_walls();
    filler.ceiling_lamp();
  }
  add_boxes(house);
}

}  // namespace gpureg::synthetic
